"""The tissue and the phalanx inside the skin, meshed by Gmsh."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import gmsh
import numpy as np
import pygmsh
from numpy.typing import NDArray

from fingerslip.errors import MeshError
from fingerslip.mesh.gmsh_session import MILLIMETRES, gmsh_session
from fingerslip.mesh.sizes import GROWTH, ElementSizes, size_at, subdivide
from fingerslip.mesh.smoothing import smoothed
from fingerslip.specimens.fingertip.phalanx_contour import reaches_cut

__all__ = ["CoreMesh", "mesh_core", "mesh_ring"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_TURN = np.radians(18.0)
_FRONTAL, _FRONTAL_FOR_QUADRILATERALS = 6, 8


@dataclass(frozen=True)
class CoreMesh:
    """Mesh of tissue and phalanx, in the plane or in space."""

    points: Floats  # (n, dim), node positions [m]
    cells: dict[str, Integers]  # (m, 3), nodes of the cells of `tissue` and `phalanx`, in the plane counter-clockwise


@dataclass(frozen=True)
class _Contours:
    """Nodes of all lines: skin and phalanx, and the pieces of the proximal cut from its dorsal to its palmar end."""

    skin: Floats
    phalanx: Floats
    cuts: tuple[Floats, ...]
    largest: float


def mesh_core(contour: Floats, border: Floats, closed: bool, sizes: ElementSizes) -> CoreMesh:
    """Mesh what lies inside the skin.

    Quadrilaterals come from a mesh of twice the size, whose triangles and quadrilaterals are all divided into
    quadrilaterals; the nodes of the border are therefore every second one of `border`, and the midpoints between them.

    Arrays: contour (n, 2) [m]; border (n, 2) [m].
    """
    quadrilaterals = sizes.element == "Q4"
    contours = _contours(contour, border, closed, sizes)
    with gmsh_session() as geometry:
        surfaces = _draw(geometry, contours)
        _set_sizes(contours.largest, quadrilaterals)
        _generate(geometry, _FRONTAL_FOR_QUADRILATERALS if quadrilaterals else _FRONTAL)
        core = _read(surfaces, 4 if quadrilaterals else 3)
    return _smoothed(core) if quadrilaterals else core


def mesh_ring(outer: Floats, inner: Floats | None, largest: float) -> CoreMesh:
    """Mesh what lies inside a ring of nodes with triangles, all nodes of the rings kept.

    Arrays: outer (n, 2) [m]; inner (m, 2) [m]; largest [m].
    """
    with gmsh_session() as geometry:
        if inner is None:
            ring = _points(geometry, outer)
            loop = geometry.add_curve_loop(_polyline(geometry, [*ring, ring[0]]))
            surfaces = {"tissue": geometry.add_plane_surface(loop).dim_tags[0][1]}
        else:
            surfaces = _draw(geometry, _Contours(outer, np.vstack([inner, inner[:1]]), (), largest))
        _set_sizes(largest, quadrilaterals=False)
        _generate(geometry, _FRONTAL)
        return _read(surfaces, 3)


def _contours(phalanx: Floats, border: Floats, closed: bool, sizes: ElementSizes) -> _Contours:
    """Divide all lines into the segments that Gmsh keeps."""
    factor = 2 if sizes.element == "Q4" else 1
    skin, largest = border[::factor], factor * sizes.bulk_size
    spacing = factor * _spacing(border, closed)[::factor]

    def divided(line: Floats) -> Floats:
        return subdivide(line, size_at(line, skin, spacing, largest), factor * _TURN)

    if closed:
        return _Contours(skin, divided(phalanx), (), largest)
    stops = [skin[-1], phalanx[-1], phalanx[0], skin[0]] if reaches_cut(phalanx) else [skin[-1], skin[0]]
    cuts = tuple(divided(np.linspace(a, b, 200)) for a, b in itertools.pairwise(stops))
    return _Contours(skin, divided(phalanx), cuts, largest)


def _spacing(border: Floats, closed: bool) -> Floats:
    """Return at each node of the border the mean length of its neighbouring segments."""
    ring = np.vstack([border[-1:], border, border[:1]]) if closed else border
    length = np.linalg.norm(np.diff(ring, axis=0), axis=1)
    around = length if closed else np.concatenate([length[:1], length, length[-1:]])
    mean: Floats = (around[1:] + around[:-1]) / 2
    return mean


def _draw(geometry: pygmsh.geo.Geometry, contours: _Contours) -> dict[str, int]:
    """Draw both surfaces; return their tags in Gmsh."""
    skin = _points(geometry, contours.skin)
    # The phalanx divides the cut in three where it reaches it, else it lies in a hole of the tissue.
    draw = _draw_notched if len(contours.cuts) == 3 else _draw_hole
    tissue, phalanx, holes = draw(geometry, contours, skin)
    return {
        "tissue": geometry.add_plane_surface(tissue, holes=holes).dim_tags[0][1],
        "phalanx": geometry.add_plane_surface(phalanx).dim_tags[0][1],
    }


_Points = Sequence[pygmsh.common.point.Point]
_Loops = tuple[pygmsh.common.curve_loop.CurveLoop, pygmsh.common.curve_loop.CurveLoop, list[object]]


def _draw_hole(geometry: pygmsh.geo.Geometry, contours: _Contours, skin: _Points) -> _Loops:
    inner = _points(geometry, contours.phalanx[:-1])
    hole = geometry.add_curve_loop(_polyline(geometry, [*inner, inner[0]]))
    back = _points(geometry, contours.cuts[0][1:-1]) if contours.cuts else []
    outer = geometry.add_curve_loop(_polyline(geometry, [*skin, *back, skin[0]]))
    return outer, hole, [hole]


def _draw_notched(geometry: pygmsh.geo.Geometry, contours: _Contours, skin: _Points) -> _Loops:
    phalanx = _points(geometry, contours.phalanx)
    dorsal, through, palmar = (_points(geometry, cut[1:-1]) for cut in contours.cuts)
    around = _polyline(geometry, phalanx)
    outside = _polyline(geometry, [phalanx[0], *palmar, *skin, *dorsal, phalanx[-1]])
    tissue = geometry.add_curve_loop([*outside, *(-line for line in reversed(around))])
    end = _polyline(geometry, [phalanx[-1], *through, phalanx[0]])
    return tissue, geometry.add_curve_loop([*around, *end]), []


def _points(geometry: pygmsh.geo.Geometry, points: Floats) -> list[pygmsh.common.point.Point]:
    return [geometry.add_point([x * MILLIMETRES, y * MILLIMETRES, 0.0]) for x, y in points]


def _polyline(geometry: pygmsh.geo.Geometry, points: _Points) -> list[pygmsh.common.line.Line]:
    """Join points by lines that Gmsh does not divide."""
    lines = [geometry.add_line(a, b) for a, b in itertools.pairwise(points)]
    for line in lines:
        geometry.set_transfinite_curve(line, 2, "Progression", 1.0)
    return lines


def _set_sizes(largest: float, quadrilaterals: bool) -> None:
    """Let the sizes grow from all lines to the largest one, by a size field."""
    size = largest * MILLIMETRES
    gmsh.model.geo.synchronize()
    field = gmsh.model.mesh.field.add("Extend")
    gmsh.model.mesh.field.setNumbers(field, "CurvesList", [tag for _, tag in gmsh.model.getEntities(1)])
    gmsh.model.mesh.field.setNumbers(field, "SurfacesList", [tag for _, tag in gmsh.model.getEntities(2)])
    gmsh.model.mesh.field.setNumber(field, "SizeMax", size)
    gmsh.model.mesh.field.setNumber(field, "DistMax", size / GROWTH)
    gmsh.model.mesh.field.setNumber(field, "Power", 1)
    gmsh.model.mesh.field.setAsBackgroundMesh(field)
    for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)
    for option in ("RecombineAll", "SubdivisionAlgorithm"):
        gmsh.option.setNumber(f"Mesh.{option}", int(quadrilaterals))
    # A pair of triangles that makes a poor quadrilateral divides better as two triangles.
    gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 0)
    gmsh.option.setNumber("Mesh.RecombineMinimumQuality", 0.4)


def _generate(geometry: pygmsh.geo.Geometry, algorithm: int) -> None:
    try:
        geometry.generate_mesh(dim=2, algorithm=algorithm)
    except Exception as error:
        raise MeshError("tissue and phalanx", f"Gmsh says '{error}'", "needs a section that Gmsh can mesh") from error


def _smoothed(core: CoreMesh) -> CoreMesh:
    """Improve the cells, with the nodes on the surface of either region kept."""
    fixed = np.zeros(len(core.points), dtype=bool)
    for nodes in core.cells.values():
        edges = np.sort(np.stack([nodes, np.roll(nodes, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
        unique, count = np.unique(edges, axis=0, return_counts=True)
        fixed[unique[count == 1]] = True
    return CoreMesh(smoothed(core.points, np.vstack(list(core.cells.values())), fixed), core.cells)


def _read(surfaces: dict[str, int], corners: int) -> CoreMesh:
    """Read the mesh out of Gmsh, without the points that no cell uses."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    row = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    row[tags] = np.arange(len(tags))
    points = coordinates.reshape(-1, 3)[:, :2] / MILLIMETRES
    cells = {name: row[_cell_nodes(surface, corners)] for name, surface in surfaces.items()}
    used = np.unique(np.concatenate([nodes.ravel() for nodes in cells.values()]))
    return CoreMesh(points[used], {name: np.searchsorted(used, nodes) for name, nodes in cells.items()})


def _cell_nodes(surface: int, corners: int) -> Integers:
    kinds, _, nodes = gmsh.model.mesh.getElements(2, surface)
    if len(kinds) != 1 or gmsh.model.mesh.getElementProperties(kinds[0])[3] != corners:
        raise MeshError("tissue and phalanx", f"Gmsh made cells of {len(kinds)} kinds", f"needs {corners} corners each")
    return np.asarray(nodes[0], dtype=np.int64).reshape(-1, corners)
