"""Repair of scanned surfaces: debris, orientation, holes."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from fingerslip.arrays import Flags, Floats, Integers
from fingerslip.errors import MeshError
from fingerslip.mesh.facets import connected_pieces
from fingerslip.mesh.scan.surfaces import Surface, boundary_loops, check_area, edges_of, join_points

_DEBRIS = 0.01


@dataclass(frozen=True)
class Repairs:
    """What was repaired of a surface."""

    dropped_pieces: int  # pieces with less than a hundredth of the area
    turned_triangles: int  # triangles that were turned to face outwards
    closed_holes: tuple[float, ...]  # diameters of the holes that were closed [m]
    open_holes: tuple[float, ...]  # diameters of the holes that were left open [m]


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

    Examples
    --------
    A corner of a cube without its fourth triangle:

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> corners = np.vstack([np.zeros(3), 10e-3 * np.eye(3)])
    >>> scan = fs.Surface(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2]]))
    >>> closed, repairs = fs.repair_surface(scan, largest_hole=20e-3)
    >>> [f"{1e3 * diameter:.1f} mm" for diameter in repairs.closed_holes]
    ['16.3 mm']
    """
    check_area(surface)
    # Pieces are told apart by their points, so these are joined first; then those of the debris go.
    joined = Surface(*join_points(surface.points, surface.triangles), surface.name)
    piece = connected_pieces(len(joined.points), edges_of(joined.triangles).T)[joined.triangles[:, 0]]
    area, present = np.bincount(piece, weights=joined.areas), np.unique(piece)
    large = present[area[present] >= _DEBRIS * area.sum()]
    selected, dropped = joined.triangles[np.isin(piece, large)], len(present) - len(large)
    cleaned = Surface(*join_points(joined.points, selected), surface.name)
    inward = _find_inward(cleaned)
    oriented = dataclasses.replace(cleaned, triangles=_turn(cleaned.triangles, inward))
    closing, closed, still_open = [], [], []
    for loop in boundary_loops(oriented):
        rim = oriented.points[loop]
        diameter = float(2 * np.linalg.norm(rim - rim.mean(axis=0), axis=1).max())
        if diameter > largest_hole:
            still_open.append(diameter)
        else:
            closing.append(loop)
            closed.append(diameter)
    return _with_lids(oriented, closing), Repairs(dropped, int(inward.sum()), tuple(closed), tuple(still_open))


def closed_where(surface: Surface, lowest: float) -> Surface:
    """Close, of whatever size, the holes that lie wholly below a value of x [m]."""
    return _with_lids(surface, [loop for loop in boundary_loops(surface) if surface.points[loop, 0].max() < lowest])


def _find_inward(surface: Surface) -> Flags:
    """Return which triangles have to be turned so that all face outwards.

    Every triangle is there twice, as it is and turned round, and joined to those of its neighbours that face its way.
    """
    count, edges = len(surface.triangles), edges_of(surface.triangles)
    _, number, uses = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    # The pairs of triangles at edges of two of them, and which pairs face opposite ways.
    shared = np.flatnonzero(uses[number.ravel()] == 2)
    pairs = shared[np.argsort(number.ravel()[shared], kind="stable")].reshape(-1, 2).T
    (first, other), opposed = pairs % count, edges[pairs[0], 0] == edges[pairs[1], 0]
    as_it_is = np.stack([first, other + count * opposed])
    turned_round = np.stack([first + count, other + count * ~opposed])
    sides = connected_pieces(2 * count, np.hstack([as_it_is, turned_round])).reshape(2, count)
    if (sides[0] == sides[1]).any():
        raise MeshError(surface.name, "has one side only, as a Moebius strip has", "needs an inside and an outside")
    inward: Flags = sides[0] > sides[1]
    patch = sides.min(axis=0)
    for number in np.unique(patch):
        members = patch == number
        if Surface(surface.points, _turn(surface.triangles[members], inward[members])).volume < 0:
            inward[members] ^= True
    return inward


def _turn(triangles: Integers, chosen: Flags) -> Integers:
    return np.where(chosen[:, None], triangles[:, ::-1], triangles)


def _with_lids(surface: Surface, loops: list[Integers]) -> Surface:
    """Close each loop by triangles around a lifted middle point."""
    if not loops:
        return surface
    # The normals of the points are means over their triangles weighted by area.
    normals, first = np.zeros_like(surface.points), len(surface.points)
    for corner in range(3):
        np.add.at(normals, surface.triangles[:, corner], surface.normals)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), np.finfo(float).tiny)[:, None]
    middles = [_middle(surface.points[loop], normals[loop]) for loop in loops]
    lids = [
        np.column_stack([loop, np.roll(loop, -1), np.full(len(loop), middle)])
        for middle, loop in enumerate(loops, start=first)
    ]
    points, triangles = np.vstack([surface.points, middles]), np.vstack([surface.triangles, *lids])
    return dataclasses.replace(surface, points=points, triangles=triangles)


def _middle(rim: Floats, normals: Floats) -> Floats:
    """Return the middle of a lid: half as far out as the tangent planes of the rim meet, as on a sphere."""
    centre: Floats = rim.mean(axis=0)
    outwards = normals.mean(axis=0)
    length = float(np.linalg.norm(outwards))
    if length < 0.3:  # the rim of a tube, whose normals say nothing about its end
        return centre
    return np.asarray(centre + outwards / length * float(np.sum((rim - centre) * normals, axis=1).mean()) / 2)
