"""The mesh of a TacTip in 3D, half or whole."""

from __future__ import annotations

import dataclasses

import gmsh
import numpy as np
import skfem
from numpy.typing import NDArray

from fingerslip.mesh.gmsh_session import MILLIMETRES, Fragments, fragment, generate, gmsh_session, read_fragments
from fingerslip.mesh.quality import check_quality
from fingerslip.mesh.repair import repair_tetrahedra
from fingerslip.specimens.tactip.meshing.sizes import SolidSizes, polygon, size_function, smooth_curves, with_names
from fingerslip.specimens.tactip.numbers import TacTipNumbers
from fingerslip.specimens.tactip.profile import skin_lines
from fingerslip.specimens.tactip.sites import modelled_places, points_at

__all__ = ["mesh_sensor_solid"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Sides of a rod, and the share of its direction across the axis below which it is upright.
_SIDES, _UPRIGHT = 8, 1e-9
# Straight edges in place of a circle times the size at rods [m]: eight at 0.35 mm, so that bends get finer with rods.
_BEND = 8 * 0.35e-3
# Nodes nearer to the plane of symmetry than this lie on it [m].
_ON_PLANE = 1e-9


def mesh_sensor_solid(sensor: TacTipNumbers, sizes: SolidSizes, element: str) -> skfem.Mesh3D:
    """Build the mesh of a half or the whole of a sensor; the whole is its half and the mirror image of it."""
    half = _half(dataclasses.replace(sensor, part="half"), sizes)
    result = half if sensor.part == "half" else _with_mirror_image(half)
    mesh = skfem.MeshTet1(np.ascontiguousarray(result.points.T), np.ascontiguousarray(result.cells.T.astype(np.int32)))
    if element == "T10":
        mesh = skfem.MeshTet2.from_mesh(mesh)
    mesh = with_names(mesh, result.region, sensor.part == "half")
    check_quality(mesh)
    return mesh


def _half(sensor: TacTipNumbers, sizes: SolidSizes) -> Fragments:
    """Mesh the half z >= 0 of a sensor."""
    places = modelled_places(sensor)
    feet, ends, crowns = (points_at(sensor, places, d) for d in (sensor.rod_depth, sensor.marker_depth, 0.0))
    nodes, rods = np.vstack([crowns, feet, ends]), np.stack([feet, ends], axis=1)
    with gmsh_session():
        pieces = fragment(_draw(sensor, feet, ends), nodes, 3)
        generate(3, size_function(sensor, sizes, rods, sizes.rod_size), segments=_BEND / sizes.rod_size)
        gmsh.model.mesh.optimize("")
        gmsh.model.mesh.optimize("Netgen")
        fragments = repair_tetrahedra(read_fragments(pieces, 3, 4), nodes)
    points = fragments.points.copy()
    points[np.abs(points[:, 2]) < _ON_PLANE, 2] = 0.0
    return dataclasses.replace(fragments, points=points)


def _with_mirror_image(half: Fragments) -> Fragments:
    """Return cells at z >= 0 together with their mirror images, which share the nodes at z = 0."""
    beside = np.flatnonzero(half.points[:, 2] != 0.0)
    number = np.arange(len(half.points))
    number[beside] = len(half.points) + np.arange(len(beside))
    points = np.vstack([half.points, half.points[beside] * [1.0, 1.0, -1.0]])
    # Two corners change places, so that mirror images are not inside out.
    cells = np.vstack([half.cells, number[half.cells][:, [1, 0, 2, 3]]])
    return Fragments(points, cells, np.tile(half.region, 2))


def _draw(sensor: TacTipNumbers, feet: Floats, ends: Floats) -> dict[str, list[int]]:
    """Draw all regions of a half, one over the other; return their tags in Gmsh."""
    lines, top = skin_lines(sensor.dome, sensor.skin, sensor.markers.spacing), sensor.dome.height
    rods = [_rod(foot, end, sensor.rods.radius) for foot, end in zip(feet, ends, strict=True)]
    half, over = float(lines.outer[-1, 0]), top + sensor.window.thickness
    return {
        "skin": [_revolve(lines.outer, lines.corners)],
        "gel": [_revolve(lines.inner, lines.corners)],
        "rods": _front_of_plane(sensor, rods),
        "window": [_turn(polygon(np.array([[0.0, top], [half, top], [half, over], [0.0, over]])))],
    }


def _revolve(line: Floats, corners: Integers) -> int:
    """Return the volume between a line that starts on the axis, turned about it, and the plane of its end."""
    curves = smooth_curves(line, corners)
    corner = gmsh.model.occ.addPoint(0.0, float(line[-1, 1]) * MILLIMETRES, 0.0)
    sides = [gmsh.model.occ.addLine(curves.points[-1], corner), gmsh.model.occ.addLine(corner, curves.points[0])]
    surface = gmsh.model.occ.addPlaneSurface([gmsh.model.occ.addCurveLoop([*curves.curves, *sides])])
    return _turn(surface)


def _turn(surface: int) -> int:
    """Return the volume of a surface that makes half a turn about the axis, from +x over +z."""
    entities = gmsh.model.occ.revolve([(2, surface)], 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -np.pi)
    tag: int = next(tag for dim, tag in entities if dim == 3)
    return tag


def _rod(foot: Floats, end: Floats, radius: float) -> int:
    """Draw a rod as an octagonal prism of the cross-section of the cylinder, which has no seam to make short edges."""
    along = (end - foot) / np.linalg.norm(end - foot)
    # Corners lie in the plane through the rod and the axis of the sensor, so that one of symmetry cuts no edge in two.
    across = np.cross(along, [0.0, 1.0, 0.0]) if np.hypot(along[0], along[2]) > _UPRIGHT else np.array([0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    angle = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    around = np.outer(np.cos(angle), np.cross(across, along)) + np.outer(np.sin(angle), across)
    reach = radius * np.sqrt(2.0 * np.pi / (_SIDES * np.sin(2.0 * np.pi / _SIDES)))
    points = [gmsh.model.occ.addPoint(*(MILLIMETRES * (foot + reach * corner))) for corner in around]
    lines = [gmsh.model.occ.addLine(a, b) for a, b in zip(points, [*points[1:], points[0]], strict=True)]
    face = gmsh.model.occ.addPlaneSurface([gmsh.model.occ.addCurveLoop(lines)])
    entities = gmsh.model.occ.extrude([(2, face)], *(MILLIMETRES * (end - foot)))
    tag: int = next(tag for dim, tag in entities if dim == 3)
    return tag


def _front_of_plane(sensor: TacTipNumbers, rods: list[int]) -> list[int]:
    """Return what of the rods is on the side z >= 0."""
    extent = 3.0 * MILLIMETRES * (sensor.dome.radius + sensor.dome.flat_radius + sensor.dome.height)
    box = gmsh.model.occ.addBox(-extent, -extent, 0.0, 2 * extent, 2 * extent, extent)
    entities, _ = gmsh.model.occ.intersect([(3, rod) for rod in rods], [(3, box)])
    return [tag for _, tag in entities]
