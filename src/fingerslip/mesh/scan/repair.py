"""Repair of scanned surfaces: debris, orientation, holes."""

from __future__ import annotations

import dataclasses
from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import MeshError
from fingerslip.mesh.scan.surfaces import Surface, boundary_loops, check_area, join_points

if TYPE_CHECKING:
    from scipy.sparse import coo_matrix

__all__ = ["Repairs", "closed_where", "repair_surface"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_DEBRIS = 0.01


@dataclass(frozen=True)
class Repairs:
    """What was repaired of a surface.

    Parameters
    ----------
    dropped_pieces : int
        Pieces with less than a hundredth of the area, which were dropped.
    turned_triangles : int
        Triangles that were turned to face outwards.
    closed_holes : tuple of float
        Diameters of the holes that were closed [m].
    open_holes : tuple of float
        Diameters of the holes that were left open [m].
    """

    dropped_pieces: int
    turned_triangles: int
    closed_holes: tuple[float, ...]
    open_holes: tuple[float, ...]


def repair_surface(surface: Surface, largest_hole: float = 5e-3) -> tuple[Surface, Repairs]:
    """Join points at the same place, drop debris, turn all normals outwards and close holes.

    A hole is closed by triangles around a point that is lifted so that the lid goes on with the curvature of the
    surface around it. Self-intersections are left to the mesher, which resolves them.

    Parameters
    ----------
    surface : Surface
        The surface.
    largest_hole : float
        Diameter up to which holes are closed [m].

    Returns
    -------
    tuple of Surface and Repairs
        The repaired surface, and what was done. Larger holes, such as the proximal end of a scan, are still open.

    Raises
    ------
    MeshError
        Where inside and outside cannot be told apart, or no triangle has an area.
    """
    check_area(surface)
    # Pieces are told apart by their points, so these are joined first; then those of the debris go.
    points, triangles = join_points(surface.points, surface.triangles)
    selected, dropped = _without_debris(dataclasses.replace(surface, points=points, triangles=triangles))
    points, triangles = join_points(points, selected)
    cleaned = dataclasses.replace(surface, points=points, triangles=triangles)
    turned = _find_inward(cleaned)
    oriented = dataclasses.replace(cleaned, triangles=np.where(turned[:, None], triangles[:, ::-1], triangles))
    loops = boundary_loops(oriented)
    sizes = [_diameter(points[loop]) for loop in loops]
    closing = [loop for loop, size in zip(loops, sizes, strict=True) if size <= largest_hole]
    repairs = Repairs(
        dropped,
        int(turned.sum()),
        tuple(size for size in sizes if size <= largest_hole),
        tuple(size for size in sizes if size > largest_hole),
    )
    return _with_lids(oriented, closing), repairs


def closed_where(surface: Surface, lowest: float) -> Surface:
    """Close, of whatever size, the holes that lie wholly below a value of x.

    Units: lowest [m].
    """
    loops = boundary_loops(surface)
    return _with_lids(surface, [loop for loop in loops if surface.points[loop, 0].max() < lowest])


def _without_debris(surface: Surface) -> tuple[Integers, int]:
    """Return the triangles of all pieces but the tiny ones, and how many pieces were dropped."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    triangles = surface.triangles
    first, second = triangles.T[[0, 1]].ravel(), triangles.T[[1, 2]].ravel()
    graph = coo_matrix((np.ones(len(first)), (first, second)), shape=(len(surface.points),) * 2)
    piece = connected_components(graph, directed=False)[1][triangles[:, 0]]
    area = np.bincount(piece, weights=surface.areas)
    present = np.unique(piece)
    large = present[area[present] >= _DEBRIS * area.sum()]
    return triangles[np.isin(piece, large)], len(present) - len(large)


def _find_inward(surface: Surface) -> NDArray[np.bool_]:
    """Return which triangles have to be turned so that all face outwards."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    pairs, opposed = _neighbours(surface)
    count = len(surface.triangles)
    ones = np.ones(len(pairs))
    graph = coo_matrix((ones, (pairs[:, 0], pairs[:, 1])), shape=(count, count)).tocsr()
    patches, patch = connected_components(graph, directed=False)
    turned = _consistent(graph, patch, patches, pairs, opposed)
    if np.any((turned[pairs[:, 0]] ^ turned[pairs[:, 1]]) != opposed):
        raise MeshError(surface.name, "has one side only, as a Moebius strip has", "needs an inside and an outside")
    for number in range(patches):
        members = patch == number
        nodes = np.where(turned[members, None], surface.triangles[members, ::-1], surface.triangles[members])
        if Surface(surface.points, nodes).volume < 0:
            turned[members] ^= True
    return turned


def _neighbours(surface: Surface) -> tuple[Integers, NDArray[np.bool_]]:
    """Return the pairs of triangles at edges that two of them share, and which of the pairs face opposite ways."""
    triangles = surface.triangles
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    owner = np.tile(np.arange(len(triangles)), 3)
    low, high = np.sort(edges, axis=1).T
    keys, first_index, number = np.unique(low * len(surface.points) + high, return_inverse=True, return_counts=True)
    order = np.argsort(first_index.ravel(), kind="stable")
    first = np.searchsorted(first_index.ravel()[order], np.arange(len(keys)))[number == 2]
    first_row, other = order[first], order[first + 1]
    return np.column_stack([owner[first_row], owner[other]]), edges[first_row, 0] == edges[other, 0]


def _consistent(
    graph: coo_matrix, patch: Integers, patches: int, pairs: Integers, opposed: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Turn triangles so that all of a patch face the way of its first one."""
    from scipy.sparse.csgraph import breadth_first_order

    count = len(patch)
    differs = defaultdict(bool, {(int(a), int(b)): bool(o) for (a, b), o in zip(pairs, opposed, strict=True)})
    turned = np.zeros(count, dtype=bool)
    starts = np.unique(patch, return_index=True)[1]
    for number in range(patches):
        order, before = breadth_first_order(graph, int(starts[number]), directed=False)
        for node in order[1:]:
            ahead = int(before[node])
            turned[node] = turned[ahead] ^ (differs[ahead, int(node)] or differs[int(node), ahead])
    return turned


def _diameter(points: Floats) -> float:
    return float(2 * np.linalg.norm(points - points.mean(axis=0), axis=1).max())


def _with_lids(surface: Surface, loops: list[Integers]) -> Surface:
    """Close each loop by triangles around a lifted middle point."""
    if not loops:
        return surface
    normals = _point_normals(surface)
    middles = [_middle(surface.points[loop], normals[loop]) for loop in loops]
    first = len(surface.points)
    lids = [
        np.column_stack([loop, np.roll(loop, -1), np.full(len(loop), first + number)])
        for number, loop in enumerate(loops)
    ]
    points = np.vstack([surface.points, middles])
    return dataclasses.replace(surface, points=points, triangles=np.vstack([surface.triangles, *lids]))


def _middle(rim: Floats, normals: Floats) -> Floats:
    """Return the middle of a lid: half as far out as the tangent planes of the rim meet, as on a sphere."""
    centre: Floats = rim.mean(axis=0)
    outwards = normals.mean(axis=0)
    length = float(np.linalg.norm(outwards))
    if length < 0.3:  # the rim of a tube, whose normals say nothing about its end
        return centre
    lift: Floats = centre + outwards / length * float(np.sum((rim - centre) * normals, axis=1).mean()) / 2
    return lift


def _point_normals(surface: Surface) -> Floats:
    """Return the unit normals of the points, means over their triangles weighted by area."""
    a, b, c = np.moveaxis(surface.corners, 1, 0)
    across = np.cross(b - a, c - a)
    normals = np.zeros_like(surface.points)
    for corner in range(3):
        np.add.at(normals, surface.triangles[:, corner], across)
    unit: Floats = normals / np.maximum(np.linalg.norm(normals, axis=1), np.finfo(float).tiny)[:, None]
    return unit
