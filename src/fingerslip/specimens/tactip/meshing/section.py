"""The mesh of the section of a TacTip through its axis."""

from __future__ import annotations

import gmsh
import numpy as np
import skfem
from numpy.typing import NDArray

from fingerslip.mesh.fragments import Fragments, fragmented, generate, read_fragments
from fingerslip.mesh.gmsh_session import gmsh_session
from fingerslip.mesh.quality import check_quality
from fingerslip.mesh.smoothing import smoothed
from fingerslip.specimens.tactip.meshing.curves import polygon, smooth_curves
from fingerslip.specimens.tactip.meshing.names import with_names
from fingerslip.specimens.tactip.meshing.sizes import SensorSizes, size_at_rods, size_function
from fingerslip.specimens.tactip.numbers import TacTipNumbers
from fingerslip.specimens.tactip.profile import skin_lines
from fingerslip.specimens.tactip.sites import modelled_places, points_at

__all__ = ["mesh_sensor_section"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


def mesh_sensor_section(sensor: TacTipNumbers, sizes: SensorSizes, element: str) -> skfem.Mesh2D:
    """Build the mesh of a section.

    Parameters
    ----------
    sensor : TacTipNumbers
        The sensor.
    sizes : SensorSizes
        Element sizes.
    element : {'Q4', 'T3', 'T6'}
        Kind of cell.

    Raises
    ------
    MeshError
        Where no mesh of good quality comes out.
    """
    places = modelled_places(sensor)
    feet, ends, crowns = (points_at(sensor, places, d) for d in (sensor.rod_depth, sensor.marker_depth, 0.0))
    quadrilaterals = element == "Q4"
    with gmsh_session():
        shapes = _draw(sensor, feet, ends)
        pieces = fragmented(shapes, np.vstack([crowns, feet, ends]), 2)
        size = size_function(sensor, sizes, np.stack([feet, ends], axis=1), size_at_rods(sensor))
        generate(2, size, quadrilaterals=quadrilaterals)
        found = read_fragments(pieces, 2, 4 if quadrilaterals else 3)
    mesh = with_names(_container(_smoothed(found) if quadrilaterals else found, element), found.region, half=False)
    check_quality(mesh)
    return mesh


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


def _smoothed(found: Fragments) -> Fragments:
    """Improve the cells, with the nodes on the border of every region kept."""
    fixed = np.zeros(len(found.points), dtype=bool)
    for number in np.unique(found.region):
        nodes = found.cells[found.region == number]
        edges = np.sort(np.stack([nodes, np.roll(nodes, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
        unique, count = np.unique(edges, axis=0, return_counts=True)
        fixed[unique[count == 1]] = True
    turned = _counter_clockwise(found)
    return Fragments(smoothed(found.points, turned, fixed), turned, found.region)


def _counter_clockwise(found: Fragments) -> Integers:
    corners = found.points[found.cells]
    ahead, back = corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0]
    turned = ahead[:, 0] * back[:, 1] < ahead[:, 1] * back[:, 0]
    return np.where(turned[:, None], found.cells[:, ::-1], found.cells)


def _container(found: Fragments, element: str) -> skfem.Mesh2D:
    """Return the cells as a mesh, counter-clockwise."""
    cells = _counter_clockwise(found)
    points, nodes = np.ascontiguousarray(found.points.T), np.ascontiguousarray(cells.T.astype(np.int32))
    if element == "Q4":
        return skfem.MeshQuad1(points, nodes)
    mesh = skfem.MeshTri1(points, nodes)
    return skfem.MeshTri2.from_mesh(mesh) if element == "T6" else mesh
