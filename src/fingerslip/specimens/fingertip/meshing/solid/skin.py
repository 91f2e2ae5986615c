"""The skin in space: triangles on the outer surface, swept inward along its normals and cut into tetrahedra."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingerslip.errors import InputError
from fingerslip.mesh.patches import Triangulation, mesh_surface
from fingerslip.mesh.sizes import GROWTH, ElementSizes
from fingerslip.specimens.fingertip.numbers import FingertipNumbers
from fingerslip.specimens.fingertip.pose import posed
from fingerslip.specimens.fingertip.relief import relief_depth
from fingerslip.specimens.fingertip.skin_surface import (
    below_skin,
    depth_below_skin,
    inward_skin_normal,
    onto_skin,
    skin_grid,
    skin_ring,
    skin_section,
    solid_shape,
)
from fingerslip.units import coordinates, millimetres

__all__ = [
    "SolidSkin",
    "check_skin_fits",
    "contact_points",
    "graded_sizes",
    "inner_surface",
    "sweep_solid_skin",
    "tetrahedra",
]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]

_LARGEST_ASPECT = 2.5
_TISSUE_SHARE = 0.7
_BLEND = 3.0
_SHIFTS = 30


@dataclass(frozen=True)
class SolidSkin:
    """Nodes of the skin in rows from the outer surface to the dermis-tissue interface."""

    points: Floats  # (rows, columns, 3), node positions of the level finger [m]
    triangles: Integers  # (m, 3), columns of each triangle of a row, counter-clockwise as seen from outside
    levels: Floats  # (rows,), mean depth of each row below the outer surface [m]
    fine: Flags  # (columns,), whether a column is in the part meshed at the contact size


def sweep_solid_skin(fingertip: FingertipNumbers, sizes: ElementSizes, phalanx: Floats) -> SolidSkin:
    """Divide the skin into rows and columns.

    Arrays: phalanx (n, 3) [m].
    """
    _check_relief(fingertip, sizes)
    levels = _levels(fingertip, sizes)
    outer = _outer_surface(fingertip, sizes, levels, phalanx)
    height = _height(fingertip, outer.points)
    relief = relief_depth(fingertip, outer.points) * _inside(height, sizes.contact_reach)
    rows = [_row(fingertip, outer.points, level, relief) for level in levels]
    return SolidSkin(np.stack(rows), outer.triangles, levels, height <= sizes.contact_reach)


def check_skin_fits(fingertip: FingertipNumbers) -> None:
    """Refuse a skin so thick that its inner surface would cross itself."""
    thickness, skin = fingertip.layers.skin_thickness, skin_grid(fingertip)[:, ::2].reshape(-1, 3)
    depth = depth_below_skin(fingertip, below_skin(fingertip, skin, thickness))
    thinnest = int(depth.argmin())
    if depth[thinnest] < 0.98 * thickness:
        place = coordinates(skin[thinnest], 3)
        found = f"got {millimetres(thickness)}"
        allowed = f"needs a smaller value: layers would cross below the skin at {place}, which bends too sharply"
        raise InputError("layers.skin_thickness", found, allowed, "make the skin thinner or the finger rounder")


def graded_sizes(points: Floats, contact: Floats, contact_size: float, largest: Floats | float) -> Floats:
    """Return the sizes wanted at (n, 3) points [m]: the contact size near (m, 3) contact points, then growing."""
    distance, _ = cKDTree(contact).query(points)
    size: Floats = np.minimum(contact_size + GROWTH * distance, np.maximum(largest, contact_size))
    return size


def contact_points(fingertip: FingertipNumbers, sizes: ElementSizes) -> Floats:
    """Return (n, 3) points of the outer surface that are within the contact reach [m]."""
    grid = skin_grid(fingertip).reshape(-1, 3)
    return grid[_height(fingertip, grid) <= sizes.contact_reach]


def _outer_surface(fingertip: FingertipNumbers, sizes: ElementSizes, levels: Floats, phalanx: Floats) -> Triangulation:
    grid = skin_grid(fingertip)
    skin = grid.reshape(-1, 3)
    # Rows go all round the finger, so triangles may only widen as far as the cells keep a good shape.
    widest = min(sizes.bulk_size, _LARGEST_ASPECT * float(np.diff(levels).min()))
    narrowest = min(widest, float(np.diff(levels).max()) / _LARGEST_ASPECT)
    tissue, _ = cKDTree(phalanx).query(below_skin(fingertip, skin, levels[-1]))
    largest = np.clip(_TISSUE_SHARE * tissue, narrowest, widest)
    wanted = graded_sizes(skin, contact_points(fingertip, sizes), sizes.contact_size, largest)
    origin = int(np.abs(grid[:, 0, 0]).argmin())
    surface = mesh_surface(grid, True, origin, wanted.reshape(grid.shape[:2]))
    cut = np.abs(surface.points[:, 0] + fingertip.sagittal.pad_length) < 1e-9
    points = onto_skin(fingertip, surface.points)
    points[cut] = _on_cut(fingertip, points[cut])
    return Triangulation(points, surface.triangles)


def _on_cut(fingertip: FingertipNumbers, points: Floats) -> Floats:
    """Return points of the outer surface where they are on the proximal cut, at the same angles."""
    return skin_ring(fingertip, np.full(len(points), -fingertip.sagittal.pad_length), _angle(fingertip, points))


def _angle(fingertip: FingertipNumbers, points: Floats) -> Floats:
    centre, height, width = skin_section(fingertip, points[:, 0])
    angle: Floats = np.arctan2(points[:, 2] / width, (centre - points[:, 1]) / height)
    return angle


def _height(fingertip: FingertipNumbers, points: Floats) -> Floats:
    """Return the heights [m] of points above the lowest one when the finger stands at its angle."""
    height: Floats = posed(fingertip, points)[:, 1] + fingertip.sagittal.half_height
    return height


def _inside(height: Floats, reach: float) -> Floats:
    """Return the share of the fingerprint: 1 in the contact, smoothly to 0 where the mesh coarsens."""
    share = np.clip((reach - height) / (0.2 * reach), 0.0, 1.0)
    smooth: Floats = share**2 * (3.0 - 2.0 * share)
    return smooth


def _check_relief(fingertip: FingertipNumbers, sizes: ElementSizes) -> None:
    fingerprint = fingertip.fingerprint
    if fingerprint.enabled and sizes.contact_size > fingerprint.pitch / 4:
        found, allowed = f"got {millimetres(sizes.contact_size)}", f"needs <= {millimetres(fingerprint.pitch / 4)}"
        repair = "write a smaller one or switch the fingerprint off"
        raise InputError("mesh.contact_size", found, f"{allowed}, a quarter of fingerprint.pitch", repair)


def _levels(fingertip: FingertipNumbers, sizes: ElementSizes) -> Floats:
    """Return the depths of all rows: the borders of the layers, and rows about as high as the contact size between."""
    layers, nail = fingertip.layers, solid_shape(fingertip).nail
    borders = {0.0, layers.epidermis_thickness, layers.skin_thickness} | ({nail.thickness} if nail else set())
    stops = sorted(borders)
    _check_rows(stops, sizes)
    pieces = [
        np.linspace(a, b, max(1, round((b - a) / (1.25 * sizes.contact_size))) + 1)
        for a, b in itertools.pairwise(stops)
    ]
    return np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])


def _check_rows(stops: list[float], sizes: ElementSizes) -> None:
    """Refuse borders of layers so close to each other that the cells between would be flat."""
    thinnest, least = float(np.diff(stops).min()), sizes.contact_size / 5
    if thinnest < least:
        found = f"has borders {millimetres(thinnest, 3)} apart (epidermis, skin, nail)"
        allowed = f"needs >= {millimetres(least, 3)}, a fifth of mesh.contact_size, or equal depths"
        raise InputError("layers", found, allowed, "write a smaller contact_size or change the thickness")


def _row(fingertip: FingertipNumbers, skin: Floats, level: float, relief: Floats) -> Floats:
    """Return the (columns, 3) nodes of one row, its rim on the proximal cut."""
    cut = -fingertip.sagittal.pad_length
    rim = skin[:, 0] == cut
    share = max(0.0, 1.0 - level / fingertip.layers.epidermis_thickness)
    row = below_skin(fingertip, _shifted(fingertip, skin, level), level + share * relief)
    row[rim, 0] = cut
    row[skin[:, 2] == 0.0, 2] = 0.0
    return row


def _shifted(fingertip: FingertipNumbers, skin: Floats, level: float) -> Floats:
    """Shift points near the proximal cut along the finger, so that those on the rim are on the cut at their depth."""
    cut, blend = -fingertip.sagittal.pad_length, _BLEND * fingertip.layers.skin_thickness
    near = skin[:, 0] < min(cut + blend, 0.0)
    angle, x = _angle(fingertip, skin[near]), np.full(np.count_nonzero(near), cut)
    for _ in range(_SHIFTS):
        x = cut - level * inward_skin_normal(fingertip, skin_ring(fingertip, x, angle))[:, 0]
    weight = 1.0 - (skin[near, 0] - cut) / blend
    moved = skin.copy()
    moved[near] = skin_ring(fingertip, skin[near, 0] + weight * (x - cut), angle)
    return moved


def inner_surface(skin: SolidSkin) -> Triangulation:
    """Return the dermis-tissue interface."""
    return Triangulation(skin.points[-1], skin.triangles)


def tetrahedra(skin: SolidSkin) -> tuple[Integers, Integers]:
    """Cut the prisms between the rows into tetrahedra.

    Returns
    -------
    tuple of (n, 4) and (n,) arrays
        Nodes, numbered row by row, and the row of prisms of each tetrahedron.
    """
    columns = skin.points.shape[1]
    # Ordered corners give every side of a prism the same diagonal as its neighbour has there.
    a, b, c = np.sort(skin.triangles, axis=1).T
    below = np.array([columns])
    prism = np.concatenate(
        [
            np.stack(nodes, axis=-1)
            for nodes in ((a, b, c, c + below), (a, b, b + below, c + below), (a, a + below, b + below, c + below))
        ]
    )
    rows = len(skin.levels) - 1
    return np.concatenate([prism + row * columns for row in range(rows)]), np.repeat(np.arange(rows), len(prism))
