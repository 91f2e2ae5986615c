"""Build the 2D mesh of a fingertip section: rows of cells in the skin, and Gmsh's inside it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import gmsh
import numpy as np
import pygmsh
import skfem

from fingerslip.arrays import Flags, Floats, Integers
from fingerslip.errors import InputError, MeshError
from fingerslip.mesh.facets import Mesh, are_between, outward_normals, with_groups
from fingerslip.mesh.gmsh_session import MILLIMETRES, gmsh_errors, gmsh_session, node_positions, sizes_from_fields_alone
from fingerslip.mesh.quality import check_quality
from fingerslip.mesh.repair import smooth
from fingerslip.mesh.source import GROWTH, GradedMesh, grade, size_at, subdivide
from fingerslip.specimens.fingertip.numbers import REGIONS, FingertipNumbers
from fingerslip.specimens.fingertip.outline import (
    Curve,
    arc_length_at_cut,
    at_depth,
    interface_depth,
    nearest,
    outline_curve,
    surface_depth,
)
from fingerslip.specimens.fingertip.phalanx import phalanx_contour, reaches_cut
from fingerslip.units import coordinates, millimetres

_NAMES = (*REGIONS, "nail")
EPIDERMIS, DERMIS, TISSUE, PHALANX, NAIL = range(len(_NAMES))
# Facets of the phalanx that face down and up within 60 degrees.
_STEEPEST = 0.5
_TURN = np.radians(18.0)
_FRONTAL, _FRONTAL_FOR_QUADRILATERALS = 6, 8
# Rows go all round the finger, so columns may only widen as far as the cells keep a good shape.
_LARGEST_ASPECT = {"Q4": 6.0, "T3": 2.5, "T6": 2.5}
# Share of the tissue beneath that the width of a column may have.
TISSUE_SHARE = 0.7
#: Distance from the proximal cut over the thickness of the skin within which rows are shifted to end on it.
BLEND = 3.0


@dataclass(frozen=True)
class CoreMesh:
    """Mesh of tissue and phalanx, in 2D or in 3D."""

    points: Floats  # (n, dim), node positions [m]
    cells: dict[str, Integers]  # nodes of the cells of `tissue` and `phalanx`, in 2D counter-clockwise


@dataclass(frozen=True)
class SkinGrid:
    """Nodes of the skin in rows from the outer surface to the dermis-tissue interface."""

    points: Floats  # (rows, columns, 2), node positions [m]
    arc_length: Floats  # (columns,), arc length of each column on the outer surface from the lowest point [m]
    epidermis_rows: int  # number of rows of cells in the epidermis
    closed: bool  # whether the last column is followed by the first one
    contact: tuple[float, float]  # first and last arc length of the part meshed at the contact size [m]


def mesh_section(fingertip: FingertipNumbers, sizes: GradedMesh) -> skfem.Mesh2D:
    """Build the mesh of a section from a set of sizes; regions and boundaries are those of `build_section`."""
    contour = phalanx_contour(fingertip)
    grid = sweep_skin(fingertip, sizes, contour)
    core = mesh_core(contour, grid.points[-1], grid.closed, sizes)
    points, cells = _join(grid, core, triangles=sizes.element != "Q4")
    region = np.repeat(np.arange(len(REGIONS)), [len(cells[name]) for name in REGIONS])
    nodes = np.vstack([cells[name] for name in REGIONS]).astype(np.int32)
    kind = skfem.MeshQuad1 if sizes.element == "Q4" else skfem.MeshTri1
    mesh = kind(np.ascontiguousarray(points.T), np.ascontiguousarray(nodes.T))
    fine = (grid.arc_length >= grid.contact[0]) & (grid.arc_length <= grid.contact[1])
    mesh = with_names(skfem.MeshTri2.from_mesh(mesh) if sizes.element == "T6" else mesh, region, fine)
    check_quality(mesh)
    return mesh


def section_cells(fingertip: FingertipNumbers, sizes: GradedMesh) -> float:
    """Return about how many cells the mesh of a section will have, without making it; sizes that have none are refused.

    Rows and columns of the skin, fine where it can touch; squares of the bulk's size that fill the outline, and more
    where they grow from the contact inwards; triangles are halves of the skin's cells, and equilateral inside.
    """
    contact_spacing(fingertip, sizes)
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


def with_names(mesh: Mesh, region: Integers, fine: Flags) -> Mesh:
    """Return a mesh in 2D or 3D with the names of its regions and boundaries, without those that are empty.

    `region` (n_cells,) is the number of each cell's region; the first nodes are those of the outer surface, of which
    `fine` tells whether they are in the part meshed at the contact size.
    """
    outer, first = mesh.f2t[1] < 0, region[mesh.f2t[0]]
    on_skin = (mesh.facets < len(fine)).all(axis=0) & outer
    boundaries = {
        "epidermis_dermis": are_between(mesh, region, EPIDERMIS, DERMIS),
        "dermis_tissue": are_between(mesh, region, DERMIS, TISSUE),
        "phalanx_surface": are_between(mesh, region, TISSUE, PHALANX),
        "skin": on_skin,
        "pad": on_skin & np.isin(mesh.facets, np.flatnonzero(fine)).all(axis=0),
        "nail": on_skin & (first == NAIL),
        "base": outer & ~on_skin,
        "phalanx_base": outer & ~on_skin & (first == PHALANX),
    }
    surface, upward = np.flatnonzero(boundaries["phalanx_surface"]), np.zeros(len(outer))
    inside = np.where(first[surface] == PHALANX, *mesh.f2t[:, surface])
    upward[surface] = outward_normals(mesh, surface, inside)[1]
    boundaries |= {"phalanx_palmar": upward < -_STEEPEST, "phalanx_dorsal": upward > _STEEPEST}
    return with_groups(mesh, {name: region == number for number, name in enumerate(_NAMES)}, boundaries)


def mesh_core(contour: Floats, border: Floats, closed: bool, sizes: GradedMesh) -> CoreMesh:
    """Mesh what lies inside the skin: inside its border (n, 2) and around the contour (m, 2) of the phalanx [m].

    Quadrilaterals come from a mesh of twice the size, whose triangles and quadrilaterals are all divided into
    quadrilaterals; the nodes of the border are therefore every second one of `border`, and the midpoints between them.
    """
    quadrilaterals = sizes.element == "Q4"
    factor = 2 if quadrilaterals else 1
    skin, largest = border[::factor], factor * sizes.bulk_size
    # At each node of the border the mean length of its neighbouring segments.
    length = np.linalg.norm(np.diff(np.vstack([border[-1:], border, border[:1]]) if closed else border, axis=0), axis=1)
    around = length if closed else np.concatenate([length[:1], length, length[-1:]])
    spacing = factor * ((around[1:] + around[:-1]) / 2)[::factor]

    def divide(line: Floats) -> Floats:
        return subdivide(line, size_at(line, skin, spacing, largest), factor * _TURN)

    stops = [skin[-1], contour[-1], contour[0], skin[0]] if reaches_cut(contour) else [skin[-1], skin[0]]
    # The pieces of the proximal cut, from its dorsal to its palmar end.
    cuts = [] if closed else [divide(np.linspace(a, b, 200)) for a, b in itertools.pairwise(stops)]
    with gmsh_session() as geometry:
        surfaces = _draw(geometry, skin, divide(contour), cuts)
        core = _generate(geometry, surfaces, largest, quadrilaterals)
    if not quadrilaterals:
        return core
    counts = [len(nodes) for nodes in core.cells.values()]
    region = np.repeat(np.arange(len(counts)), counts)
    return CoreMesh(smooth(core.points, np.vstack(list(core.cells.values())), region), core.cells)


def mesh_ring(outer: Floats, inner: Floats | None, largest: float) -> CoreMesh:
    """Mesh what lies inside a ring of nodes (n, 2) [m] with triangles, all nodes of the rings kept.

    Inside the inner ring (m, 2), where there is one, is the phalanx; `largest` [m] is the largest size.
    """
    with gmsh_session() as geometry:
        if inner is None:
            ring = _points(geometry, outer)
            loop = geometry.add_curve_loop(_polyline(geometry, [*ring, ring[0]]))
            surfaces = {"tissue": geometry.add_plane_surface(loop).dim_tags[0][1]}
        else:
            surfaces = _draw(geometry, outer, np.vstack([inner, inner[:1]]), [])
        return _generate(geometry, surfaces, largest, quadrilaterals=False)


_Points = Sequence[pygmsh.common.point.Point]


def _draw(geometry: pygmsh.geo.Geometry, skin: Floats, phalanx: Floats, cuts: Sequence[Floats]) -> dict[str, int]:
    """Draw the surfaces of tissue and phalanx inside the nodes of the skin; return their tags in Gmsh."""
    ring = _points(geometry, skin)
    # The phalanx divides the cut in three where it reaches it, else it lies in a hole of the tissue.
    if len(cuts) == 3:
        inner = _points(geometry, phalanx)
        dorsal, through, palmar = (_points(geometry, cut[1:-1]) for cut in cuts)
        around = _polyline(geometry, inner)
        outside = _polyline(geometry, [inner[0], *palmar, *ring, *dorsal, inner[-1]])
        tissue = geometry.add_curve_loop([*outside, *(-line for line in reversed(around))])
        bone = geometry.add_curve_loop([*around, *_polyline(geometry, [inner[-1], *through, inner[0]])])
        holes = []
    else:
        inner = _points(geometry, phalanx[:-1])
        bone = geometry.add_curve_loop(_polyline(geometry, [*inner, inner[0]]))
        back = _points(geometry, cuts[0][1:-1]) if cuts else []
        tissue = geometry.add_curve_loop(_polyline(geometry, [*ring, *back, ring[0]]))
        holes = [bone]
    return {
        "tissue": geometry.add_plane_surface(tissue, holes=holes).dim_tags[0][1],
        "phalanx": geometry.add_plane_surface(bone).dim_tags[0][1],
    }


def _points(geometry: pygmsh.geo.Geometry, points: Floats) -> list[pygmsh.common.point.Point]:
    return [geometry.add_point([x * MILLIMETRES, y * MILLIMETRES, 0.0]) for x, y in points]


def _polyline(geometry: pygmsh.geo.Geometry, points: _Points) -> list[pygmsh.common.line.Line]:
    """Join points by lines that Gmsh does not divide."""
    lines = [geometry.add_line(a, b) for a, b in itertools.pairwise(points)]
    for line in lines:
        geometry.set_transfinite_curve(line, 2, "Progression", 1.0)
    return lines


def _generate(
    geometry: pygmsh.geo.Geometry, surfaces: dict[str, int], largest: float, quadrilaterals: bool
) -> CoreMesh:
    """Mesh what was drawn, with sizes that grow from all lines to the largest one [m]."""
    size, fields = largest * MILLIMETRES, gmsh.model.mesh.field
    gmsh.model.geo.synchronize()
    field = fields.add("Extend")
    fields.setNumbers(field, "CurvesList", [tag for _, tag in gmsh.model.getEntities(1)])
    fields.setNumbers(field, "SurfacesList", [tag for _, tag in gmsh.model.getEntities(2)])
    for name, value in (("SizeMax", size), ("DistMax", size / GROWTH), ("Power", 1)):
        fields.setNumber(field, name, value)
    fields.setAsBackgroundMesh(field)
    sizes_from_fields_alone()
    for option in ("RecombineAll", "SubdivisionAlgorithm"):
        gmsh.option.setNumber(f"Mesh.{option}", int(quadrilaterals))
    # A pair of triangles that makes a poor quadrilateral divides better as two triangles.
    gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 0)
    gmsh.option.setNumber("Mesh.RecombineMinimumQuality", 0.4)
    with gmsh_errors("tissue and phalanx", "needs a section that Gmsh can mesh"):
        geometry.generate_mesh(dim=2, algorithm=_FRONTAL_FOR_QUADRILATERALS if quadrilaterals else _FRONTAL)
    cells, corners = {}, 4 if quadrilaterals else 3
    for name, surface in surfaces.items():
        kinds, _, nodes = gmsh.model.mesh.getElements(2, surface)
        if len(kinds) != 1 or gmsh.model.mesh.getElementProperties(kinds[0])[3] != corners:
            fault = f"Gmsh made cells of {len(kinds)} kinds"
            raise MeshError("tissue and phalanx", fault, f"needs {corners} corners each")
        cells[name] = np.asarray(nodes[0], dtype=np.int64).reshape(-1, corners)
    used = np.unique(np.concatenate([nodes.ravel() for nodes in cells.values()]))
    points = node_positions(used)[:, :2] / MILLIMETRES
    return CoreMesh(points, {name: np.searchsorted(used, nodes) for name, nodes in cells.items()})


def sweep_skin(fingertip: FingertipNumbers, sizes: GradedMesh, contour: Floats) -> SkinGrid:
    """Divide the skin around the contour (n, 2) [m] of the phalanx into rows and columns."""
    curve, layers = outline_curve(fingertip), fingertip.layers
    spacing = contact_spacing(fingertip, sizes)
    rows = row_counts(fingertip, spacing)
    limits, zone = arc_length_at_cut(fingertip, curve, 0.0), fingertip.zone
    if not limits[0] <= zone.start < zone.end <= limits[1]:
        fault = f"reaches from {millimetres(zone.start)} to {millimetres(zone.end)}"
        allowed = f"needs to lie within {millimetres(limits[0])} to {millimetres(limits[1])}, the skin of the section"
        raise InputError(f"{fingertip.section}.zone", fault, allowed)
    low = curve.points[:, 1] <= curve.points[:, 1].min() + sizes.contact_reach
    in_reach = curve.arc_length[low & (curve.arc_length >= limits[0]) & (curve.arc_length <= limits[1])]
    contact = float(in_reach[0]), float(in_reach[-1])
    narrowest, widest = column_limits(fingertip, sizes, rows)

    def side(first: float, last: float) -> tuple[Floats, Floats]:
        """Return arc lengths on one side of the contact, and how wide columns may be there."""
        arc_length = np.linspace(first, last, 2000)
        tissue, _ = nearest(contour, at_depth(curve, arc_length, layers.skin_thickness))
        return arc_length, np.clip(TISSUE_SHARE * tissue, min(narrowest, widest), widest)

    pair = 2 * spacing
    # At least one pair of columns is left on either side, so that a side never ends in a sliver.
    first = max(int(np.floor(contact[0] / pair)), int(np.ceil(limits[0] / pair)) + 1)
    last = min(int(np.ceil(contact[1] / pair)), int(np.floor(limits[1] / pair)) - 1)
    middle = np.arange(2 * first, 2 * last + 1) * spacing
    before, after = side(limits[0], middle[0]), side(middle[-1], limits[1])
    before[1][-1] = after[1][0] = spacing
    columns = np.concatenate([grade(*before)[:-1], middle, grade(*after)[1:]])
    # Of each row of nodes its share of the epidermis and of the dermis.
    shares = [(k / rows[0], 0.0) for k in range(rows[0])] + [(1.0, k / rows[1]) for k in range(rows[1] + 1)]
    points = np.stack([_row(fingertip, curve, columns, share) for share in shares])
    count = len(columns) - curve.closed
    return SkinGrid(points[:, :count], columns[:count], rows[0], curve.closed, contact)


def column_limits(fingertip: FingertipNumbers, sizes: GradedMesh, rows: tuple[int, int]) -> tuple[float, float]:
    """Return the least and the largest width of a column [m] that keep the skin's cells in good shape."""
    heights = fingertip.layers.epidermis_thickness / rows[0], fingertip.layers.dermis_thickness / rows[1]
    aspect = _LARGEST_ASPECT[sizes.element]
    return max(heights) / aspect, min(sizes.bulk_size, aspect * min(heights))


def contact_spacing(fingertip: FingertipNumbers, sizes: GradedMesh) -> float:
    """Return the spacing of the columns: near the contact size, and so that every ridge tip has a column."""
    features = [(n, f) for n, f in (("ridges", fingertip.ridges), ("fingerprint", fingertip.fingerprint)) if f.enabled]
    for name, feature in features:
        # Refining silently would turn a mesh study into a series of equal meshes, so coarse sizes are refused.
        if sizes.contact_size > feature.pitch / 3:
            allowed = f"needs <= {millimetres(feature.pitch / 3)}, a third of {name}.pitch"
            repair = f"write '{millimetres(feature.pitch / 4)}' or switch the {name} off"
            raise InputError("mesh.contact_size", f"got {millimetres(sizes.contact_size)}", allowed, repair)
    if not features:
        return sizes.contact_size
    half_pitch = features[0][1].pitch / 2
    return half_pitch / max(2, round(half_pitch / sizes.contact_size))


def row_counts(fingertip: FingertipNumbers, spacing: float) -> tuple[int, int]:
    """Return how many rows of cells epidermis and dermis have where columns are `spacing` [m] apart."""
    layers = fingertip.layers
    # Dermis rows may be a little taller: nothing in the dermis changes as fast as under the surface.
    in_dermis = round(layers.dermis_thickness / (1.25 * spacing))
    return max(1, round(layers.epidermis_thickness / spacing)), max(1, in_dermis)


def _row(fingertip: FingertipNumbers, curve: Curve, columns: Floats, share: tuple[float, float]) -> Floats:
    """Return the (columns, 2) nodes of one row; in an open section its ends lie on the proximal cut."""
    layers = fingertip.layers
    level = share[0] * layers.epidermis_thickness + share[1] * layers.dermis_thickness
    # Columns near the ends are shifted so that the row starts and ends at the arc lengths of the cut.
    first, last = arc_length_at_cut(fingertip, curve, level)
    blend = BLEND * layers.skin_thickness
    near_first = np.clip(1.0 - (columns - columns[0]) / blend, 0.0, 1.0)
    near_last = np.clip(1.0 - (columns[-1] - columns) / blend, 0.0, 1.0)
    foot: Floats = columns + near_first * (first - columns[0]) + near_last * (last - columns[-1])
    surface, interface = surface_depth(fingertip, foot), interface_depth(fingertip, foot)
    depth = surface + share[0] * (interface - surface) + share[1] * (layers.skin_thickness - interface)
    row = at_depth(curve, foot, depth)
    if not curve.closed:
        row[[0, -1], 0] = -fingertip.sagittal.pad_length
    return row


def _join(grid: SkinGrid, core: CoreMesh, triangles: bool) -> tuple[Floats, dict[str, Integers]]:
    """Join skin and core along the dermis-tissue interface; the skin's nodes come first."""
    skin = grid.points.reshape(-1, 2)
    node = np.arange(len(skin)).reshape(grid.points.shape[:2])
    number, border = _core_numbers(core, grid, node[-1])
    ahead = np.roll(node, -1, axis=1)
    if not grid.closed:
        node, ahead = node[:, :-1], ahead[:, :-1]
    quadrilaterals = np.stack([node[:-1], ahead[:-1], ahead[1:], node[1:]], axis=-1)
    cells = {}
    for name, layer in zip(REGIONS[:2], np.split(quadrilaterals, [grid.epidermis_rows]), strict=True):
        corners = layer.reshape(-1, 4)
        if triangles:
            # Quadrilaterals are cut along their shorter diagonal.
            first, second = (np.linalg.norm(skin[corners[:, a]] - skin[corners[:, a + 2]], axis=1) for a in (0, 1))
            turned = np.where((first <= second)[:, None], corners, np.roll(corners, -1, axis=1))
            corners = np.vstack([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])
        cells[name] = corners
    cells |= {name: number[nodes] for name, nodes in core.cells.items()}
    return np.vstack([skin, core.points[~border]]), cells


def _core_numbers(core: CoreMesh, grid: SkinGrid, last_row: Integers) -> tuple[Integers, Flags]:
    """Return the final number of each core node, and which ones are on the interface, the nodes of the last row."""
    interface = grid.points[-1]
    expected = interface.copy()
    if core.cells["tissue"].shape[1] == 4:
        # The core has every second node exactly, and midpoints between them.
        following = np.roll(interface, -1, axis=0)[1::2] if grid.closed else interface[2::2]
        expected[1::2] = (interface[: len(interface) - 1 : 2][: len(following)] + following) / 2
    distance, match = nearest(core.points, expected)
    if distance.max() > 1e-9:
        missing = coordinates(interface[int(distance.argmax())])
        raise MeshError("dermis_tissue", f"no tissue node at {missing}", "needs one")
    border = np.zeros(len(core.points), dtype=bool)
    border[match] = True
    number = np.empty(len(core.points), dtype=np.int64)
    number[match] = last_row
    number[~border] = last_row[-1] + 1 + np.arange(np.count_nonzero(~border))
    return number, border
