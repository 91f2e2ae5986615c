"""Build the 2D mesh of a fingertip section."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingerslip.errors import MeshError
from fingerslip.mesh.quality import check_quality
from fingerslip.mesh.sizes import GROWTH, ElementSizes
from fingerslip.specimens.fingertip.meshing.names import with_names
from fingerslip.specimens.fingertip.meshing.section.skin import SkinGrid, column_limits, row_counts, sweep_skin
from fingerslip.specimens.fingertip.numbers import REGIONS, FingertipNumbers
from fingerslip.specimens.fingertip.outline import arc_length_at_cut, outline_curve
from fingerslip.specimens.fingertip.phalanx_contour import phalanx_contour
from fingerslip.units import coordinates

if TYPE_CHECKING:
    from fingerslip.specimens.fingertip.meshing.section.core import CoreMesh

__all__ = ["mesh_section", "section_cells"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


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
    from fingerslip.specimens.fingertip.meshing.section.core import mesh_core

    core = mesh_core(contour, grid.points[-1], grid.closed, sizes)
    points, cells = _joined(grid, core, triangles=sizes.element != "Q4")
    region = np.repeat(np.arange(len(REGIONS)), [len(cells[name]) for name in REGIONS])
    fine = (grid.arc_length >= grid.contact[0]) & (grid.arc_length <= grid.contact[1])
    mesh = with_names(_container(points, cells, sizes.element), region, fine)
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
