"""Build the mesh of a TacTip: of its section through the axis, and of its half or the whole of it in 3D.

Regions are drawn one over the other and cut along each other; cells are fine in the skin that can touch and around the
rods, and grow into the gel.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable
from typing import Any

import gmsh
import numpy as np
import skfem

from fingerslip.arrays import Floats, Integers
from fingerslip.errors import MeshError
from fingerslip.mesh.facets import Mesh, are_between, with_groups
from fingerslip.mesh.gmsh_session import MILLIMETRES, Fragments, fragment, generate, gmsh_session, read_fragments
from fingerslip.mesh.quality import check_quality
from fingerslip.mesh.repair import repair_tetrahedra, smooth
from fingerslip.mesh.source import GROWTH, GradedMesh
from fingerslip.specimens.tactip.numbers import REGIONS, TacTipNumbers, modelled_places, points_at
from fingerslip.specimens.tactip.parts import skin_lines
from fingerslip.units import millimetres

_SKIN, _GEL, _RODS, _WINDOW = range(len(REGIONS))
# What is tried until no cell is refused: a share of all sizes, and the largest size at a rod over its radius, so that
# two cells fit on each half of an end.
_ATTEMPTS = ((1.0, 0.7), (1.0, 0.85), (0.95, 0.7), (0.9, 0.7), (0.8, 0.7), (0.9, 0.85), (0.85, 0.85))
# Size over the thickness of the skin where it cannot touch, in 2D.
_OF_SKIN = 0.6
# Gel between a rod and the sides of its ridge that is thinner than this share of the skin has cells that are refused.
_SLIVER = 0.1
# Sides of a rod, and the share of its direction across the axis below which it is upright.
_SIDES, _UPRIGHT = 8, 1e-9
# Straight edges in place of a circle times the size at rods [m]: eight at 0.35 mm, so that bends get finer with rods.
_BEND = 8 * 0.35e-3
# Nodes and facets nearer to the plane of symmetry than this lie on it [m].
_ON_PLANE = 1e-9


def mesh_sensor_section(sensor: TacTipNumbers, sizes: GradedMesh) -> skfem.Mesh2D:
    """Build the mesh of a section, somewhat finer than asked for where cells would be refused."""
    refused: list[MeshError] = []
    for share, at_rods in _ATTEMPTS:
        finer = sizes.refined(share) or sizes
        try:
            mesh = _mesh_section(sensor, finer, at_rods * sensor.rods.radius)
            check_quality(mesh)
        except MeshError as error:
            refused.append(error)
        else:
            return mesh
    # The rods are the reason where they nearly fill the inside of a ridge.
    radius, skin = sensor.rods.radius, sensor.skin
    inside = skin.ridges.bend_radius - 0.5 * skin.thickness
    if not (skin.ridges.enabled and 0.0 < inside - radius < _SLIVER * skin.thickness):
        raise refused[0]
    fault = f"got {millimetres(radius)}, which leaves a sliver of gel inside a ridge, with a {refused[0].where}"
    thin = millimetres(inside - _SLIVER * skin.thickness)
    raise MeshError("tactip.rods.radius", fault, f"needs at least {millimetres(inside)}, or at most {thin}")


def _mesh_section(sensor: TacTipNumbers, sizes: GradedMesh, rod_size: float) -> skfem.Mesh2D:
    """Return a mesh whose cells may be of any quality."""
    quadrilaterals = sizes.element == "Q4"
    feet, ends, nodes = _rod_points(sensor)
    with gmsh_session():
        pieces = fragment(_draw_section(sensor, feet, ends), nodes, 2)
        generate(2, size_function(sensor, sizes, feet, ends, rod_size), quadrilaterals=quadrilaterals)
        fragments = read_fragments(pieces, 2, 4 if quadrilaterals else 3)
    corners = fragments.points[fragments.cells]
    ahead, back = corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]
    clockwise = ahead[:, 0] * back[:, 1] < ahead[:, 1] * back[:, 0]
    cells = np.where(clockwise[:, None], fragments.cells[:, ::-1], fragments.cells)
    points = smooth(fragments.points, cells, fragments.region) if quadrilaterals else fragments.points
    kind = skfem.MeshQuad1 if quadrilaterals else skfem.MeshTri1
    mesh = kind(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T.astype(np.int32)))
    mesh = skfem.MeshTri2.from_mesh(mesh) if sizes.element == "T6" else mesh
    return with_names(mesh, fragments.region, half=False)


def mesh_sensor_solid(sensor: TacTipNumbers, sizes: GradedMesh, rod_size: float) -> skfem.Mesh3D:
    """Build the mesh of a half or the whole of a sensor; the whole is its half and the mirror image of it."""
    result = _mesh_half(dataclasses.replace(sensor, part="half"), sizes, rod_size)
    if sensor.part != "half":
        # Mirror images share the nodes at z = 0.
        beside, number = np.flatnonzero(result.points[:, 2] != 0.0), np.arange(len(result.points))
        number[beside] = len(result.points) + np.arange(len(beside))
        points = np.vstack([result.points, result.points[beside] * [1.0, 1.0, -1.0]])
        # Two corners change places, so that mirror images are not inside out.
        cells = np.vstack([result.cells, number[result.cells][:, [1, 0, 2, 3]]])
        result = Fragments(points, cells, np.tile(result.region, 2))
    mesh = skfem.MeshTet1(np.ascontiguousarray(result.points.T), np.ascontiguousarray(result.cells.T.astype(np.int32)))
    mesh = skfem.MeshTet2.from_mesh(mesh) if sizes.element == "T10" else mesh
    mesh = with_names(mesh, result.region, sensor.part == "half")
    check_quality(mesh)
    return mesh


def _mesh_half(sensor: TacTipNumbers, sizes: GradedMesh, rod_size: float) -> Fragments:
    """Mesh the half z >= 0 of a sensor."""
    feet, ends, nodes = _rod_points(sensor)
    with gmsh_session():
        pieces = fragment(_draw_half(sensor, feet, ends), nodes, 3)
        generate(3, size_function(sensor, sizes, feet, ends, rod_size), segments=_BEND / rod_size)
        gmsh.model.mesh.optimize("")
        gmsh.model.mesh.optimize("Netgen")
        fragments = repair_tetrahedra(read_fragments(pieces, 3, 4), nodes)
    points = fragments.points.copy()
    points[np.abs(points[:, 2]) < _ON_PLANE, 2] = 0.0
    return dataclasses.replace(fragments, points=points)


def with_names(mesh: Mesh, region: Integers, half: bool) -> Mesh:
    """Return a mesh with the names of its regions and boundaries, by each cell's number `region` (n_cells,)."""
    outer = mesh.f2t[1] < 0
    symmetry = outer & half & (np.abs(mesh.p[-1, mesh.facets]).max(axis=0) < _ON_PLANE)
    boundaries = {
        "contact": outer & ~symmetry & (region[mesh.f2t[0]] == _SKIN),
        "window_face": are_between(mesh, region, _SKIN, _WINDOW) | are_between(mesh, region, _GEL, _WINDOW),
        "symmetry": symmetry,
    }
    return with_groups(mesh, {name: region == number for number, name in enumerate(REGIONS)}, boundaries)


def _rod_points(sensor: TacTipNumbers) -> tuple[Floats, Floats, Floats]:
    """Return the feet and the ends of the rods, and all points that are to be nodes: crowns, feet and ends."""
    places = modelled_places(sensor)
    feet, ends, crowns = (points_at(sensor, places, d) for d in (sensor.rod_depth, sensor.marker_depth, 0.0))
    return feet, ends, np.vstack([crowns, feet, ends])


def size_function(
    sensor: TacTipNumbers, sizes: GradedMesh, feet: Floats, ends: Floats, rod_size: float
) -> Callable[[float, float, float], float]:
    """Return the wanted size [m] at x, y, z [m], looked up on a grid because Gmsh asks for it very often.

    Rods go from their feet to their ends (n, dim) [m], where cells are no larger than `rod_size` [m].
    """
    spacing, solid = 0.5 * sizes.contact_size, feet.shape[1] == 3
    half = sensor.dome.radius + sensor.dome.flat_radius
    low = np.array([-half, 0.0, -half if solid and sensor.part != "half" else 0.0])
    high = np.array([half, sensor.dome.height + sensor.window.thickness, half if solid else 0.0])
    axes = [
        start + spacing * np.arange(np.ceil((end - start) / spacing) + 1) for start, end in zip(low, high, strict=True)
    ]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    grid = _sizes(sensor, sizes, points.reshape(-1, 3), (feet, ends), rod_size).reshape(points.shape[:3])
    table: Any = grid.tolist()
    x0, y0, z0 = low.tolist()
    nx, ny, nz = (count - 1 for count in map(int, grid.shape))

    def size(x: float, y: float, z: float) -> float:
        i, j, k = (round((value - start) / spacing) for value, start in ((x, x0), (y, y0), (z, z0)))
        size_here: float = table[min(max(i, 0), nx)][min(max(j, 0), ny)][min(max(k, 0), nz)]
        return size_here

    return size


def _sizes(
    sensor: TacTipNumbers, sizes: GradedMesh, points: Floats, rods: tuple[Floats, Floats], rod_size: float
) -> Floats:
    """Return the wanted sizes [m] at (m, 3) points."""
    dome = sensor.dome
    across = np.maximum(np.hypot(points[:, 0], points[:, 2]) - dome.flat_radius, 0.0)
    up = dome.radius - np.minimum(points[:, 1], dome.radius)
    # How far points lie inside the skin, about; negative in it.
    deep = dome.radius - np.hypot(across, up) - sensor.skin.relief - sensor.skin.thickness
    beyond = np.maximum(deep, points[:, 1] - sizes.contact_reach)
    away = np.full(len(points), np.inf)
    for foot, end in zip(*rods, strict=True):
        axis, offset = end - foot, points[:, : len(foot)] - foot
        share = np.clip(offset @ axis / (axis @ axis), 0.0, 1.0)
        away = np.minimum(away, np.linalg.norm(offset - share[:, None] * axis, axis=1) - sensor.rods.radius)
    in_skin = sizes.contact_size + GROWTH * np.maximum(beyond, 0.0)
    at_rods = min(sizes.contact_size, rod_size) + GROWTH * np.maximum(away, 0.0)
    of_skin = _OF_SKIN if sensor.part == "section" else np.inf
    through_skin = of_skin * sensor.skin.thickness + GROWTH * np.maximum(deep, 0.0)
    return np.asarray(np.min([np.full_like(away, sizes.bulk_size), in_skin, at_rods, through_skin], axis=0))


def _draw_section(sensor: TacTipNumbers, feet: Floats, ends: Floats) -> dict[str, list[int]]:
    """Draw all regions, one over the other; return their tags in Gmsh."""
    lines, top = skin_lines(sensor.dome, sensor.skin, sensor.markers.spacing), sensor.dome.height
    half, over = float(lines.outer[-1, 0]), top + sensor.window.thickness

    def below(line: Floats) -> int:
        """Return the surface between a mirrored line and the straight line between its ends."""
        (lowest, *_, end), right = smooth_curves(line, lines.corners)
        (*_, other_end), left = smooth_curves(line * [-1.0, 1.0], lines.corners, first=lowest)
        return _surface([*right, gmsh.model.occ.addLine(other_end, end), *left])

    def strip(foot: Floats, end: Floats) -> int:
        along = (end - foot) / np.linalg.norm(end - foot)
        side = sensor.rods.radius * np.array([-along[1], along[0]])
        return polygon(np.array([foot - side, end - side, end + side, foot + side]))

    return {
        "skin": [below(lines.outer)],
        "gel": [below(lines.inner)],
        "rods": [strip(foot, end) for foot, end in zip(feet, ends, strict=True)],
        "window": [polygon(np.array([[-half, top], [half, top], [half, over], [-half, over]]))],
    }


def _draw_half(sensor: TacTipNumbers, feet: Floats, ends: Floats) -> dict[str, list[int]]:
    """Draw all regions of a half, one over the other; return their tags in Gmsh."""
    lines, top = skin_lines(sensor.dome, sensor.skin, sensor.markers.spacing), sensor.dome.height
    rods = [(3, _rod(foot, end, sensor.rods.radius)) for foot, end in zip(feet, ends, strict=True)]
    half, over = float(lines.outer[-1, 0]), top + sensor.window.thickness
    # What of the rods is on the side z >= 0.
    extent = 3.0 * MILLIMETRES * (sensor.dome.radius + sensor.dome.flat_radius + sensor.dome.height)
    box = gmsh.model.occ.addBox(-extent, -extent, 0.0, 2 * extent, 2 * extent, extent)
    in_front, _ = gmsh.model.occ.intersect(rods, [(3, box)])

    def inside(line: Floats) -> int:
        """Return the volume between a line that starts on the axis, turned about it, and the plane of its end."""
        (lowest, *_, end), curves = smooth_curves(line, lines.corners)
        corner = _point(np.array([0.0, line[-1, 1]]))
        sides = [gmsh.model.occ.addLine(end, corner), gmsh.model.occ.addLine(corner, lowest)]
        return _turn(_surface([*curves, *sides]))

    return {
        "skin": [inside(lines.outer)],
        "gel": [inside(lines.inner)],
        "rods": [tag for _, tag in in_front],
        "window": [_turn(polygon(np.array([[0.0, top], [half, top], [half, over], [0.0, over]])))],
    }


def smooth_curves(line: Floats, corners: Integers, first: int | None = None) -> tuple[list[int], list[int]]:
    """Draw a line (n, 2) [m] as cubic splines through its points, one for each piece between corners (k,).

    Tags of the points between pieces and of both ends, and of the pieces.
    """
    tags = [_point(point) for point in line[1:]]
    tags = [_point(line[0]) if first is None else first, *tags]
    pieces = [tags[start : end + 1] for start, end in itertools.pairwise(corners)]
    return [tags[row] for row in corners], [gmsh.model.occ.addSpline(piece) for piece in pieces]


def polygon(corners: Floats) -> int:
    """Draw the surface inside a polygon of (n, 2 or 3) corners [m]; return its tag."""
    points = [_point(corner) for corner in corners]
    return _surface([gmsh.model.occ.addLine(a, b) for a, b in zip(points, [*points[1:], points[0]], strict=True)])


def _point(point: Floats) -> int:
    tag: int = gmsh.model.occ.addPoint(*(MILLIMETRES * point), *[0.0] * (3 - len(point)))
    return tag


def _surface(curves: list[int]) -> int:
    """Draw the surface inside a ring of curves; return its tag."""
    tag: int = gmsh.model.occ.addPlaneSurface([gmsh.model.occ.addCurveLoop(curves)])
    return tag


def _turn(surface: int) -> int:
    """Return the volume of a surface that makes half a turn about the axis, from +x over +z."""
    entities = gmsh.model.occ.revolve([(2, surface)], 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -np.pi)
    return next(int(tag) for dim, tag in entities if dim == 3)


def _rod(foot: Floats, end: Floats, radius: float) -> int:
    """Draw a rod as an octagonal prism of the cross-section of the cylinder, which has no seam to make short edges."""
    along = (end - foot) / np.linalg.norm(end - foot)
    # Corners lie on the plane through the rod and the axis of the sensor, so that one of symmetry cuts no edge in two.
    across = np.cross(along, [0.0, 1.0, 0.0]) if np.hypot(along[0], along[2]) > _UPRIGHT else np.array([0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    angle = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    around = np.outer(np.cos(angle), np.cross(across, along)) + np.outer(np.sin(angle), across)
    reach = radius * np.sqrt(2.0 * np.pi / (_SIDES * np.sin(2.0 * np.pi / _SIDES)))
    face = polygon(np.array([foot + reach * corner for corner in around]))
    entities = gmsh.model.occ.extrude([(2, face)], *(MILLIMETRES * (end - foot)))
    return next(int(tag) for dim, tag in entities if dim == 3)
