"""Contact candidates: the boundary nodes that may touch, their frames, areas and penalties."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.contact.counterfaces import Counterface, Plane
from fingerslip.contact.frames import contact_frames, sliding_direction
from fingerslip.contact.friction import Anisotropic, FrictionLaw
from fingerslip.errors import InputError, SlipOutsideContactError
from fingerslip.fe.space import vector_dofs

__all__ = [
    "Candidates",
    "Counterfaces",
    "automatic_penalty",
    "check_outsiders",
    "find_candidates",
    "join_candidates",
    "node_operator",
]

Array = NDArray[np.float64]

# Penalty over the stiffness E/h of the outermost row of cells: large enough that the penetration is a few per
# cent of that row's own squeezing, small enough that the contact problem stays well conditioned.
_PENALTY_RATIO = 10.0


@dataclass(frozen=True)
class Candidates:
    """Nodes that may touch counterfaces; the arrays have one entry per node.

    Parameters
    ----------
    nodes : (n_c,) array
        Mesh nodes.
    counterface : (n_c,) array
        Index of the body that each may touch.
    positions : (n_c, dim) array
        Reference positions [m].
    area : (n_c,) array
        Tributary area [m^2].
    normal_stiffness, tangential_stiffness : (n_c,) array
        Penalties times areas [N/m].
    """

    nodes: NDArray[np.int64]
    counterface: NDArray[np.int64]
    positions: Array
    area: Array
    normal_stiffness: Array
    tangential_stiffness: Array

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return int(self.positions.shape[1])


@dataclass(frozen=True)
class Counterfaces:
    """The counterfaces that candidates may touch, and the friction there.

    Parameters
    ----------
    shapes : tuple of Counterface
        The counterfaces, placed.
    friction : tuple of FrictionLaw
        The friction law on each.
    """

    shapes: tuple[Counterface, ...]
    friction: tuple[FrictionLaw, ...]

    @property
    def flat(self) -> bool:
        """Whether all counterfaces are planes, so that frames never turn."""
        return all(isinstance(counterface, Plane) for counterface in self.shapes)

    def gaps(self, points: Array, counterface: NDArray[np.int64]) -> Array:
        """Return the gap [m] of `points` (n, dim) [m], given relative to where their counterfaces started."""
        gaps = np.zeros(len(points))
        for number, surface in enumerate(self.shapes):
            own = counterface == number
            gaps[own] = surface.gap(points[own])
        return gaps

    def normals(self, points: Array, counterface: NDArray[np.int64]) -> Array:
        """Return the outward unit normals (n, dim) at `points`."""
        normals = np.zeros_like(points)
        for number, surface in enumerate(self.shapes):
            own = counterface == number
            normals[own] = surface.normals(points[own])
        return normals

    def frames(self, points: Array, counterface: NDArray[np.int64]) -> Array:
        """Return the frames (n, dim, dim) at `points`, normal first.

        With anisotropic friction the second tangent is stretched by the ratio of the coefficients, which turns
        the ellipse of the friction cone into a circle while force times displacement stays what it is.
        """
        frames = np.zeros((len(points), points.shape[1], points.shape[1]))
        for number, (surface, law) in enumerate(zip(self.shapes, self.friction, strict=True)):
            own = counterface == number
            direction = sliding_direction(surface.unit_normal)
            if isinstance(law, Anisotropic):
                direction = np.asarray(law.direction)
            frames[own] = contact_frames(surface.normals(points[own]), direction)
            if isinstance(law, Anisotropic):
                frames[own, 2] *= law.across / law.along
        return frames

    def coefficients(self, pressure: Array, slip_rate: Array, counterface: NDArray[np.int64]) -> Array:
        """Return the friction coefficient of each node, shape (n,)."""
        values = np.zeros(len(counterface))
        for number, law in enumerate(self.friction):
            own = counterface == number
            values[own] = law.coefficients(pressure[own], slip_rate[own])
        return values


def node_operator(nodes: NDArray[np.int64], dim: int, n_dofs: int) -> sparse.csr_matrix:
    """Return the map from displacements (n_dofs,) to those of `nodes`, shape (n * dim, n_dofs)."""
    columns = vector_dofs(nodes, dim).ravel()
    ones = np.ones(columns.size)
    return sparse.csr_matrix((ones, (np.arange(columns.size), columns)), shape=(columns.size, n_dofs))


def automatic_penalty(stiffness: float, facet_size: float) -> float:
    """Return the penalty [Pa/m] for the stiffness of a layer's material [Pa] and its facets' size [m]."""
    return _PENALTY_RATIO * stiffness / facet_size


def find_candidates(
    surface: Counterface,
    positions: Array,
    nodes: NDArray[np.int64],
    areas: Array,
    *,
    counterface: int,
    search_distance: float,
    penalties: tuple[float, float],
    where: str,
) -> Candidates:
    """Choose the nodes of a boundary that a counterface may touch.

    Parameters
    ----------
    surface : Counterface
        The counterface, placed at its start.
    positions : (n_nodes, dim) array
        Positions of all nodes [m].
    nodes : (n,) array
        Nodes of the boundary.
    areas : (n_nodes,) array
        Tributary areas of all nodes [m^2].
    counterface : int
        Index of the body.
    search_distance : float
        Nodes with an initial gap beyond this are left out [m].
    penalties : tuple of float
        Normal and tangential penalty [Pa/m].
    where : str
        What errors name.

    Raises
    ------
    InputError
        Where the counterface starts inside the deformable one, or too far away to touch it.
    """
    gap = surface.gap(positions[nodes])
    if gap.min() < -1e-9 * float(np.ptp(positions, axis=0).max()):
        _refuse_start_inside(surface, float(gap.min()), where)
    # Corner nodes of quadratic tetrahedra have no area of their own: the mid-side nodes carry all of it.
    chosen = (gap <= search_distance) & (areas[nodes] > 1e-9 * areas[nodes].max())
    if not chosen.any():
        found = f"no node of the boundary is within {search_distance * 1e3:.4g} mm of the plate"
        raise InputError(where, found, "needs a programme or offset that brings the plate to it")
    nodes = nodes[chosen]
    area = areas[nodes]
    return Candidates(
        nodes=nodes,
        counterface=np.full(nodes.size, counterface),
        positions=positions[nodes],
        area=area,
        normal_stiffness=penalties[0] * area,
        tangential_stiffness=penalties[1] * area,
    )


def _refuse_start_inside(surface: Counterface, gap: float, where: str) -> None:
    found = f"the plate starts {-gap * 1e3:.4g} mm inside the body"
    if isinstance(surface, Plane):
        allowed = f"needs an offset <= {((surface.offset or 0.0) + gap) * 1e3:.6g} mm"
        raise InputError(f"{where}.offset", found, allowed, "leave it out and the plate starts where it touches")
    raise InputError(f"{where}.centre", found, "needs to start outside", "leave it out and it starts where it touches")


def join_candidates(parts: list[Candidates], dim: int) -> Candidates:
    """Put the candidates of several counterfaces into one set; an empty list gives an empty set."""
    if not parts:
        none, ints = np.zeros(0), np.zeros(0, dtype=np.int64)
        return Candidates(ints, ints, np.zeros((0, dim)), none, none, none)
    fields = vars(parts[0])
    return Candidates(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in fields})


def check_outsiders(gaps: Array, nodes: NDArray[np.int64], positions: Array, time: float) -> None:
    """Refuse that a boundary node which is no candidate goes into the counterface.

    Parameters
    ----------
    gaps : (n,) array
        Present gaps of the boundary's other nodes [m].
    nodes : (n,) array
        Their mesh nodes.
    positions : (n, dim) array
        Their reference positions [m].
    time : float
        Present time [s].
    """
    if gaps.size and gaps.min() < 0.0:
        worst = int(np.argmin(gaps))
        place = ", ".join(f"{value * 1e3:.4g}" for value in positions[worst])
        raise SlipOutsideContactError(
            f"contact at t = {time:.6g} s",
            f"node {nodes[worst]} at ({place}) mm reached the plate but is no contact candidate",
            "the plate may touch candidates only",
            "write a larger search_distance, or name a boundary that holds the whole contact",
        )
