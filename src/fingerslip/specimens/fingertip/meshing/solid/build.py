"""Build the mesh of a fingertip in 3D."""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass

import gmsh
import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingerslip.errors import InputError, MeshError
from fingerslip.mesh.gmsh_session import gmsh_session, length_unit
from fingerslip.mesh.patches import Triangulation, mesh_surface
from fingerslip.mesh.quality import check_quality
from fingerslip.mesh.sizes import GROWTH, ElementSizes
from fingerslip.specimens.fingertip.meshing.names import DERMIS, EPIDERMIS, NAIL, PHALANX, TISSUE, with_names
from fingerslip.specimens.fingertip.meshing.section.build import CoreMesh, mesh_ring
from fingerslip.specimens.fingertip.numbers import FingertipNumbers
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

__all__ = [
    "SolidSkin",
    "check_skin_fits",
    "contact_points",
    "graded_sizes",
    "inner_surface",
    "mesh_phalanx",
    "mesh_solid",
    "mesh_solid_core",
    "solid_cells",
    "sweep_solid_skin",
    "tetrahedra",
]


Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_TRIANGLE, _TETRAHEDRON = 2, 4
_HXT = 10


@dataclass(frozen=True)
class _Hull:
    """Closed surfaces of triangles that share nodes: skin, phalanx, and their caps on the proximal cut."""

    points: Floats
    skin: Integers
    phalanx: Integers
    caps: dict[str, Integers]


def mesh_solid_core(skin: Triangulation, phalanx: Triangulation, largest: float) -> CoreMesh:
    """Mesh what lies inside the skin.

    Units: largest [m].
    """
    hull, unit = _hull(skin, phalanx, largest), length_unit(largest)
    with gmsh_session():
        volumes = _draw(hull, unit)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1)
        gmsh.option.setNumber("Mesh.MeshSizeMax", largest / unit)
        gmsh.option.setNumber("Mesh.Algorithm3D", _HXT)
        try:
            gmsh.model.mesh.generate(3)
            gmsh.model.mesh.optimize("")
        except Exception as error:
            raise MeshError("tissue and phalanx", f"Gmsh says '{error}'", "needs one that Gmsh can mesh") from error
        return _read_core(hull, volumes, unit)


def rim(surface: Triangulation) -> Integers:
    """Return the nodes of the rim of a surface in turn, the surface on their left; none where it is closed."""
    edges = np.concatenate([surface.triangles[:, [0, 1]], surface.triangles[:, [1, 2]], surface.triangles[:, [2, 0]]])
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    outer = edges[first[count == 1]]
    if len(outer) == 0:
        return np.empty(0, dtype=np.int64)
    following = dict(outer.tolist())
    ring = [int(outer[0, 0])]
    while following[ring[-1]] != ring[0]:
        ring.append(following[ring[-1]])
    return np.array(ring)


def _hull(skin: Triangulation, phalanx: Triangulation, largest: float) -> _Hull:
    """Join skin and phalanx by flat caps on the proximal cut."""
    count = len(skin.points)
    points = np.vstack([skin.points, phalanx.points])
    outer, inner = rim(skin), rim(phalanx)
    cut = skin.points[outer[0], 0]
    core = mesh_ring(_flat(skin.points[outer]), _flat(phalanx.points[inner]) if len(inner) else None, largest)
    available = np.concatenate([outer, inner + count]) if len(inner) else outer
    distance, nearest = cKDTree(_flat(points[available])).query(core.points)
    on_ring = distance < 1e-9
    number = np.where(on_ring, available[nearest], 0)
    number[~on_ring] = len(points) + np.arange(np.count_nonzero(~on_ring))
    new = core.points[~on_ring]
    points = np.vstack([points, np.column_stack([np.full(len(new), cut), new[:, 1], new[:, 0]])])
    return _Hull(points, skin.triangles, phalanx.triangles + count, {n: number[c] for n, c in core.cells.items()})


def _flat(points: Floats) -> Floats:
    """Return the coordinates z and y of points on the proximal cut."""
    return points[:, [2, 1]]


def _draw(hull: _Hull, unit: float) -> dict[str, int]:
    """Draw the surfaces as they are; return the tags of the volumes between them."""
    surfaces = {"skin": hull.skin, "phalanx_surface": hull.phalanx, **hull.caps}
    tags = {name: gmsh.model.addDiscreteEntity(2) for name in surfaces}
    gmsh.model.mesh.addNodes(2, tags["skin"], np.arange(1, len(hull.points) + 1), hull.points.ravel() / unit)
    for name, triangles in surfaces.items():
        gmsh.model.mesh.addElementsByType(tags[name], _TRIANGLE, [], (triangles + 1).ravel())
    gmsh.model.mesh.reclassifyNodes()
    cut = [tags["phalanx"]] if "phalanx" in tags else []
    outer, phalanx = [tags["skin"], tags["tissue"]], [tags["phalanx_surface"]]
    volumes = {
        # A phalanx that does not reach the cut lies in a hole of the tissue.
        "tissue": _volume([outer + phalanx] if cut else [outer, phalanx]),
        "phalanx": _volume([phalanx + cut]),
    }
    gmsh.model.geo.synchronize()
    return volumes


def _volume(hulls: list[list[int]]) -> int:
    volume: int = gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop(hull) for hull in hulls])
    return volume


def _read_core(hull: _Hull, volumes: dict[str, int], unit: float) -> CoreMesh:
    """Read the cells out of Gmsh; nodes of the hull keep their numbers."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    cells = {name: gmsh.model.mesh.getElementsByType(_TETRAHEDRON, volume)[1] for name, volume in volumes.items()}
    used = np.unique(np.concatenate([np.arange(1, len(hull.points) + 1), *cells.values()]))
    order = np.argsort(tags)
    points = coordinates.reshape(-1, 3)[order[np.searchsorted(tags, used, sorter=order)]] * unit
    points[: len(hull.points)] = hull.points
    numbered = {name: np.searchsorted(used, nodes).reshape(-1, 4) for name, nodes in cells.items()}
    return CoreMesh(points, numbered)


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
        position = coordinates(skin[thinnest], 3)
        fault = f"got {millimetres(thickness)}"
        allowed = f"needs a smaller value: layers would cross below the skin at {position}, which bends too sharply"
        raise InputError("layers.skin_thickness", fault, allowed, "make the skin thinner or the finger rounder")


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
    height: Floats = pose_points(fingertip, points)[:, 1] + fingertip.sagittal.half_height
    return height


def _inside(height: Floats, reach: float) -> Floats:
    """Return the share of the fingerprint: 1 in the contact, smoothly to 0 where the mesh coarsens."""
    share = np.clip((reach - height) / (0.2 * reach), 0.0, 1.0)
    smooth: Floats = share**2 * (3.0 - 2.0 * share)
    return smooth


def _check_relief(fingertip: FingertipNumbers, sizes: ElementSizes) -> None:
    fingerprint = fingertip.fingerprint
    if fingerprint.enabled and sizes.contact_size > fingerprint.pitch / 4:
        fault, allowed = f"got {millimetres(sizes.contact_size)}", f"needs <= {millimetres(fingerprint.pitch / 4)}"
        repair = "write a smaller one or switch the fingerprint off"
        raise InputError("mesh.contact_size", fault, f"{allowed}, a quarter of fingerprint.pitch", repair)


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
        fault = f"has borders {millimetres(thinnest, 3)} apart (epidermis, skin, nail)"
        allowed = f"needs >= {millimetres(least, 3)}, a fifth of mesh.contact_size, or equal depths"
        raise InputError("layers", fault, allowed, "write a smaller contact_size or change the thickness")


def _row(fingertip: FingertipNumbers, skin: Floats, level: float, relief: Floats) -> Floats:
    """Return the (columns, 3) nodes of one row, its rim on the proximal cut."""
    cut = -fingertip.sagittal.pad_length
    rim = skin[:, 0] == cut
    share = max(0.0, 1.0 - level / fingertip.layers.epidermis_thickness)
    row = below_skin(fingertip, _shift(fingertip, skin, level), level + share * relief)
    row[rim, 0] = cut
    row[skin[:, 2] == 0.0, 2] = 0.0
    return row


def _shift(fingertip: FingertipNumbers, skin: Floats, level: float) -> Floats:
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


def mesh_phalanx(
    fingertip: FingertipNumbers, phalanx: PhalanxSurface, sizes: ElementSizes, skin: SolidSkin
) -> Triangulation:
    """Mesh the surface of the phalanx."""
    points = phalanx.points.reshape(-1, 3)
    tissue, _ = cKDTree(skin.points[-1]).query(points)
    largest = np.clip(_TISSUE_SHARE * tissue, sizes.contact_size, sizes.bulk_size)
    wanted = graded_sizes(points, contact_points(fingertip, sizes), sizes.contact_size, largest)
    origin = int(np.abs(phalanx.points[:, 0, 0]).argmin())
    return mesh_surface(phalanx.points, phalanx.open, origin, wanted.reshape(phalanx.points.shape[:2]))


_SLICES = 400


def mesh_solid(fingertip: FingertipNumbers, sizes: ElementSizes) -> skfem.Mesh3D:
    """Build the mesh of a fingertip in 3D from a set of sizes; regions and boundaries are those of `build_solid`."""
    # Gmsh is loaded here and nowhere else: a mesh file of one's own does without it.

    check_skin_fits(fingertip)
    phalanx = phalanx_surface(fingertip)
    skin = sweep_solid_skin(fingertip, sizes, phalanx.points.reshape(-1, 3))
    core = mesh_solid_core(inner_surface(skin), mesh_phalanx(fingertip, phalanx, sizes, skin), sizes.bulk_size)
    mesh = _join(fingertip, skin, core)
    mesh = dataclasses.replace(mesh, doflocs=np.ascontiguousarray(pose_points(fingertip, mesh.p.T).T))
    check_quality(mesh)
    return _quadratic(mesh) if sizes.element == "T10" else mesh


def solid_cells(fingertip: FingertipNumbers, sizes: ElementSizes) -> float:
    """Return about how many tetrahedra a fine mesh will have, without making it.

    As many regular ones of the bulk's size as fill the finger, whose sections are ellipses; coarse meshes have more,
    because layers and contact are finer.
    """
    outline = fingertip.sagittal
    x = np.linspace(-outline.pad_length, outline.tip_length, _SLICES)
    _, height, width = skin_section(fingertip, x)
    volume = float(np.trapezoid(np.pi * height * width, x))
    return 6.0 * float(np.sqrt(2.0)) * volume / sizes.bulk_size**3


def _quadratic(mesh: skfem.MeshTet1) -> skfem.MeshTet2:
    """Return the mesh with a node in the middle of every edge, and its names."""
    finer = skfem.MeshTet2.from_mesh(mesh)
    return dataclasses.replace(finer, _subdomains=mesh.subdomains, _boundaries=mesh.boundaries)


def _join(fingertip: FingertipNumbers, skin: SolidSkin, core: CoreMesh) -> skfem.MeshTet1:
    """Join skin and core along the dermis-tissue interface; the skin's nodes come first, row by row."""
    rows, columns = skin.points.shape[:2]
    above = (rows - 1) * columns
    points = np.vstack([skin.points[:-1].reshape(-1, 3), core.points])
    cells, layer = tetrahedra(skin)
    inside = [core.cells["tissue"] + above, core.cells["phalanx"] + above]
    nodes = np.vstack([cells, *inside])
    in_core = np.repeat([TISSUE, PHALANX], [len(part) for part in inside])
    region = np.concatenate([_skin_regions(fingertip, skin, cells, layer), in_core])
    order = np.argsort(region, kind="stable")
    mesh = skfem.MeshTet1(np.ascontiguousarray(points.T), np.ascontiguousarray(nodes[order].astype(np.int32).T))
    return with_names(mesh, region[order], skin.fine)


def _skin_regions(fingertip: FingertipNumbers, skin: SolidSkin, cells: Integers, layer: Integers) -> Integers:
    """Return the region of each tetrahedron of the skin, by its row and, for the nail, by its place."""
    middle = (skin.levels[:-1] + skin.levels[1:]) / 2
    region = np.where(middle < fingertip.layers.epidermis_thickness, EPIDERMIS, DERMIS)[layer]
    nail = solid_shape(fingertip).nail
    if nail is not None:
        # A prism is all nail or none of it, so the place is that of its columns on the outer surface.
        x, y, z = skin.points[0][skin.triangles].mean(axis=1).T
        on_nail = (nail.start < x) & (x < nail.end) & (np.abs(z) < nail.half_width) & (y > 0.0)
        triangle = np.tile(np.arange(len(skin.triangles)), len(cells) // len(skin.triangles))
        region = np.where((middle < nail.thickness)[layer] & on_nail[triangle], NAIL, region)
    return region
