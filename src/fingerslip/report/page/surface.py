"""The surfaces of the layers of a solid, and the section where a plane cuts it open, as triangles that move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.history import nearest_record
from fingerslip.report.scene.scene import region_names

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Surface", "surface_arrays"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: State of a vertex that never may touch.
NO_CONTACT = 255

_TETRAHEDRON_FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
_CUBE_FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
# A cube as six tetrahedra around its diagonal from the first to the seventh corner.
_CUBE_TETRAHEDRA = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
_EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))
# The ends of the edges on whose middles a quadratic tetrahedron has its fifth to tenth node, in the order of VTK.
_MIDDLES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))


@dataclass(frozen=True)
class Surface:
    """Triangles of a solid at several frames.

    Parameters
    ----------
    points : (n, 3) array
        Reference positions of the vertices [m].
    moved : (n_frames, n, 3) array
        Their displacements [m].
    stress : (n_frames, n) array
        Von Mises stress, the mean over the cells of the layer around a vertex [Pa].
    states : (n_frames, n) array of uint8
        State of the contact, 255 where a vertex may never touch.
    triangles : (m, 3) array
        Vertices of each triangle.
    regions : (m,) array
        Number of its layer.
    is_cut : (m,) array of bool
        Whether it lies in the plane that cuts the body open.
    cut_at : float
        Where that plane stands along z [m].
    """

    points: Floats
    moved: Floats
    stress: Floats
    states: NDArray[np.uint8]
    triangles: Integers
    regions: Integers
    is_cut: NDArray[np.bool_]
    cut_at: float


@dataclass(frozen=True)
class _Part:
    """The triangles of one layer: each vertex is a mean of two nodes, `share` of the second."""

    pairs: Integers
    share: Floats
    triangles: Integers
    is_cut: bool
    region: int


def surface_arrays(history: xr.Dataset, frames: Sequence[int]) -> Surface:
    """Return the surfaces of all layers, and the section across z through the middle of the body."""
    points = history["node_position"].values
    # A little beside the middle, where the nodes of symmetric meshes lie.
    cut_at = float(points[:, 2].mean() + 1e-5 * np.ptp(points[:, 2]))
    corners, cell_region = _corners(history), history["cell_region"].values
    parts = []
    for number in range(max(len(region_names(history)), 1)):
        own = corners[cell_region == number]
        if own.size:
            parts += [_outside(own, number), _cut(own, points, cut_at, number)]
    return _join(history, list(frames), [part for part in parts if part.triangles.size], cut_at)


def _corners(history: xr.Dataset) -> Integers:
    return np.asarray(history["cell_nodes"].values[:, : 8 if history.attrs["element"] == "H8" else 4], dtype=np.int64)


def _outside(cells: Integers, region: int) -> _Part:
    """Return the faces of cells that only one of them has."""
    faces = np.concatenate([cells[:, face] for face in (_CUBE_FACES if cells.shape[1] == 8 else _TETRAHEDRON_FACES)])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    outer = faces[first[count == 1]]
    triangles = outer if outer.shape[1] == 3 else np.concatenate([outer[:, [0, 1, 2]], outer[:, [0, 2, 3]]])
    nodes, numbered = np.unique(triangles, return_inverse=True)
    pairs = np.stack([nodes, nodes], axis=1)
    return _Part(pairs, np.zeros(len(nodes)), numbered.reshape(triangles.shape), False, region)


def _cut(cells: Integers, points: Floats, cut_at: float, region: int) -> _Part:
    """Return the triangles in which the plane z = cut_at meets tetrahedra; their vertices lie on edges."""
    tetrahedra = np.concatenate([cells[:, part] for part in _CUBE_TETRAHEDRA]) if cells.shape[1] == 8 else cells
    height = points[:, 2] - cut_at
    above = height[tetrahedra] > 0.0
    crossed = np.stack([above[:, i] != above[:, j] for i, j in _EDGES], axis=1)
    corners = np.concatenate([_corners_of_cut(tetrahedra, crossed, count) for count in (3, 4)])
    if not corners.size:
        return _Part(np.zeros((0, 2), dtype=np.int64), np.zeros(0), np.zeros((0, 3), dtype=np.int64), True, region)
    edges, numbered = np.unique(np.sort(corners.reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    ends = height[edges]
    share = ends[:, 0] / (ends[:, 0] - ends[:, 1])
    triangles = numbered.reshape(-1, 3)
    places = points[edges[:, 0]] + share[:, None] * (points[edges[:, 1]] - points[edges[:, 0]])
    # All face one way: the normals of their vertices are sums over triangles.
    first, second = (places[triangles[:, corner]] - places[triangles[:, 0]] for corner in (1, 2))
    backward = np.cross(first, second)[:, 2] < 0.0
    triangles[backward] = triangles[backward][:, ::-1]
    return _Part(edges, share, triangles, True, region)


def _corners_of_cut(tetrahedra: Integers, crossed: NDArray[np.bool_], count: int) -> Integers:
    """Return the edges (m, 3, 2) whose points are the corners of triangles, of cells with `count` crossed edges."""
    own = np.flatnonzero(crossed.sum(axis=1) == count)
    if not own.size:
        return np.zeros((0, 3, 2), dtype=np.int64)
    which = np.nonzero(crossed[own])[1].reshape(-1, count)
    ends = np.array(_EDGES)[which]
    edges = np.take_along_axis(tetrahedra[own], ends.reshape(len(own), -1), axis=1).reshape(len(own), count, 2)
    if count == 3:
        return edges
    # In the order of _EDGES, neighbours of the quadrilateral are 0-1, 1-3, 3-2 and 2-0.
    return np.concatenate([edges[:, [0, 1, 3]], edges[:, [0, 3, 2]]])


def _join(history: xr.Dataset, frames: list[int], parts: Sequence[_Part], cut_at: float) -> Surface:
    points, moved = history["node_position"].values, history["snapshot_displacement"].values[frames]
    starts = np.cumsum([0, *(len(part.pairs) for part in parts)])
    lengths = [len(part.triangles) for part in parts]

    def between(part: _Part, values: Any) -> Floats:
        share = part.share[:, None]
        found: Floats = (1.0 - share) * values[..., part.pairs[:, 0], :] + share * values[..., part.pairs[:, 1], :]
        return found

    nodal = {part.region: _nodal_stress(history, frames, part.region)[..., None] for part in parts}
    return Surface(
        points=np.concatenate([between(part, points) for part in parts]),
        moved=np.concatenate([between(part, moved) for part in parts], axis=1),
        stress=np.concatenate([between(part, nodal[part.region])[..., 0] for part in parts], axis=1),
        states=np.concatenate([_states(history, frames, part) for part in parts], axis=1),
        triangles=np.concatenate([part.triangles + start for part, start in zip(parts, starts, strict=False)]),
        regions=np.repeat([part.region for part in parts], lengths),
        is_cut=np.repeat([part.is_cut for part in parts], lengths),
        cut_at=cut_at,
    )


def _nodal_stress(history: xr.Dataset, frames: list[int], region: int) -> Floats:
    """Return the mean von Mises stress of the cells of a layer around each node, shape (n_frames, n_nodes) [Pa]."""
    own = history["cell_region"].values == region
    cells, stress = _corners(history)[own], history["snapshot_von_mises"].values[frames][:, own]
    count = np.bincount(cells.ravel(), minlength=history.sizes["node"])
    sums = np.stack(
        [np.bincount(cells.ravel(), np.repeat(one, cells.shape[1]), history.sizes["node"]) for one in stress]
    )
    found: Floats = sums / np.maximum(count, 1)
    return found


def _states(history: xr.Dataset, frames: list[int], part: _Part) -> NDArray[np.uint8]:
    """Return the states of the contact at the vertices of a part; those on edges have none."""
    times = history["snapshot_time"].values[frames]
    records = [nearest_record(history, float(time)) for time in times]
    of_nodes = np.full((len(frames), history.sizes["node"]), NO_CONTACT, dtype=np.uint8)
    of_nodes[:, history["contact_node"].values] = history["contact_state"].values[records]
    if history.attrs["element"] == "T10":
        _add_corners(of_nodes, history["cell_nodes"].values)
    states: NDArray[np.uint8] = of_nodes[:, part.pairs[:, 0]]
    if part.is_cut:
        states[:] = NO_CONTACT
    return states


def _add_corners(of_nodes: NDArray[np.uint8], cells: Integers) -> None:
    """Give corners the state of most candidates around them: quadratic tetrahedra touch with the middles of edges."""
    ends = [cells[:, [end, 4 + middle]] for middle, both in enumerate(_MIDDLES) for end in both]
    corners, middles = np.unique(np.concatenate(ends), axis=0).T
    order = (SLIP, STICK, OPEN)  # the first of equally many
    counts = np.array([[np.bincount(corners, row[middles] == state, len(row)) for row in of_nodes] for state in order])
    beside = (of_nodes == NO_CONTACT) & counts.any(axis=0)
    of_nodes[beside] = np.array(order, dtype=np.uint8)[counts.argmax(axis=0)[beside]]
