"""Mesh files in and out, with their named regions and boundaries."""

from __future__ import annotations

import logging
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import skfem
from numpy.typing import NDArray
from skfem.io.meshio import from_meshio, to_meshio

from fingerslip.arrays import Flags, Floats, Integers
from fingerslip.errors import MeshError, shorten
from fingerslip.mesh.decks.deck import LABELS
from fingerslip.mesh.decks.febio import chosen_unit
from fingerslip.mesh.formats import read_file, write_file
from fingerslip.mesh.mixed import NARROWER, is_degenerate, join_kinds, take_one_kind
from fingerslip.mesh.quality import check_folds, turned_cells, turns
from fingerslip.units import LengthUnit, coordinates, metres


@dataclass(frozen=True)
class _Cell:
    """A type of cell in files: its mesh, its corners, its sides, and the order of nodes that turns it round."""

    mesh: type[skfem.Mesh]
    corners: int
    dim: int
    sides: tuple[str, ...]
    side_corners: int
    turned: tuple[int, ...]


_LINES, _TRIANGLES, _QUADS = ("line", "line3"), ("triangle", "triangle6"), ("quad",)
_CELLS = {
    "quad": _Cell(skfem.MeshQuad1, 4, 2, _LINES, 2, (1, 0, 3, 2)),
    "triangle": _Cell(skfem.MeshTri1, 3, 2, _LINES, 2, (0, 2, 1)),
    "triangle6": _Cell(skfem.MeshTri2, 3, 2, _LINES, 2, (0, 2, 1, 5, 4, 3)),
    "tetra": _Cell(skfem.MeshTet1, 4, 3, _TRIANGLES, 3, (1, 0, 2, 3)),
    "tetra10": _Cell(skfem.MeshTet2, 4, 3, _TRIANGLES, 3, (1, 0, 2, 3, 4, 6, 5, 8, 7, 9)),
    "hexahedron": _Cell(skfem.MeshHex1, 8, 3, _QUADS, 4, (4, 5, 6, 7, 0, 1, 2, 3)),
}
_SIDES = {2: "lines", 3: "triangles", 4: "quadrilaterals"}
_QUADRATIC, _TETRAHEDRA = {"triangle6", "tetra10"}, {"tetra", "tetra10"}
# The corners of a hexahedron in the order of scikit-fem.
_HEXAHEDRON = [0, 4, 3, 1, 7, 5, 2, 6]
# The corners at the other ends of the three edges of each corner of a hexahedron, in a right-handed order.
_BESIDE = np.array([[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]])
_FLAT = 1e-6

_logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Raw:
    """Cells of one kind, with the groups that a file has them in."""

    path: Path
    kind: str
    points: Floats
    cells: Integers
    regions: dict[str, Integers] = field(default_factory=dict)
    facets: dict[str, Integers] = field(default_factory=dict)
    labels: Sequence[str] = ()  # of the cells in their deck

    @property
    def cell(self) -> _Cell:
        """The type of its cells."""
        return _CELLS[self.kind]


def read_mesh(path: str | Path, unit: LengthUnit | None = None) -> skfem.Mesh:
    """Read a mesh in 2D or in 3D with its named groups: a deck of Abaqus or FEBio, or any format that meshio reads.

    Named groups of cells become regions, named groups of lines (in 3D: triangles or quadrilaterals) become
    boundaries, inside the mesh too. In a Gmsh file these are its physical groups, in a deck sets of elements, and
    surfaces and sets of nodes; what else a deck has is listed in the log. Plane cells drawn clockwise and hexahedra
    inside out are turned round where the whole region is.

    Parameters
    ----------
    path : str or Path
        The file.
    unit : {'m', 'cm', 'mm', 'um'}, optional
        Unit of its lengths, where the file does not say it, as FEBio's may; without it metres.

    Returns
    -------
    skfem.MeshQuad1, skfem.MeshTri1, skfem.MeshTri2, skfem.MeshTet1, skfem.MeshTet2 or skfem.MeshHex1
        The mesh [m] with its `subdomains` and `boundaries`. Triangles among quadrilaterals and prisms among hexahedra
        are such cells with two corners in one node; quadratic cells of these are taken by their corners.

    Raises
    ------
    MeshError
        Where the file is missing, unreadable, of unknown cells or of kinds that do not go together, without named
        groups, or has an inverted or flat cell, or one that folds over its neighbours.
    InputError
        Where the unit is unknown, or is not the one that the file says.

    Examples
    --------
    A mesh drawn in millimetres:

    >>> import tempfile
    >>> import skfem
    >>> import fingerslip as fs
    >>> square = skfem.MeshQuad().with_subdomains({"pulp": lambda x: x[0] > -1.0})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     fs.write_mesh(square, f"{folder}/pad.vtu")
    ...     mesh = fs.read_mesh(f"{folder}/pad.vtu", unit="mm")
    >>> list(mesh.subdomains), float(mesh.p.max())
    (['pulp'], 0.001)
    """
    mesh, left_out = read_mesh_and_rest(Path(path), unit)
    if left_out:
        _logger.info("%s: without %s", path, "; ".join(left_out))
    return mesh


def read_mesh_and_rest(file: Path, unit: LengthUnit | None) -> tuple[skfem.Mesh, tuple[str, ...]]:
    """Read a mesh [m] with its named groups, and in words what of the file is left out."""
    deck = read_file(file, "needs a mesh that meshio reads, or a deck of Abaqus or FEBio")
    data, left_out = deck.data, deck.left_out
    data.points = metres(chosen_unit(file, deck.unit, unit)) * np.asarray(data.points, dtype=float)
    if any(key.startswith("skfem:") for key in data.cell_data):
        join_kinds(data)
    else:
        left_out = (*left_out, *take_one_kind(data))
    return _mesh_of(file, data), left_out


def _mesh_of(file: Path, data: meshio.Mesh) -> skfem.Mesh:
    """Return the cells of a file as a mesh with its named groups."""
    kind = _kind(file, data)
    points = _points(file, _CELLS[kind].dim, data)
    if any(key.startswith("skfem:") for key in data.cell_data):
        _turned_round(_Raw(file, kind, points, data.cells_dict[kind]))
        try:
            mesh = from_meshio(data)
        except (IndexError, KeyError, TypeError, ValueError) as error:
            fault = f"is damaged: its groups do not fit its cells ({shorten(str(error))})"
            raise MeshError(str(file), fault, "needs a file as write_mesh writes it", "write it again") from None
        # Reading back sets orientations of inner facets at random; boundaries here have none.
        boundaries = {name: np.array(facets, dtype=np.int32) for name, facets in (mesh.boundaries or {}).items()}
        check_folds(mesh, turned_cells(mesh), str(file))
        return mesh.with_boundaries(boundaries)
    raw = _raw(file, kind, points, data)
    cells = _orient(raw)
    if kind == "hexahedron":
        cells = cells[:, _HEXAHEDRON]
    mesh = raw.cell.mesh(np.ascontiguousarray(raw.points.T), np.ascontiguousarray(cells.T))
    mesh = mesh.with_subdomains(raw.regions).with_boundaries(_boundaries(raw, mesh))
    check_folds(mesh, turned_cells(mesh), str(file), raw.labels)
    return mesh


def write_mesh(mesh: skfem.Mesh, path: str | Path) -> None:
    """Write a mesh with its named groups, in the format that the file's suffix names.

    A ``.msh`` file is of version 2.2, with regions and boundaries as physical groups that Gmsh shows; other formats
    hold them as cell data that :func:`read_mesh` and scikit-fem read back. For ParaView these have the number of the
    ``region``, -1 for none, and for each boundary a field such as ``boundary_skin`` that is 1 on its points.

    Parameters
    ----------
    mesh : skfem.MeshQuad1, skfem.MeshTri1, skfem.MeshTri2, skfem.MeshTet1, skfem.MeshTet2 or skfem.MeshHex1
        The mesh.
    path : str or Path
        The file, such as ``finger.msh``, ``finger.vtu`` or ``finger.xdmf``; for an example see :func:`read_mesh`.

    Raises
    ------
    MeshError
        Where the suffix is unknown, the folder does not exist, two regions share a cell of a ``.msh`` file, or a name
        has signs that the format does not keep.
    """
    file = Path(path)
    # Formats put names between quotes, scikit-fem between colons.
    unkept = re.compile(r'["\x00-\x1f]|\\(\\|$)' if file.suffix == ".msh" else r'["<>&:\x00-\x1f]')
    for name in [*(mesh.subdomains or {}), *(mesh.boundaries or {})]:
        sign = unkept.search(name)
        if sign:
            allowed = f"needs names without {sign[0]!r} in {file.suffix}"
            raise MeshError(str(file), f"has the name {shorten(repr(name))}", allowed, "rename it")
    data = _narrow(_physical(file, mesh) if file.suffix == ".msh" else _with_fields(mesh))
    if mesh.dim() == 2:
        data.points = np.column_stack([data.points[:, :2], np.zeros(len(data.points))])
    write_file(file, data, ".msh, .vtu, .xdmf")


def _with_fields(mesh: skfem.Mesh) -> meshio.Mesh:
    """Return a mesh as scikit-fem writes it, with fields of regions and boundaries that other programs can show."""
    data, regions = to_meshio(mesh), np.full(mesh.nelements, -1, dtype=np.int32)
    for number, cells in enumerate((mesh.subdomains or {}).values()):
        regions[cells] = number
    data.cell_data["region"] = [regions]
    for name, facets in (mesh.boundaries or {}).items():
        on_boundary = np.zeros(len(data.points), dtype=np.int32)
        on_boundary[mesh.dofs.get_facet_dofs(np.asarray(facets)).all()] = 1
        data.point_data[f"boundary_{name}"] = on_boundary
    return data


def _raw(file: Path, kind: str, points: Floats, data: meshio.Mesh) -> _Raw:
    cell, groups = _CELLS[kind], _groups(data)
    # Cells that a file repeats because they are in two groups are there once.
    cells = np.vstack([block.data for block in data.cells if block.type == kind])
    corners = np.sort(cells[:, : cell.corners], axis=1)
    _, first, same = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    labels = data.get_cell_data(LABELS, kind)[first[order]].tolist() if LABELS in data.cell_data else []
    cells, same = cells[first[order]], np.argsort(order)[same.ravel()]
    regions = {name: np.unique(same[_members(data, {kind}, blocks)]) for name, blocks in groups.items()}
    sides = [block.data[:, : cell.side_corners] for block in data.cells if block.type in cell.sides]
    nodes = np.vstack([np.empty((0, cell.side_corners), dtype=int), *sides])
    facets = {name: nodes[_members(data, set(cell.sides), blocks)] for name, blocks in groups.items()}
    regions, facets = ({n: g for n, g in table.items() if len(g)} for table in (regions, facets))
    if not regions and not facets:
        allowed = f"needs named groups of cells (regions) and of {_SIDES[cell.side_corners]} (boundaries)"
        raise MeshError(str(file), "has no named groups", allowed, "name them, in Gmsh as physical groups")
    # Nodes that no cell uses, such as Gmsh's construction points, are dropped.
    used = np.unique(cells)
    new = np.full(len(points), -1)
    new[used] = np.arange(len(used))
    facets = {name: new[members] for name, members in facets.items()}
    return _Raw(file, kind, points[used], new[cells], regions, facets, labels)


def _kind(file: Path, data: meshio.Mesh) -> str:
    highest = max((block.dim for block in data.cells if len(block.data)), default=0)
    kinds = {str(block.type) for block in data.cells if block.dim == max(highest, 2) and len(block.data)}
    if len(kinds) != 1 or not kinds <= set(_CELLS):
        fault = f"has cells of type {', '.join(sorted(kinds))}" if kinds else "has no cells"
        allowed = f"needs cells of one of the types {', '.join(_CELLS)}, and triangles among quadrilaterals, or prisms"
        raise MeshError(str(file), fault, f"{allowed} among hexahedra", "mesh the body again with these")
    return kinds.pop()


def _points(file: Path, dim: int, data: meshio.Mesh) -> Floats:
    points: Floats = np.asarray(data.points, dtype=float)
    if dim == 3:
        return points
    off = np.abs(points[:, 2:]).max(axis=1, initial=0.0)
    extent = np.ptp(points[:, :2], axis=0).max()
    if off.max() > 1e-9 * extent:
        worst = int(off.argmax())
        raise MeshError(str(file), f"node {worst} is at {coordinates(points[worst])}", "needs z = 0 at every node")
    return points[:, :2]


def _groups(data: meshio.Mesh) -> dict[str, list[Integers]]:
    """Return for each named group its cells in every block."""
    empty = np.empty(0, dtype=int)
    named = {name: sets for name, sets in data.cell_sets.items() if not name.startswith("gmsh:")}
    groups = {name: [empty if s is None else np.asarray(s, dtype=int) for s in sets] for name, sets in named.items()}
    if groups or "gmsh:physical" not in data.cell_data:
        return groups
    blocks = list(zip(data.cell_data["gmsh:physical"], data.cells, strict=True))
    return {
        name: [np.flatnonzero(tags == number) if block.dim == dim else empty for tags, block in blocks]
        for name, (number, dim) in data.field_data.items()
    }


def _members(data: meshio.Mesh, kinds: set[str], blocks: list[Integers]) -> Integers:
    """Number a group's cells throughout all blocks of the given kinds."""
    result, start = [np.empty(0, dtype=int)], 0
    for block, members in zip(data.cells, blocks, strict=True):
        if block.type in kinds:
            result.append(members + start)
            start += len(block.data)
    return np.concatenate(result)


def _turned_round(raw: _Raw) -> Flags:
    """Return which cells (m,) are clockwise or of negative volume; refuse one that is flat or turns both ways.

    Its corners tell, by their areas relative to its size squared; in 3D by the volumes between the edges of each,
    relative to the longest of them cubed.
    """
    corners = raw.points[raw.cells[:, : raw.cell.corners]]
    if raw.cell.dim == 3:
        beside = np.array([[1, 2, 3]]) if raw.kind in _TETRAHEDRA else _BESIDE
        edges = corners[:, beside] - corners[:, : len(beside), None]
        longest = np.linalg.norm(edges, axis=3).max(axis=(1, 2))
        relative = np.linalg.det(edges) / np.maximum(longest, 1e-300)[:, None] ** 3
    else:
        ahead, _, cross = turns(corners.transpose(2, 1, 0))
        size = np.sum(ahead**2, axis=0).max(axis=0)
        relative = (cross / np.where(size > 0, size, 1.0)).T
    # Nothing turns in a corner that is one with another.
    rows = np.flatnonzero(is_degenerate(raw.cells) & (relative.shape[1] > 1) & (raw.kind in NARROWER))
    for corner in (2, 3, 6, 7)[: relative.shape[1] // 2]:
        relative[rows, corner] = relative[rows, 0]
    wrong = np.flatnonzero((relative.min(axis=1) <= _FLAT) & (relative.max(axis=1) >= -_FLAT))
    if len(wrong):
        raise _bad_cell(raw, int(wrong[0]), "inverted or flat")
    return np.asarray(relative.min(axis=1) < 0.0)


def _orient(raw: _Raw) -> Integers:
    """Return all cells counter-clockwise, hexahedra with positive volume.

    A region of cells that are turned throughout is turned round, a mixture is an error.
    """
    clockwise = _turned_round(raw)
    if raw.kind in _TETRAHEDRA:  # the sign of tetrahedra says nothing here: scikit-fem sorts their corners
        return raw.cells
    covered = np.zeros(len(raw.cells), dtype=bool)
    covered[np.concatenate([np.empty(0, dtype=int), *raw.regions.values()])] = True
    for cells in (*raw.regions.values(), np.flatnonzero(~covered)):
        turned = clockwise[cells]
        if turned.any() and not turned.all():
            fewer = cells[turned] if turned.mean() <= 0.5 else cells[~turned]
            raise _bad_cell(raw, int(fewer[0]), "inverted against its region")
    nodes = raw.cells.copy()
    nodes[clockwise] = nodes[clockwise][:, raw.cell.turned]
    return nodes


def _bad_cell(raw: _Raw, cell: int, what: str) -> MeshError:
    centre = raw.points[raw.cells[cell, : raw.cell.corners]].mean(axis=0)
    needed = "volume" if raw.cell.dim == 3 else "area"
    name = f"element {raw.labels[cell]}" if raw.labels else f"cell {cell}"
    fault = f"{name} at {coordinates(centre)} is {what}"
    repair = "list its nodes in the order of its kind of element, or build the mesh again"
    return MeshError(str(raw.path), fault, f"needs cells with positive {needed}", repair)


def _boundaries(raw: _Raw, mesh: skfem.Mesh) -> dict[str, NDArray[np.int32]]:
    """Return the facets of each boundary, which the file has as (n, 2) nodes in 2D, (n, 3) or (n, 4) nodes in 3D."""
    # scikit-fem puts middle nodes last.
    corner_nodes = np.unique(raw.cells[:, : raw.cell.corners])
    number = np.full(len(raw.points), -1)
    number[corner_nodes] = np.arange(len(corner_nodes)) if raw.kind in _QUADRATIC else corner_nodes
    wanted = [np.sort(number[nodes], axis=1) for nodes in raw.facets.values()]
    # Sides of the same nodes get the same key.
    keys = np.unique(np.vstack([np.sort(mesh.facets, axis=0).T, *wanted]), axis=0, return_inverse=True)[1].ravel()
    ends = np.cumsum([mesh.facets.shape[1], *map(len, wanted)])
    facet = np.full(len(keys), -1)
    facet[keys[: ends[0]]] = np.arange(ends[0])
    boundaries = {}
    for name, members in zip(raw.facets, np.split(facet[keys], ends[:-1])[1:], strict=True):
        if (members < 0).any() or (raw.facets[name] < 0).any():
            corners = raw.cell.side_corners
            side = "edge" if corners == 2 else "face"
            fault = f"boundary '{name}' has {_SIDES[corners]} that are no {side} of a cell"
            raise MeshError(str(raw.path), fault, f"needs {side}s of cells")
        boundaries[name] = np.unique(members).astype(np.int32)
    return boundaries


def _physical(file: Path, mesh: skfem.Mesh2D) -> meshio.Mesh:
    """Return the mesh with its groups as Gmsh's physical groups, a facet once for every boundary it is in."""
    regions, boundaries = mesh.subdomains or {}, mesh.boundaries or {}
    tag = np.zeros(mesh.t.shape[1], dtype=np.int32)
    for number, (name, cells) in enumerate(regions.items(), start=1):
        if tag[cells].any():
            fault = f"region '{name}' shares cells with another"
            raise MeshError(str(file), fault, "needs separate regions in .msh", "write a .vtu")
        tag[cells] = number
    first = len(regions) + 1
    facets = [mesh.facets[:, np.asarray(members)].T for members in boundaries.values()]
    facet_tags = [np.full(len(nodes), number, dtype=np.int32) for number, nodes in enumerate(facets, start=first)]
    names = {name: np.array([number, mesh.dim()]) for number, name in enumerate(regions, start=1)}
    names |= {name: np.array([number, mesh.dim() - 1]) for number, name in enumerate(boundaries, start=first)}
    element = to_meshio(mesh, encode_cell_data=False)
    kind, nodes = element.cells[0].type, np.array(element.cells[0].data)
    # Counter-clockwise and with positive volume: scikit-fem sorts the corners of simplices, and mirrors hexahedra.
    turned = turned_cells(mesh) != (kind == "hexahedron")
    nodes[turned] = nodes[turned][:, _CELLS[kind].turned]
    blocks = [(kind, nodes, tag)]
    blocks += [(_CELLS[kind].sides[0], np.vstack(facets), np.concatenate(facet_tags))] if facets else []
    tags = [tags_of_block for *_, tags_of_block in blocks]
    data = {"gmsh:physical": tags, "gmsh:geometrical": [np.maximum(t, 1) for t in tags]}
    cells = [(kind, nodes) for kind, nodes, _ in blocks]
    return meshio.Mesh(element.points, cells, cell_data=data, field_data=names)


def _narrow(data: meshio.Mesh) -> meshio.Mesh:
    """Return a mesh with triangles and prisms in blocks of their own."""
    cells: list[tuple[str, Integers]] = []
    fields: dict[str, list[Any]] = {name: [] for name in data.cell_data}
    for number, block in enumerate(data.cells):
        few = is_degenerate(block.data) & (block.type in NARROWER)
        narrower, corners = NARROWER.get(block.type, (block.type, []))
        for kind, rows, columns in ((block.type, ~few, slice(None)), (narrower, few, corners)):
            if rows.any():
                cells.append((kind, block.data[rows][:, columns]))
                for name, arrays in data.cell_data.items():
                    fields[name].append(arrays[number][rows])
    return meshio.Mesh(data.points, cells, data.point_data, cell_data=fields, field_data=data.field_data)
