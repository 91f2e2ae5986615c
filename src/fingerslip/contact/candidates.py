"""Contact candidates: the boundary nodes that may touch, their frames, areas and penalties."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.contact.bodies import Plane
from fingerslip.errors import InputError, SlipOutsideContactError

__all__ = ["Candidates", "automatic_penalty", "check_outsiders", "find_candidates", "join_candidates"]

Array = NDArray[np.float64]

# Penalty over the stiffness E/h of the outermost row of cells: large enough that the penetration is a few per
# cent of that row's own squeezing, small enough that the contact problem stays well conditioned.
_PENALTY_RATIO = 10.0


@dataclass(frozen=True)
class Candidates:
    """Nodes that may touch rigid bodies; the arrays have one entry per node.

    Parameters
    ----------
    nodes : (n_c,) array
        Mesh nodes.
    body : (n_c,) array
        Index of the body that each may touch.
    frames : (n_c, dim, dim) array
        Rows are the body's unit normal and tangents.
    gap : (n_c,) array
        Gap in the reference configuration [m].
    area : (n_c,) array
        Tributary area [m^2].
    normal_stiffness, tangential_stiffness : (n_c,) array
        Penalties times areas [N/m].
    friction_coefficient : (n_c,) array
        [-].
    """

    nodes: NDArray[np.int64]
    body: NDArray[np.int64]
    frames: Array
    gap: Array
    area: Array
    normal_stiffness: Array
    tangential_stiffness: Array
    friction_coefficient: Array

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return int(self.frames.shape[-1])

    def local_operator(self, n_dofs: int) -> sparse.csr_matrix:
        """Return the map from displacements (n_dofs,) to local ones (n_c * dim,): normal first, node by node."""
        count, dim = len(self.nodes), self.dim
        rows = np.repeat(np.arange(count * dim), dim)
        columns = np.repeat(self.nodes * dim, dim * dim) + np.tile(np.arange(dim), count * dim)
        return sparse.csr_matrix((self.frames.ravel(), (rows, columns)), shape=(count * dim, n_dofs))


def automatic_penalty(youngs_modulus: float, facet_size: float) -> float:
    """Return the penalty [Pa/m] for a layer's modulus [Pa] and its facets' size [m]."""
    return _PENALTY_RATIO * youngs_modulus / facet_size


def find_candidates(
    plane: Plane,
    positions: Array,
    nodes: NDArray[np.int64],
    areas: Array,
    *,
    body: int,
    reach: float,
    friction_coefficient: float,
    penalties: tuple[float, float],
    where: str,
) -> Candidates:
    """Choose the nodes of a boundary that a plane may touch.

    Parameters
    ----------
    plane : Plane
        The body at the start.
    positions : (n_nodes, dim) array
        Positions of all nodes [m].
    nodes : (n,) array
        Nodes of the boundary.
    areas : (n_nodes,) array
        Tributary areas of all nodes [m^2].
    body : int
        Index of the body.
    reach : float
        Nodes with an initial gap beyond this are left out [m].
    friction_coefficient : float
        [-].
    penalties : tuple of float
        Normal and tangential penalty [Pa/m].
    where : str
        What errors name.

    Raises
    ------
    InputError
        Where the plane starts inside the deformable body, or too far away to touch it.
    """
    touching = plane.touching_offset(positions[nodes])
    gap = plane.gap(positions[nodes], touching if plane.offset is None else plane.offset)
    scale = float(np.ptp(positions, axis=0).max())
    if gap.min() < -1e-9 * scale:
        found = f"the plate starts {-gap.min() * 1e3:.4g} mm inside the body"
        allowed = f"needs an offset <= {touching * 1e3:.6g} mm"
        raise InputError(f"{where}.offset", found, allowed, "leave it out and the plate starts where it touches")
    chosen = (gap <= reach) & (areas[nodes] > 0.0)
    if not chosen.any():
        found = f"no node of the boundary is within {reach * 1e3:.4g} mm of the plate"
        raise InputError(where, found, "needs a programme or offset that brings the plate to it")
    nodes, gap = nodes[chosen], np.maximum(gap[chosen], 0.0)
    area = areas[nodes]
    return Candidates(
        nodes=nodes,
        body=np.full(nodes.size, body),
        frames=np.broadcast_to(_frame(plane), (nodes.size, positions.shape[1], positions.shape[1])).copy(),
        gap=gap,
        area=area,
        normal_stiffness=penalties[0] * area,
        tangential_stiffness=penalties[1] * area,
        friction_coefficient=np.full(nodes.size, friction_coefficient),
    )


def _frame(plane: Plane) -> Array:
    if len(plane.normal) == 2:
        return np.array([plane.unit_normal, plane.tangent])
    raise InputError("body.normal", "got three components", "needs two: contact is two-dimensional so far")


def join_candidates(parts: list[Candidates], dim: int) -> Candidates:
    """Put the candidates of several bodies into one set; an empty list gives an empty set."""
    if not parts:
        none, ints = np.zeros(0), np.zeros(0, dtype=np.int64)
        return Candidates(ints, ints, np.zeros((0, dim, dim)), none, none, none, none, none)
    fields = vars(parts[0])
    return Candidates(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in fields})


def check_outsiders(gaps: Array, nodes: NDArray[np.int64], positions: Array, time: float) -> None:
    """Refuse that a boundary node which is no candidate goes into the rigid body.

    Parameters
    ----------
    gaps : (n,) array
        Present gaps of the boundary's other nodes [m].
    nodes : (n,) array
        Their mesh nodes.
    positions : (n_nodes, dim) array
        Reference positions [m].
    time : float
        Present time [s].
    """
    if gaps.size and gaps.min() < 0.0:
        worst = int(np.argmin(gaps))
        x, y = positions[nodes[worst]][:2] * 1e3
        raise SlipOutsideContactError(
            f"contact at t = {time:.6g} s",
            f"node {nodes[worst]} at ({x:.4g}, {y:.4g}) mm reached the plate but is no contact candidate",
            "the plate may touch candidates only",
            "write a larger contact reach, or name a boundary that holds the whole contact",
        )
