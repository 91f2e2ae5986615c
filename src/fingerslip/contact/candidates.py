"""Contact candidates: the boundary nodes that may touch, with their areas and penalties, and what they may touch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from fingerslip.arrays import Flags, Floats, Integers
from fingerslip.contact.counterfaces import Counterface, contact_frames, sliding_direction
from fingerslip.contact.friction import Conditions, FrictionLaw
from fingerslip.errors import InputError, SlipOutsideContactError
from fingerslip.fe.space import vector_dofs

# Penalty over the stiffness E/h of the outermost row of cells: large enough that the penetration is a few per
# cent of that row's own compression, small enough that the contact problem stays well conditioned.
_PENALTY_RATIO = 10.0
# A search distance that is proposed, over the one that was needed so far.
_HALF_MORE = 1.5
# By dimensions, of a curved counterface: points along a side of its outline, how far these reach to each side over the
# largest extent of the body, and how much closer they are in the middle, as the exponent of a hyperbolic sine.
_POINTS, _REACH, _GRADING = {2: 121, 3: 25}, {2: 2.0, 3: 0.6}, {2: 5.0, 3: 2.0}
# Projections onto the surface; the first is exact where a gap is a distance.
_PROJECTIONS = 3


@dataclass(frozen=True)
class Candidates:
    """Nodes that may touch counterfaces; the arrays have one entry per node."""

    nodes: Integers  # (n_c,), mesh nodes
    counterface: Integers  # (n_c,), index of the counterface that each may touch
    positions: Floats  # (n_c, dim), reference positions [m]
    area: Floats  # (n_c,), tributary areas [m^2]
    normal_stiffness: Floats  # (n_c,), normal penalties times areas [N/m]
    tangential_stiffness: Floats  # (n_c,), tangential penalties times areas [N/m]

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return int(self.positions.shape[1])


@dataclass(frozen=True)
class Counterfaces:
    """The counterfaces that candidates may touch, with the friction on each.

    In the methods, `points` (n, dim) [m] are positions relative to where the counterfaces started, and `counterface`
    (n,) holds the index of the counterface that each point belongs to.
    """

    shapes: tuple[Counterface, ...]  # the counterfaces, placed
    friction: tuple[FrictionLaw, ...]  # the friction law on each

    @property
    def are_flat(self) -> bool:
        """Whether all of them are flat, so that frames never turn."""
        return all(shape.is_flat for shape in self.shapes)

    def gaps(self, points: Floats, counterface: Integers) -> Floats:
        """Return the gaps, shape (n,) [m]."""
        gaps = np.zeros(len(points))
        for shape, _, rows in self._each(counterface):
            gaps[rows] = shape.gap(points[rows])
        return gaps

    def normals(self, points: Floats, counterface: Integers) -> Floats:
        """Return the outward unit normals, shape (n, dim) [-]."""
        normals = np.zeros_like(points)
        for shape, _, rows in self._each(counterface):
            normals[rows] = shape.normals(points[rows])
        return normals

    def frames(self, points: Floats, counterface: Integers) -> Floats:
        """Return the frames that the friction laws ask for, shape (n, dim, dim) [-]; rows normal, then tangents."""
        frames = np.zeros((len(points), points.shape[1], points.shape[1]))
        for shape, law, rows in self._each(counterface):
            wanted = law.frame
            direction = sliding_direction(shape.unit_normal) if wanted.direction is None else wanted.direction
            frames[rows] = contact_frames(shape.normals(points[rows]), np.asarray(direction))
            frames[rows, 2:] *= wanted.stretch
        return frames

    def coefficients(self, conditions: Conditions, counterface: Integers) -> Floats:
        """Return the friction coefficient of every node under the given conditions, shape (n,) [-]."""
        values = np.zeros(len(counterface))
        for _, law, rows in self._each(counterface):
            values[rows] = law.coefficients(conditions.at(rows))
        return values

    def _each(self, counterface: Integers) -> Iterator[tuple[Counterface, FrictionLaw, Flags | slice]]:
        """Yield the counterfaces with their laws and the points of each; of the only one all, which needs no mask."""
        for number, (shape, law) in enumerate(zip(self.shapes, self.friction, strict=True)):
            yield shape, law, slice(None) if len(self.shapes) == 1 else counterface == number


def node_operator(nodes: Integers, dim: int, n_dofs: int) -> sparse.csr_matrix:
    """Return the map [-] from displacements (n_dofs,) to those of `nodes`, shape (n * dim, n_dofs)."""
    columns = vector_dofs(nodes, dim).ravel()
    ones = np.ones(columns.size)
    return sparse.csr_matrix((ones, (np.arange(columns.size), columns)), shape=(columns.size, n_dofs))


def automatic_penalty(stiffness: float, facet_size: float) -> float:
    """Return the penalty [Pa/m] for the stiffness of a layer's material [Pa] and its facets' size [m]."""
    return _PENALTY_RATIO * stiffness / facet_size


def find_candidates(
    shape: Counterface,
    positions: Floats,
    nodes: Integers,
    areas: Floats,
    *,
    counterface: int,
    search_distance: float,
    penalties: tuple[float, float],
    where: str,
) -> Candidates:
    """Choose the nodes of a boundary that a counterface may touch.

    Arrays: positions (n_nodes, dim) [m]; nodes (n,); areas (n_nodes,) [m^2]; search_distance [m]; penalties [Pa/m].
    """
    gap = shape.gap(positions[nodes])
    if gap.min() < -1e-9 * float(np.ptp(positions, axis=0).max()):
        field, allowed = shape.start_hint(float(gap.min()))
        fault = f"the counterface starts {-gap.min() * 1e3:.4g} mm inside the body"
        repair = "leave it out and the counterface starts where it touches"
        raise InputError(f"{where}.{field}", fault, allowed, repair)
    # Corner nodes of quadratic tetrahedra have no area of their own: the mid-side nodes carry all of it.
    chosen = (gap <= search_distance) & (areas[nodes] > 1e-9 * areas[nodes].max())
    if not chosen.any():
        fault = f"no node of the boundary is within {search_distance * 1e3:.4g} mm of the counterface"
        raise InputError(where, fault, "needs a programme or a start that brings the counterface to it")
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


def join_candidates(candidates: list[Candidates], dim: int) -> Candidates:
    """Join the candidates of several counterfaces; an empty list gives an empty set in `dim` dimensions."""
    if not candidates:
        none, ints = np.zeros(0), np.zeros(0, dtype=np.int64)
        return Candidates(ints, ints, np.zeros((0, dim)), none, none, none)
    fields = vars(candidates[0])
    return Candidates(**{name: np.concatenate([getattr(part, name) for part in candidates]) for name in fields})


def check_outsiders(
    gaps: Floats,
    nodes: Integers,
    positions: Floats,
    time: float,
    *,
    shape: Counterface,
    number: int,
    searched: float | None,
) -> None:
    """Refuse penetration by a boundary node that is no candidate.

    Arrays: gaps (n,) [m]; nodes (n,); positions (n, dim) [m]; time [s]. `shape` is the counterface at its start, the
    `number`-th, and `searched` its search distance where one is given [m].
    """
    if not gaps.size or gaps.min() >= 0.0:
        return
    worst = int(np.argmin(gaps))
    position = ", ".join(f"{value * 1e3:.4g}" for value in positions[worst])
    needed = _HALF_MORE * float(shape.gap(positions[gaps < 0.0]).max())
    within = "some of its nodes" if searched is None else f"nodes within {searched * 1e3:.4g} mm at the start"
    digit = 10.0 ** (np.floor(np.log10(max(needed, 1e-9))) - 1.0)
    enough = f"{1e3 * digit * np.ceil(needed / digit - 1e-9):.4g} mm"
    reached = f"node {nodes[worst]} at ({position}) mm reached the counterface but is no contact candidate"
    raise SlipOutsideContactError(
        f"contacts.{number}.search_distance",
        f"at t = {time:.6g} s: {reached}",
        f"only {within} may touch the counterface",
        f"write a larger search_distance, such as {enough}, or name a boundary that holds the whole contact",
    )


def counterface_outlines(shapes: Sequence[Counterface], candidates: Candidates, extent: float) -> Floats:
    """Return outlines for pictures and other programs: points of placed counterfaces near the body at the start.

    They are (n, rows, columns, dim) [m], one column in 2D, the ends alone of flat ones; `extent` is the largest of the
    body [m].
    """
    dim = candidates.dim
    steps = np.array([-1.0, 1.0])
    if not all(shape.is_flat for shape in shapes):
        steps = np.sinh(_GRADING[dim] * np.linspace(-1.0, 1.0, _POINTS[dim])) / np.sinh(_GRADING[dim])
    outlines = [
        _outline(shape, candidates.positions[candidates.counterface == number], _REACH[dim] * extent * steps)
        for number, shape in enumerate(shapes)
    ]
    return np.reshape(outlines, (len(shapes), steps.size, steps.size if dim == 3 else 1, dim))


def _outline(shape: Counterface, near: Floats, steps: Floats) -> Floats:
    """Return what a tangent grid, of steps (n,) [m] around the middle of points (k, dim) [m], is projected to."""
    normal = shape.unit_normal
    tangents = contact_frames(normal[None], sliding_direction(normal))[0, 1:]
    sides = np.meshgrid(*[steps] * len(tangents), indexing="ij")
    middle = 0.5 * (near.min(axis=0) + near.max(axis=0))
    grid = _projected(shape, middle[None]) + np.stack([side.ravel() for side in sides], axis=1) @ tangents
    # From outside: points within a ball would go to its far side.
    return _projected(shape, grid - min(float(shape.gap(grid).min()), 0.0) * normal)


def _projected(shape: Counterface, points: Floats) -> Floats:
    """Return the points of a surface that are nearest to points (n, dim) [m]."""
    for _ in range(_PROJECTIONS):
        points = points - shape.gap(points)[:, None] * shape.normals(points)
    return points
