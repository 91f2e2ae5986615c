"""Build the 2D mesh of a fingertip section."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import gmsh
import numpy as np
import pygmsh
import skfem
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingerslip.errors import InputError, MeshError
from fingerslip.mesh.gmsh_session import MILLIMETRES, gmsh_session
from fingerslip.mesh.quality import check_quality
from fingerslip.mesh.repair import smooth
from fingerslip.mesh.sizes import GROWTH, ElementSizes, grade, size_at, subdivide
from fingerslip.specimens.fingertip.interfaces import interface_depth, surface_depth
from fingerslip.specimens.fingertip.meshing.names import with_names
from fingerslip.specimens.fingertip.numbers import REGIONS, FingertipNumbers
from fingerslip.specimens.fingertip.outline import Curve, arc_length_at_cut, at_depth, outline_curve
from fingerslip.specimens.fingertip.phalanx import phalanx_contour, reaches_cut
from fingerslip.units import coordinates, millimetres

__all__ = [
    "CoreMesh",
    "SkinGrid",
    "column_limits",
    "mesh_core",
    "mesh_ring",
    "mesh_section",
    "row_counts",
    "section_cells",
    "sweep_skin",
]


Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_TURN = np.radians(18.0)
_FRONTAL, _FRONTAL_FOR_QUADRILATERALS = 6, 8


@dataclass(frozen=True)
class CoreMesh:
    """Mesh of tissue and phalanx, in 2D or in 3D."""

    points: Floats  # (n, dim), node positions [m]
    cells: dict[str, Integers]  # (m, 3), nodes of the cells of `tissue` and `phalanx`, in 2D counter-clockwise


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
        core = _read_core(surfaces, 4 if quadrilaterals else 3)
    return _smooth(core) if quadrilaterals else core


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
        return _read_core(surfaces, 3)


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
    draw = _draw_notches if len(contours.cuts) == 3 else _draw_hole
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


def _draw_notches(geometry: pygmsh.geo.Geometry, contours: _Contours, skin: _Points) -> _Loops:
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


def _smooth(core: CoreMesh) -> CoreMesh:
    """Improve the cells, with the nodes on the surface of either region kept."""
    fixed = np.zeros(len(core.points), dtype=bool)
    for nodes in core.cells.values():
        edges = np.sort(np.stack([nodes, np.roll(nodes, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
        unique, count = np.unique(edges, axis=0, return_counts=True)
        fixed[unique[count == 1]] = True
    return CoreMesh(smooth(core.points, np.vstack(list(core.cells.values())), fixed), core.cells)


def _read_core(surfaces: dict[str, int], corners: int) -> CoreMesh:
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


# Rows go all round the finger, so columns may only widen as far as the cells keep a good shape.
_LARGEST_ASPECT = {"Q4": 6.0, "T3": 2.5, "T6": 2.5}
_TISSUE_SHARE = 0.7
_BLEND = 3.0


@dataclass(frozen=True)
class SkinGrid:
    """Nodes of the skin in rows from the outer surface to the dermis-tissue interface."""

    points: Floats  # (rows, columns, 2), node positions [m]
    arc_length: Floats  # (columns,), arc length of each column on the outer surface from the lowest point [m]
    epidermis_rows: int  # number of rows of cells in the epidermis
    closed: bool  # whether the last column is followed by the first one
    contact: tuple[float, float]  # first and last arc length of the part meshed at the contact size [m]


def sweep_skin(fingertip: FingertipNumbers, sizes: ElementSizes, contour: Floats) -> SkinGrid:
    """Divide the skin into rows and columns.

    Arrays: contour (n, 2) [m].
    """
    curve = outline_curve(fingertip)
    spacing = _contact_spacing(fingertip, sizes)
    rows = row_counts(fingertip, spacing)
    limits = arc_length_at_cut(fingertip, curve, 0.0)
    _check_zone(fingertip, limits)
    contact = _contact_range(curve, sizes.contact_reach, limits)

    narrowest, widest = column_limits(fingertip, sizes, rows)

    def wanted(arc_length: Floats) -> Floats:
        beneath = at_depth(curve, arc_length, fingertip.layers.skin_thickness)
        tissue, _ = cKDTree(contour).query(beneath)
        width: Floats = np.clip(_TISSUE_SHARE * tissue, min(narrowest, widest), widest)
        return width

    columns = _columns(limits, contact, spacing, wanted)
    points = np.stack([_row(fingertip, curve, columns, share) for share in _shares(rows)])
    closed = curve.closed
    return SkinGrid(points[:, :-1] if closed else points, columns[:-1] if closed else columns, rows[0], closed, contact)


def column_limits(fingertip: FingertipNumbers, sizes: ElementSizes, rows: tuple[int, int]) -> tuple[float, float]:
    """Return the least and the largest width of a column [m] that keep the skin's cells in good shape."""
    heights = fingertip.layers.epidermis_thickness / rows[0], fingertip.layers.dermis_thickness / rows[1]
    aspect = _LARGEST_ASPECT[sizes.element]
    return max(heights) / aspect, min(sizes.bulk_size, aspect * min(heights))


def _contact_spacing(fingertip: FingertipNumbers, sizes: ElementSizes) -> float:
    """Return the spacing of the columns: near the contact size, and so that every ridge tip has a column."""
    features = [(n, f) for n, f in (("ridges", fingertip.ridges), ("fingerprint", fingertip.fingerprint)) if f.enabled]
    for name, feature in features:
        _check_resolution(name, feature.pitch, sizes.contact_size)
    if not features:
        return sizes.contact_size
    half_pitch = features[0][1].pitch / 2
    return half_pitch / max(2, round(half_pitch / sizes.contact_size))


def _check_resolution(name: str, pitch: float, contact_size: float) -> None:
    # Refining silently would turn a mesh study into a series of equal meshes, so coarse sizes are refused.
    if contact_size > pitch / 3:
        fault = f"got {millimetres(contact_size)}"
        allowed = f"needs <= {millimetres(pitch / 3)}, a third of {name}.pitch"
        repair = f"write '{millimetres(pitch / 4)}' or switch the {name} off"
        raise InputError("mesh.contact_size", fault, allowed, repair)


def row_counts(fingertip: FingertipNumbers, spacing: float) -> tuple[int, int]:
    """Return how many rows of cells epidermis and dermis have where columns are `spacing` [m] apart."""
    layers = fingertip.layers
    # Dermis rows may be a little taller: nothing in the dermis changes as fast as under the surface.
    in_dermis = round(layers.dermis_thickness / (1.25 * spacing))
    return max(1, round(layers.epidermis_thickness / spacing)), max(1, in_dermis)


def _check_zone(fingertip: FingertipNumbers, limits: tuple[float, float]) -> None:
    zone, where = fingertip.zone, f"{fingertip.section}.zone"
    if not limits[0] <= zone.start < zone.end <= limits[1]:
        fault = f"reaches from {millimetres(zone.start)} to {millimetres(zone.end)}"
        allowed = f"needs to lie within {millimetres(limits[0])} to {millimetres(limits[1])}, the skin of the section"
        raise InputError(where, fault, allowed)


def _contact_range(curve: Curve, reach: float, limits: tuple[float, float]) -> tuple[float, float]:
    low = curve.points[:, 1] <= curve.points[:, 1].min() + reach
    inside = low & (curve.arc_length >= limits[0]) & (curve.arc_length <= limits[1])
    arc_length = curve.arc_length[inside]
    return float(arc_length[0]), float(arc_length[-1])


def _columns(
    limits: tuple[float, float], contact: tuple[float, float], spacing: float, wanted: Callable[[Floats], Floats]
) -> Floats:
    """Return the arc lengths of the columns: evenly spaced in the contact, growing on either side of it."""
    pair = 2 * spacing
    # At least one pair of columns is left on either side, so that a side never ends in a sliver.
    first = max(int(np.floor(contact[0] / pair)), int(np.ceil(limits[0] / pair)) + 1)
    last = min(int(np.ceil(contact[1] / pair)), int(np.floor(limits[1] / pair)) - 1)
    middle = np.arange(2 * first, 2 * last + 1) * spacing
    before, after = np.linspace(limits[0], middle[0], 2000), np.linspace(middle[-1], limits[1], 2000)
    sizes_before, sizes_after = (wanted(side) for side in (before, after))
    sizes_before[-1] = sizes_after[0] = spacing
    return np.concatenate([grade(before, sizes_before)[:-1], middle, grade(after, sizes_after)[1:]])


def _shares(rows: tuple[int, int]) -> list[tuple[float, float]]:
    """Return for each row of nodes its share of the epidermis and of the dermis."""
    epidermis = [(k / rows[0], 0.0) for k in range(rows[0])]
    return epidermis + [(1.0, k / rows[1]) for k in range(rows[1] + 1)]


def _row(fingertip: FingertipNumbers, curve: Curve, columns: Floats, share: tuple[float, float]) -> Floats:
    """Return the (columns, 2) nodes of one row; in an open section its ends lie on the proximal cut."""
    layers = fingertip.layers
    level = share[0] * layers.epidermis_thickness + share[1] * layers.dermis_thickness
    ends = arc_length_at_cut(fingertip, curve, level)
    foot = _shift(columns, ends, _BLEND * layers.skin_thickness)
    surface, interface = surface_depth(fingertip, foot), interface_depth(fingertip, foot)
    depth = surface + share[0] * (interface - surface) + share[1] * (layers.skin_thickness - interface)
    row = at_depth(curve, foot, depth)
    if not curve.closed:
        row[[0, -1], 0] = -fingertip.sagittal.pad_length
    return row


def _shift(columns: Floats, ends: tuple[float, float], blend: float) -> Floats:
    """Shift columns near the ends so that the row starts and ends at the arc lengths `ends`."""
    near_first = np.clip(1.0 - (columns - columns[0]) / blend, 0.0, 1.0)
    near_last = np.clip(1.0 - (columns[-1] - columns) / blend, 0.0, 1.0)
    shifted: Floats = columns + near_first * (ends[0] - columns[0]) + near_last * (ends[1] - columns[-1])
    return shifted


def section_cells(fingertip: FingertipNumbers, sizes: ElementSizes) -> float:
    """Return about how many cells the mesh of a section will have, without making it.

    Rows and columns of the skin, fine where it can touch; squares of the bulk's size that fill the outline, and more
    where they grow from the contact inwards; triangles are halves of the skin's cells, and equilateral inside.
    """
    curve = outline_curve(fingertip)
    first, last = arc_length_at_cut(fingertip, curve, 0.0)
    points = curve.points[(curve.arc_length >= first) & (curve.arc_length <= last)]
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    fine = points[1:, 1] <= points[:, 1].min() + sizes.contact_reach
    rows = row_counts(fingertip, sizes.contact_size)
    columns = np.sum(lengths / np.where(fine, sizes.contact_size, column_limits(fingertip, sizes, rows)[1]))
    growing = lengths[fine].sum() * (1.0 / sizes.contact_size - 1.0 / sizes.bulk_size) / GROWTH
    x, y = points.T
    area = abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))) / 2
    in_skin, in_core = sum(rows) * columns, growing + area / sizes.bulk_size**2
    if sizes.element == "Q4":
        return float(in_skin + in_core)
    return float(2.0 * in_skin + 4.0 / np.sqrt(3.0) * in_core)


def mesh_section(fingertip: FingertipNumbers, sizes: ElementSizes) -> skfem.Mesh2D:
    """Build the mesh of a section from a set of sizes; regions and boundaries are those of `build_section`."""
    contour = phalanx_contour(fingertip)
    grid = sweep_skin(fingertip, sizes, contour)
    # Gmsh is loaded here and nowhere else: a mesh file of one's own does without it.

    core = mesh_core(contour, grid.points[-1], grid.closed, sizes)
    points, cells = _join(grid, core, triangles=sizes.element != "Q4")
    region = np.repeat(np.arange(len(REGIONS)), [len(cells[name]) for name in REGIONS])
    fine = (grid.arc_length >= grid.contact[0]) & (grid.arc_length <= grid.contact[1])
    mesh = with_names(_container(points, cells, sizes.element), region, fine)
    check_quality(mesh)
    return mesh


def _join(grid: SkinGrid, core: CoreMesh, triangles: bool) -> tuple[Floats, dict[str, Integers]]:
    """Join skin and core along the dermis-tissue interface; the skin's nodes come first."""
    skin = grid.points.reshape(-1, 2)
    rows, columns = grid.points.shape[:2]
    number, border = _core_numbers(core, grid)
    cells = _skin_cells(rows, columns, grid)
    if triangles:
        cells = {name: _halve(skin, nodes) for name, nodes in cells.items()}
    cells |= {name: number[nodes] for name, nodes in core.cells.items()}
    return np.vstack([skin, core.points[~border]]), cells


def _skin_cells(rows: int, columns: int, grid: SkinGrid) -> dict[str, Integers]:
    node = np.arange(rows * columns).reshape(rows, columns)
    ahead = np.roll(node, -1, axis=1)
    if not grid.closed:
        node, ahead = node[:, :-1], ahead[:, :-1]
    quadrilaterals = np.stack([node[:-1], ahead[:-1], ahead[1:], node[1:]], axis=-1)
    layers = np.split(quadrilaterals, [grid.epidermis_rows])
    return {name: layer.reshape(-1, 4) for name, layer in zip(REGIONS[:2], layers, strict=True)}


def _halve(points: Floats, cells: Integers) -> Integers:
    """Cut quadrilaterals along their shorter diagonal into triangles."""
    first, second = (np.linalg.norm(points[cells[:, a]] - points[cells[:, b]], axis=1) for a, b in ((0, 2), (1, 3)))
    turned = np.where((first <= second)[:, None], cells, np.roll(cells, -1, axis=1))
    return np.vstack([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])


def _core_numbers(core: CoreMesh, grid: SkinGrid) -> tuple[Integers, NDArray[np.bool_]]:
    """Return the final number of each core node, and which ones are on the interface."""
    interface = grid.points[-1]
    quadrilaterals = core.cells["tissue"].shape[1] == 4
    expected = _with_midpoints(interface, grid.closed) if quadrilaterals else interface
    distance, match = cKDTree(core.points).query(expected)
    if distance.max() > 1e-9:
        missing = coordinates(interface[int(distance.argmax())])
        raise MeshError("dermis_tissue", f"no tissue node at {missing}", "needs one")
    border = np.zeros(len(core.points), dtype=bool)
    border[match] = True
    first = grid.points.shape[0] * grid.points.shape[1]
    number = np.empty(len(core.points), dtype=np.int64)
    number[match] = np.arange(first - len(interface), first)
    number[~border] = first + np.arange(np.count_nonzero(~border))
    return number, border


def _with_midpoints(interface: Floats, closed: bool) -> Floats:
    """Return where the core has its interface nodes: every second one exact, midpoints between them."""
    expected = interface.copy()
    following = np.roll(interface, -1, axis=0)[1::2] if closed else interface[2::2]
    expected[1::2] = (interface[: len(interface) - 1 : 2][: len(following)] + following) / 2
    return expected


def _container(points: Floats, cells: dict[str, Integers], element: str) -> skfem.Mesh2D:
    kind = skfem.MeshQuad1 if element == "Q4" else skfem.MeshTri1
    nodes = np.vstack([cells[name] for name in REGIONS]).astype(np.int32)
    mesh = kind(np.ascontiguousarray(points.T), np.ascontiguousarray(nodes.T))
    return skfem.MeshTri2.from_mesh(mesh) if element == "T6" else mesh
