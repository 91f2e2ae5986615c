"""Build the 2D mesh of a fingertip section."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Literal

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingerslip.errors import MeshError
from fingerslip.mesh.quality import check_quality
from fingerslip.mesh.sizes import MeshSizes
from fingerslip.specimens.fingertip import REGIONS, Fingertip, phalanx_contour
from fingerslip.specimens.fingertip.meshing.section.skin import SkinGrid, sweep_skin

if TYPE_CHECKING:
    from fingerslip.specimens.fingertip.meshing.section.core import CoreMesh

__all__ = ["build_section", "mesh_section"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_DEFAULT = MeshSizes()
_PHALANX = REGIONS.index("phalanx")


def build_section(
    fingertip: Fingertip,
    *,
    contact_size: float = _DEFAULT.contact_size,
    bulk_size: float = _DEFAULT.bulk_size,
    contact_reach: float = _DEFAULT.contact_reach,
    element: Literal["Q4", "T3", "T6"] = _DEFAULT.element,
) -> skfem.Mesh2D:
    """Build the mesh of a section, with named regions and boundaries.

    Parameters
    ----------
    fingertip : Fingertip
        What to mesh.
    contact_size : float
        Element size along the skin that can touch [m].
    bulk_size : float
        Largest element size, far from the contact [m].
    contact_reach : float
        Height above the lowest point up to which the skin is meshed at `contact_size` [m].
    element : {'Q4', 'T3', 'T6'}
        Bilinear quadrilateral, linear or quadratic triangle.

    Returns
    -------
    skfem.MeshQuad1, skfem.MeshTri1 or skfem.MeshTri2
        Mesh [m] with the regions `epidermis`, `dermis`, `tissue` and `phalanx` and the boundaries `skin` (outer
        surface), `pad` (its part at the contact size), `epidermis_dermis`, `dermis_tissue`, `phalanx_surface` (with
        the tissue) and its parts `phalanx_palmar` and `phalanx_dorsal`; in a sagittal section also `base` (proximal
        cut) and, where the phalanx reaches it, its part `phalanx_base`.

    Raises
    ------
    InputError
        Where sizes and fingertip do not fit together.
    MeshError
        Where no mesh of good quality comes out.
    """
    return mesh_section(fingertip, MeshSizes(contact_size, bulk_size, contact_reach, element))


def mesh_section(fingertip: Fingertip, sizes: MeshSizes) -> skfem.Mesh2D:
    """Build the mesh of a section from a set of sizes; see :func:`build_section`."""
    contour = phalanx_contour(fingertip)
    grid = sweep_skin(fingertip, sizes, contour)
    # Gmsh is loaded here and nowhere else: a mesh file of one's own does without it.
    from fingerslip.specimens.fingertip.meshing.section.core import mesh_core

    core = mesh_core(contour, grid.points[-1], grid.closed, sizes)
    points, cells = _joined(grid, core, triangles=sizes.element != "Q4")
    mesh = _with_names(_container(points, cells, sizes.element), cells, grid)
    check_quality(mesh)
    return mesh


def _joined(grid: SkinGrid, core: CoreMesh, triangles: bool) -> tuple[Floats, dict[str, Integers]]:
    """Join skin and core along the dermis-tissue interface; the skin's nodes come first."""
    skin = grid.points.reshape(-1, 2)
    rows, columns = grid.points.shape[:2]
    number, border = _core_numbers(core, grid)
    cells = _skin_cells(rows, columns, grid)
    if triangles:
        cells = {name: _halved(skin, nodes) for name, nodes in cells.items()}
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


def _halved(points: Floats, cells: Integers) -> Integers:
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
        place = interface[int(distance.argmax())] * 1e3
        raise MeshError("dermis_tissue", f"no tissue node at x = {place[0]:.4g} mm, y = {place[1]:.4g} mm", "needs one")
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


def _with_names(mesh: skfem.Mesh2D, cells: dict[str, Integers], grid: SkinGrid) -> skfem.Mesh2D:
    ends = np.cumsum([0, *(len(cells[name]) for name in REGIONS)])
    regions = {name: np.arange(a, b, dtype=np.int32) for name, a, b in zip(REGIONS, ends, ends[1:], strict=False)}
    region = np.repeat(np.arange(4), np.diff(ends))
    boundaries = _interfaces(mesh, region) | _outside(mesh, region, grid)
    boundaries |= _faces_of_phalanx(mesh, region, boundaries["phalanx_surface"])
    kept = {name: facets for name, facets in boundaries.items() if len(facets)}
    return dataclasses.replace(mesh, _subdomains=regions, _boundaries=kept)


def _interfaces(mesh: skfem.Mesh2D, region: Integers) -> dict[str, Integers]:
    """Return the facets between two regions, in no orientation."""
    first, second = mesh.f2t
    inside = second >= 0
    pair = np.where(inside, np.sort([region[first], region[second]], axis=0), -1)
    names = {"epidermis_dermis": (0, 1), "dermis_tissue": (1, 2), "phalanx_surface": (2, 3)}
    return {name: _facets((pair[0] == a) & (pair[1] == b)) for name, (a, b) in names.items()}


def _faces_of_phalanx(mesh: skfem.Mesh2D, region: Integers, surface: Integers) -> dict[str, Integers]:
    """Return the facets of the phalanx surface that face down and up within 60 degrees."""
    first, second = mesh.f2t[:, surface]
    centre = mesh.p[:, mesh.t].mean(axis=1)
    bone, tissue = np.where(region[first] == _PHALANX, (first, second), (second, first))
    start, end = mesh.p[:, mesh.facets[:, surface]].transpose(1, 0, 2)
    normal = np.array([[0.0, 1.0], [-1.0, 0.0]]) @ (end - start) / np.linalg.norm(end - start, axis=0)
    upward = normal[1] * np.sign(np.sum(normal * (centre[:, tissue] - centre[:, bone]), axis=0))
    return {"phalanx_palmar": surface[upward < -0.5], "phalanx_dorsal": surface[upward > 0.5]}


def _outside(mesh: skfem.Mesh2D, region: Integers, grid: SkinGrid) -> dict[str, Integers]:
    """Return the facets on the outside: skin, its finely meshed part, and the proximal cut."""
    outer = mesh.f2t[1] < 0
    on_skin = np.flatnonzero(np.isin(mesh.facets, np.arange(len(grid.arc_length))).all(axis=0) & outer)
    skin = np.isin(np.arange(mesh.facets.shape[1]), on_skin)
    fine = (grid.arc_length >= grid.contact[0]) & (grid.arc_length <= grid.contact[1])
    cut = outer & ~skin
    return {
        "skin": _facets(skin),
        "pad": _facets(skin & np.isin(mesh.facets, np.flatnonzero(fine)).all(axis=0)),
        "base": _facets(cut),
        "phalanx_base": _facets(cut & (region[mesh.f2t[0]] == _PHALANX)),
    }


def _facets(chosen: NDArray[np.bool_]) -> Integers:
    return np.flatnonzero(chosen).astype(np.int32)
