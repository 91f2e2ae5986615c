"""Build the mesh of a fingertip in 3D: prisms below a triangulated skin, cut in tetrahedra, and Gmsh's inside it."""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass

import gmsh
import numpy as np
import skfem

from fingerslip.arrays import Flags, Floats, Integers
from fingerslip.errors import InputError
from fingerslip.mesh.gmsh_session import (
    TETRAHEDRON,
    TRIANGLE,
    gmsh_errors,
    gmsh_session,
    length_unit,
    mesh_surface,
    node_positions,
)
from fingerslip.mesh.quality import check_quality
from fingerslip.mesh.scan.surfaces import Surface, boundary_loops
from fingerslip.mesh.source import GROWTH, GradedMesh
from fingerslip.specimens.fingertip.meshing.section import (
    BLEND,
    DERMIS,
    EPIDERMIS,
    NAIL,
    PHALANX,
    TISSUE,
    TISSUE_SHARE,
    CoreMesh,
    mesh_ring,
    with_names,
)
from fingerslip.specimens.fingertip.numbers import FingertipNumbers
from fingerslip.specimens.fingertip.outline import nearest, smooth_step
from fingerslip.specimens.fingertip.phalanx import PhalanxSurface, phalanx_surface
from fingerslip.specimens.fingertip.skin import (
    below_skin,
    depth_below_skin,
    inward_skin_normal,
    onto_skin,
    pose_points,
    relief_depth,
    skin_grid,
    skin_ring,
    skin_section,
    solid_shape,
)
from fingerslip.units import coordinates, millimetres

_HXT = 10
_LARGEST_ASPECT = 2.5
_SHIFTS = 30
_SLICES = 400


@dataclass(frozen=True)
class SolidSkin:
    """Nodes of the skin in rows from the outer surface to the dermis-tissue interface."""

    points: Floats  # (rows, columns, 3), node positions of the level finger [m]
    triangles: Integers  # (m, 3), columns of each triangle of a row, counter-clockwise as seen from outside
    levels: Floats  # (rows,), mean depth of each row below the outer surface [m]
    fine: Flags  # (columns,), whether a column is in the part meshed at the contact size


def mesh_solid(fingertip: FingertipNumbers, sizes: GradedMesh) -> skfem.Mesh3D:
    """Build the mesh of a fingertip in 3D from a set of sizes; regions and boundaries are those of `build_solid`."""
    check_skin_fits(fingertip)
    phalanx = phalanx_surface(fingertip)
    skin = sweep_solid_skin(fingertip, sizes, phalanx.points.reshape(-1, 3))
    surface = mesh_phalanx(fingertip, phalanx, sizes, skin)
    core = mesh_solid_core(Surface(skin.points[-1], skin.triangles), surface, sizes.bulk_size)
    mesh = _join(fingertip, skin, core)
    mesh = dataclasses.replace(mesh, doflocs=np.ascontiguousarray(pose_points(fingertip, mesh.p.T).T))
    check_quality(mesh)
    if sizes.element == "T4":
        return mesh
    quadratic = skfem.MeshTet2.from_mesh(mesh)
    return dataclasses.replace(quadratic, _subdomains=mesh.subdomains, _boundaries=mesh.boundaries)


def solid_cells(fingertip: FingertipNumbers, sizes: GradedMesh) -> float:
    """Return about how many tetrahedra a fine mesh will have, without making it; sizes that have none are refused.

    As many regular ones of the bulk's size as fill the finger, whose sections are ellipses; coarse meshes have more,
    because layers and contact are finer.
    """
    _check_contact_size(fingertip, sizes)
    outline = fingertip.sagittal
    x = np.linspace(-outline.pad_length, outline.tip_length, _SLICES)
    _, height, width = skin_section(fingertip, x)
    volume = float(np.trapezoid(np.pi * height * width, x))
    return 6.0 * float(np.sqrt(2.0)) * volume / sizes.bulk_size**3


def _check_contact_size(fingertip: FingertipNumbers, sizes: GradedMesh) -> None:
    """Refuse a contact size that gives a fingerprint fewer than four elements a ridge."""
    fingerprint = fingertip.fingerprint
    if fingerprint.enabled and sizes.contact_size > fingerprint.pitch / 4:
        fault, allowed = f"got {millimetres(sizes.contact_size)}", f"needs <= {millimetres(fingerprint.pitch / 4)}"
        repair = "write a smaller one or switch the fingerprint off"
        raise InputError("mesh.contact_size", fault, f"{allowed}, a quarter of fingerprint.pitch", repair)


def mesh_solid_core(skin: Surface, phalanx: Surface, largest: float) -> CoreMesh:
    """Mesh what lies inside the skin, around the surface of the phalanx, with cells up to the largest size [m]."""
    (hull, surfaces), unit = _hull(skin, phalanx, largest), length_unit(largest)
    with gmsh_session():
        volumes = _draw(hull, surfaces, unit)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1)
        gmsh.option.setNumber("Mesh.MeshSizeMax", largest / unit)
        gmsh.option.setNumber("Mesh.Algorithm3D", _HXT)
        with gmsh_errors("tissue and phalanx", "needs one that Gmsh can mesh"):
            gmsh.model.mesh.generate(3)
            gmsh.model.mesh.optimize("")
        cells = {name: gmsh.model.mesh.getElementsByType(TETRAHEDRON, volume)[1] for name, volume in volumes.items()}
        # Nodes of the hull keep their numbers.
        used = np.unique(np.concatenate([np.arange(1, len(hull) + 1), *cells.values()]))
        points = node_positions(used) * unit
    points[: len(hull)] = hull
    return CoreMesh(points, {name: np.searchsorted(used, nodes).reshape(-1, 4) for name, nodes in cells.items()})


def rim(surface: Surface) -> Integers:
    """Return the nodes of the rim of a surface in turn, the surface on their left; none where it is closed."""
    loops = boundary_loops(surface)
    return np.roll(loops[0][::-1], 2) if loops else np.empty(0, dtype=np.int64)


def _hull(skin: Surface, phalanx: Surface, largest: float) -> tuple[Floats, dict[str, Integers]]:
    """Return nodes and triangles of closed surfaces: skin, phalanx, and their flat caps on the proximal cut."""

    def flat(points: Floats) -> Floats:
        """Return the coordinates z and y of points on the proximal cut."""
        return points[:, [2, 1]]

    count = len(skin.points)
    points = np.vstack([skin.points, phalanx.points])
    outer, inner = rim(skin), rim(phalanx)
    core = mesh_ring(flat(skin.points[outer]), flat(phalanx.points[inner]) if len(inner) else None, largest)
    available = np.concatenate([outer, inner + count])
    distance, rows = nearest(flat(points[available]), core.points)
    is_new = distance >= 1e-9
    number = np.where(is_new, len(points) - 1 + np.cumsum(is_new), available[rows])
    new = core.points[is_new]
    on_cut = np.column_stack([np.full(len(new), skin.points[outer[0], 0]), new[:, 1], new[:, 0]])
    caps = {name: number[cells] for name, cells in core.cells.items()}
    surfaces = {"skin": skin.triangles, "phalanx_surface": phalanx.triangles + count, **caps}
    return np.vstack([points, on_cut]), surfaces


def _draw(points: Floats, surfaces: dict[str, Integers], unit: float) -> dict[str, int]:
    """Draw the surfaces as they are; return the tags of the volumes between them."""
    tags = {name: gmsh.model.addDiscreteEntity(2) for name in surfaces}
    gmsh.model.mesh.addNodes(2, tags["skin"], np.arange(1, len(points) + 1), points.ravel() / unit)
    for name, triangles in surfaces.items():
        gmsh.model.mesh.addElementsByType(tags[name], TRIANGLE, [], (triangles + 1).ravel())
    gmsh.model.mesh.reclassifyNodes()
    cut = [tags["phalanx"]] if "phalanx" in tags else []
    outer, phalanx = [tags["skin"], tags["tissue"]], [tags["phalanx_surface"]]
    # A phalanx that does not reach the cut lies in a hole of the tissue.
    hulls = {"tissue": [outer + phalanx] if cut else [outer, phalanx], "phalanx": [phalanx + cut]}
    geometry = gmsh.model.geo
    volumes = {
        name: geometry.addVolume([geometry.addSurfaceLoop(loop) for loop in loops]) for name, loops in hulls.items()
    }
    geometry.synchronize()
    return volumes


def sweep_solid_skin(fingertip: FingertipNumbers, sizes: GradedMesh, phalanx: Floats) -> SolidSkin:
    """Divide the skin around the points (n, 3) [m] of the phalanx into rows and columns."""
    _check_contact_size(fingertip, sizes)
    levels = _levels(fingertip, sizes)
    outer = _outer_surface(fingertip, sizes, levels, phalanx)
    height, reach = _height(fingertip, outer.points), sizes.contact_reach
    # The fingerprint fades where the mesh coarsens.
    relief = relief_depth(fingertip, outer.points) * smooth_step((reach - height) / (0.2 * reach))
    rows = [_row(fingertip, outer.points, level, relief) for level in levels]
    return SolidSkin(np.stack(rows), outer.triangles, levels, height <= reach)


def check_skin_fits(fingertip: FingertipNumbers) -> None:
    """Refuse a skin so thick that its inner surface would cross itself."""
    thickness, skin = fingertip.layers.skin_thickness, skin_grid(fingertip)[:, ::2].reshape(-1, 3)
    depth = depth_below_skin(fingertip, below_skin(fingertip, skin, thickness))
    thinnest = int(depth.argmin())
    if depth[thinnest] < 0.98 * thickness:
        position = coordinates(skin[thinnest], 3)
        allowed = f"needs a smaller value: layers would cross below the skin at {position}, which bends too sharply"
        repair = "make the skin thinner or the finger rounder"
        raise InputError("layers.skin_thickness", f"got {millimetres(thickness)}", allowed, repair)


def graded_sizes(points: Floats, contact: Floats, contact_size: float, largest: Floats | float) -> Floats:
    """Return the sizes wanted at (n, 3) points [m]: the contact size near (m, 3) contact points, then growing."""
    distance, _ = nearest(contact, points)
    return np.minimum(contact_size + GROWTH * distance, np.maximum(largest, contact_size))


def _outer_surface(fingertip: FingertipNumbers, sizes: GradedMesh, levels: Floats, phalanx: Floats) -> Surface:
    grid = skin_grid(fingertip)
    skin, cut = grid.reshape(-1, 3), -fingertip.sagittal.pad_length
    # Rows go all round the finger, so triangles may only widen as far as the cells keep a good shape.
    widest = min(sizes.bulk_size, _LARGEST_ASPECT * float(np.diff(levels).min()))
    narrowest = min(widest, float(np.diff(levels).max()) / _LARGEST_ASPECT)
    tissue, _ = nearest(phalanx, below_skin(fingertip, skin, levels[-1]))
    largest = np.clip(TISSUE_SHARE * tissue, narrowest, widest)
    surface = _mesh_grid(fingertip, grid, True, sizes, largest)
    points, on_cut = onto_skin(fingertip, surface.points), np.abs(surface.points[:, 0] - cut) < 1e-9
    # Where they are on the proximal cut, at the same angles.
    points[on_cut] = skin_ring(fingertip, np.full(on_cut.sum(), cut), _angle(fingertip, points[on_cut]))
    return Surface(points, surface.triangles)


def mesh_phalanx(fingertip: FingertipNumbers, phalanx: PhalanxSurface, sizes: GradedMesh, skin: SolidSkin) -> Surface:
    """Mesh the surface of the phalanx."""
    tissue, _ = nearest(skin.points[-1], phalanx.points.reshape(-1, 3))
    largest = np.clip(TISSUE_SHARE * tissue, sizes.contact_size, sizes.bulk_size)
    return _mesh_grid(fingertip, phalanx.points, phalanx.open, sizes, largest)


def _mesh_grid(fingertip: FingertipNumbers, grid: Floats, is_open: bool, sizes: GradedMesh, largest: Floats) -> Surface:
    """Mesh a surface given by rows of points (rows, columns, 3) [m], finer near the contact, divided at x = 0."""
    skin = skin_grid(fingertip).reshape(-1, 3)
    contact = skin[_height(fingertip, skin) <= sizes.contact_reach]
    wanted = graded_sizes(grid.reshape(-1, 3), contact, sizes.contact_size, largest)
    return mesh_surface(grid, is_open, int(np.abs(grid[:, 0, 0]).argmin()), wanted.reshape(grid.shape[:2]))


def _angle(fingertip: FingertipNumbers, points: Floats) -> Floats:
    centre, height, width = skin_section(fingertip, points[:, 0])
    return np.arctan2(points[:, 2] / width, (centre - points[:, 1]) / height)


def _height(fingertip: FingertipNumbers, points: Floats) -> Floats:
    """Return the heights [m] of points above the lowest one when the finger stands at its angle."""
    return pose_points(fingertip, points)[:, 1] + fingertip.sagittal.half_height


def _levels(fingertip: FingertipNumbers, sizes: GradedMesh) -> Floats:
    """Return the depths of all rows: the borders of the layers, and rows about as high as the contact size between."""
    layers, nail = fingertip.layers, solid_shape(fingertip).nail
    stops = sorted({0.0, layers.epidermis_thickness, layers.skin_thickness} | ({nail.thickness} if nail else set()))
    thinnest, least = float(np.diff(stops).min()), sizes.contact_size / 5
    # Cells between borders that are closer would be flat.
    if thinnest < least:
        fault = f"has borders {millimetres(thinnest, 3)} apart (epidermis, skin, nail)"
        allowed = f"needs >= {millimetres(least, 3)}, a fifth of mesh.contact_size, or equal depths"
        raise InputError("layers", fault, allowed, "write a smaller contact_size or change the thickness")
    pieces = [
        np.linspace(a, b, max(1, round((b - a) / (1.25 * sizes.contact_size))) + 1)
        for a, b in itertools.pairwise(stops)
    ]
    return np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])


def _row(fingertip: FingertipNumbers, skin: Floats, level: float, relief: Floats) -> Floats:
    """Return the (columns, 3) nodes of one row, its rim on the proximal cut."""
    cut, blend = -fingertip.sagittal.pad_length, BLEND * fingertip.layers.skin_thickness
    # Points near the cut are shifted along the finger, so that those on the rim are on the cut at their depth.
    near = skin[:, 0] < min(cut + blend, 0.0)
    angle, x = _angle(fingertip, skin[near]), np.full(np.count_nonzero(near), cut)
    for _ in range(_SHIFTS):
        x = cut - level * inward_skin_normal(fingertip, skin_ring(fingertip, x, angle))[:, 0]
    weight = 1.0 - (skin[near, 0] - cut) / blend
    above = skin.copy()
    above[near] = skin_ring(fingertip, skin[near, 0] + weight * (x - cut), angle)
    share = max(0.0, 1.0 - level / fingertip.layers.epidermis_thickness)
    row = below_skin(fingertip, above, level + share * relief)
    row[skin[:, 0] == cut, 0] = cut
    row[skin[:, 2] == 0.0, 2] = 0.0
    return row


def tetrahedra(skin: SolidSkin) -> tuple[Integers, Integers]:
    """Cut the prisms between rows into tetrahedra: nodes (n, 4), numbered row by row, and the row (n,) of each."""
    columns = skin.points.shape[1]
    # Ordered corners give every side of a prism the same diagonal as its neighbour has there.
    a, b, c = np.sort(skin.triangles, axis=1).T
    d, e, f = (corner + columns for corner in (a, b, c))
    prism = np.concatenate([np.stack(nodes, axis=-1) for nodes in ((a, b, c, f), (a, b, e, f), (a, d, e, f))])
    rows = len(skin.levels) - 1
    return np.concatenate([prism + row * columns for row in range(rows)]), np.repeat(np.arange(rows), len(prism))


def _join(fingertip: FingertipNumbers, skin: SolidSkin, core: CoreMesh) -> skfem.MeshTet1:
    """Join skin and core along the dermis-tissue interface; the skin's nodes come first, row by row."""
    rows, columns = skin.points.shape[:2]
    above = (rows - 1) * columns
    points = np.vstack([skin.points[:-1].reshape(-1, 3), core.points])
    cells, layer = tetrahedra(skin)
    inside = [core.cells["tissue"] + above, core.cells["phalanx"] + above]
    nodes = np.vstack([cells, *inside])
    in_core = np.repeat([TISSUE, PHALANX], [len(part) for part in inside])
    middle = (skin.levels[:-1] + skin.levels[1:]) / 2
    region = np.where(middle < fingertip.layers.epidermis_thickness, EPIDERMIS, DERMIS)[layer]
    nail = solid_shape(fingertip).nail
    if nail is not None:
        # A prism is all nail or none of it, so the place is that of its columns on the outer surface.
        x, y, z = skin.points[0][skin.triangles].mean(axis=1).T
        on_nail = (nail.start < x) & (x < nail.end) & (np.abs(z) < nail.half_width) & (y > 0.0)
        triangle = np.tile(np.arange(len(skin.triangles)), len(cells) // len(skin.triangles))
        region = np.where((middle < nail.thickness)[layer] & on_nail[triangle], NAIL, region)
    region = np.concatenate([region, in_core])
    order = np.argsort(region, kind="stable")
    mesh = skfem.MeshTet1(np.ascontiguousarray(points.T), np.ascontiguousarray(nodes[order].astype(np.int32).T))
    return with_names(mesh, region[order], skin.fine)
