"""The mesh of the section of a TacTip through its axis."""

from __future__ import annotations

from dataclasses import dataclass

import gmsh
import numpy as np
import skfem
from numpy.typing import NDArray

from fingerslip.errors import MeshError
from fingerslip.mesh.gmsh_session import Fragments, fragment, generate, gmsh_session, read_fragments
from fingerslip.mesh.quality import check_quality
from fingerslip.mesh.repair import smooth
from fingerslip.specimens.tactip.meshing.sizes import (
    SensorSizes,
    polygon,
    size_at_rods,
    size_function,
    smooth_curves,
    with_names,
)
from fingerslip.specimens.tactip.numbers import TacTipNumbers
from fingerslip.specimens.tactip.profile import skin_lines
from fingerslip.specimens.tactip.sites import modelled_places, points_at
from fingerslip.units import millimetres

__all__ = ["mesh_sensor_section"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# What is tried until no cell is refused: a share of all sizes, and the largest size at a rod over its radius.
_ATTEMPTS = ((1.0, 0.7), (1.0, 0.85), (0.95, 0.7), (0.9, 0.7), (0.8, 0.7), (0.9, 0.85), (0.85, 0.85))
# Gel between a rod and the sides of its ridge that is thinner than this share of the skin has cells that are refused.
_SLIVER = 0.1


@dataclass(frozen=True)
class _Sizes:
    contact_size: float
    bulk_size: float
    contact_reach: float


def mesh_sensor_section(sensor: TacTipNumbers, sizes: SensorSizes, element: str) -> skfem.Mesh2D:
    """Build the mesh of a section, somewhat finer than asked for where cells would be refused."""
    refused: list[MeshError] = []
    for share, at_rods in _ATTEMPTS:
        finer = _Sizes(share * sizes.contact_size, share * sizes.bulk_size, sizes.contact_reach)
        try:
            mesh = _mesh(sensor, finer, at_rods, element)
            check_quality(mesh)
        except MeshError as error:
            refused.append(error)
        else:
            return mesh
    raise _with_gap(sensor, refused[0])


def _with_gap(sensor: TacTipNumbers, refused: MeshError) -> MeshError:
    """Return why a mesh is refused, with the rods as the reason where they nearly fill the inside of a ridge."""
    radius, skin = sensor.rods.radius, sensor.skin
    inside = skin.ridges.bend_radius - 0.5 * skin.thickness
    if not (skin.ridges.enabled and 0.0 < inside - radius < _SLIVER * skin.thickness):
        return refused
    fault = f"got {millimetres(radius)}, which leaves a sliver of gel inside a ridge, with a {refused.where}"
    thin = millimetres(inside - _SLIVER * skin.thickness)
    return MeshError("tactip.rods.radius", fault, f"needs at least {millimetres(inside)}, or at most {thin}")


def _mesh(sensor: TacTipNumbers, sizes: SensorSizes, at_rods: float, element: str) -> skfem.Mesh2D:
    """Return a mesh whose cells may be of any quality."""
    places = modelled_places(sensor)
    feet, ends, crowns = (points_at(sensor, places, d) for d in (sensor.rod_depth, sensor.marker_depth, 0.0))
    quadrilaterals = element == "Q4"
    with gmsh_session():
        shapes = _draw(sensor, feet, ends)
        pieces = fragment(shapes, np.vstack([crowns, feet, ends]), 2)
        size = size_function(sensor, sizes, np.stack([feet, ends], axis=1), size_at_rods(sensor, at_rods))
        generate(2, size, quadrilaterals=quadrilaterals)
        fragments = read_fragments(pieces, 2, 4 if quadrilaterals else 3)
    good = _smooth(fragments) if quadrilaterals else fragments
    return with_names(_container(good, element), fragments.region, half=False)


def _draw(sensor: TacTipNumbers, feet: Floats, ends: Floats) -> dict[str, list[int]]:
    """Draw all regions, one over the other; return their tags in Gmsh."""
    lines, top = skin_lines(sensor.dome, sensor.skin, sensor.markers.spacing), sensor.dome.height
    half = float(lines.outer[-1, 0])
    window = np.array([[-half, top], [half, top], [half, top + sensor.window.thickness]])
    window = np.vstack([window, [-half, top + sensor.window.thickness]])
    return {
        "skin": [_below(lines.outer, lines.corners)],
        "gel": [_below(lines.inner, lines.corners)],
        "rods": [polygon(_strip(foot, end, sensor.rods.radius)) for foot, end in zip(feet, ends, strict=True)],
        "window": [polygon(window)],
    }


def _below(line: Floats, corners: Integers) -> int:
    """Return the surface between a mirrored line and the straight line between its ends."""
    right = smooth_curves(line, corners)
    left = smooth_curves(line * [-1.0, 1.0], corners, first=right.points[0])
    chord = gmsh.model.occ.addLine(left.points[-1], right.points[-1])
    surface: int = gmsh.model.occ.addPlaneSurface([gmsh.model.occ.addCurveLoop([*right.curves, chord, *left.curves])])
    return surface


def _strip(foot: Floats, end: Floats, radius: float) -> Floats:
    along = (end - foot) / np.linalg.norm(end - foot)
    side = radius * np.array([-along[1], along[0]])
    return np.array([foot - side, end - side, end + side, foot + side])


def _smooth(fragments: Fragments) -> Fragments:
    """Improve the cells, with the nodes on the border of every region kept."""
    fixed = np.zeros(len(fragments.points), dtype=bool)
    for number in np.unique(fragments.region):
        nodes = fragments.cells[fragments.region == number]
        edges = np.sort(np.stack([nodes, np.roll(nodes, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
        unique, count = np.unique(edges, axis=0, return_counts=True)
        fixed[unique[count == 1]] = True
    turned = _counter_clockwise(fragments)
    return Fragments(smooth(fragments.points, turned, fixed), turned, fragments.region)


def _counter_clockwise(fragments: Fragments) -> Integers:
    corners = fragments.points[fragments.cells]
    ahead, back = corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]
    turned = ahead[:, 0] * back[:, 1] < ahead[:, 1] * back[:, 0]
    return np.where(turned[:, None], fragments.cells[:, ::-1], fragments.cells)


def _container(fragments: Fragments, element: str) -> skfem.Mesh2D:
    """Return the cells as a mesh, counter-clockwise."""
    cells = _counter_clockwise(fragments)
    points, nodes = np.ascontiguousarray(fragments.points.T), np.ascontiguousarray(cells.T.astype(np.int32))
    if element == "Q4":
        return skfem.MeshQuad1(points, nodes)
    mesh = skfem.MeshTri1(points, nodes)
    return skfem.MeshTri2.from_mesh(mesh) if element == "T6" else mesh
