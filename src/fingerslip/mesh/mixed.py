"""Meshes of two kinds of cells: triangles among quadrilaterals, prisms among hexahedra.

A quadrilateral with two corners in one node is a linear triangle, and a hexahedron with an edge of its lower and of its
upper face in one node each is a linear prism: the shape functions of corners that fall together add up to that of the
one. So a mixed mesh is one of quadrilaterals, some (a, b, c, c), or of hexahedra, some (a, b, c, c, d, e, f, f).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Flags, Integers
from fingerslip.mesh.facets import connected_pieces

if TYPE_CHECKING:
    import meshio


# Kinds of cells with nodes between their corners, the kind without, and how many corners that has.
_LINEAR = {
    **dict.fromkeys(("quad8", "quad9"), ("quad", 4)),
    "wedge18": ("wedge", 6),
    **dict.fromkeys(("hexahedron20", "hexahedron27"), ("hexahedron", 8)),
    "triangle6": ("triangle", 3),
    "tetra10": ("tetra", 4),
}
_QUADRATIC = ({"triangle6"}, {"tetra10"})
# The corners of triangles and prisms in the cells that they become; kinds of cells that make one mesh.
_WIDER = {"triangle": ("quad", [0, 1, 2, 2]), "wedge": ("hexahedron", [0, 1, 2, 2, 3, 4, 5, 5])}
_TOGETHER = ({"quad"}, {"quad", "triangle"}, {"hexahedron"}, {"hexahedron", "wedge"}, {"wedge"})
_TURNED = {4: [1, 2, 3, 0], 8: [1, 2, 3, 0, 5, 6, 7, 4]}
#: What triangles and prisms are where they stand alone: their kind, and their corners in the wider cells.
NARROWER = {"quad": ("triangle", [0, 1, 2]), "hexahedron": ("wedge", [0, 1, 2, 4, 5, 6])}
# The same by the numbers of VTK, which gives prisms in this order a volume above zero. Its manual, and with it meshio,
# turn the triangles of prisms.
_NARROWER_IN_VTK = {9: (5, [0, 1, 2]), 12: (13, [0, 1, 2, 4, 5, 6])}
_TURNED_PRISM = [0, 2, 1, 3, 5, 4]


def is_degenerate(cells: NDArray[np.integer]) -> Flags:
    """Tell which quadrilaterals (n, 4) and hexahedra (n, 8), in the order of meshio, are triangles and prisms."""
    if cells.shape[1] not in _TURNED:
        return np.zeros(len(cells), dtype=bool)
    return np.asarray((cells[:, 2::4] == cells[:, 3::4]).all(axis=1))


def vtk_cells(cells: NDArray[np.integer[Any]], kind: int) -> tuple[NDArray[np.integer[Any]], ...]:
    """Return nodes, ends and kinds of cells (n, k) of one kind in VTK, in their order, triangles and prisms as such."""
    cells, is_corner = cells.copy(), np.ones(cells.shape, dtype=bool)
    kinds = np.full(len(cells), kind, np.uint8)
    if kind in _NARROWER_IN_VTK:
        few = is_degenerate(cells)
        kinds[few], corners = _NARROWER_IN_VTK[kind]
        cells[few, : len(corners)] = cells[few][:, corners]
        is_corner[few, len(corners) :] = False
    return cells[is_corner], np.cumsum(is_corner.sum(axis=1), dtype=cells.dtype), kinds


def turn_prisms(data: meshio.Mesh, sign: float) -> None:
    """Turn prisms round whose volume has this sign: -1 what meshio read of a file of VTK, 1 what it is to write."""
    for block in data.cells:
        if block.type == "wedge" and data.points.shape[1] == 3:
            corners = data.points[block.data]
            turned = sign * np.linalg.det(corners[:, [1, 2, 3]] - corners[:, :1]) > 0.0
            block.data = np.where(turned[:, None], block.data[:, _TURNED_PRISM], block.data)


def join_kinds(data: meshio.Mesh) -> None:
    """Make the cells of a file that this package wrote one kind again, with the values that each has."""
    wider = [_WIDER.get(block.type, (block.type, slice(None))) for block in data.cells]
    kinds = {kind for kind, _ in wider}
    if len(data.cells) > 1 and len(kinds) == 1:
        nodes = [block.data[:, order] for block, (_, order) in zip(data.cells, wider, strict=True)]
        data.cells = [type(data.cells[0])(*kinds, np.vstack(nodes))]
        data.cell_data = {name: [np.concatenate(arrays)] for name, arrays in data.cell_data.items()}


def take_one_kind(data: meshio.Mesh) -> tuple[str, ...]:
    """Change the cells of a file into one kind, where they go together; return in words what that leaves out."""
    dim = max((block.dim for block in data.cells if len(block.data)), default=0)
    kinds = {block.type for block in data.cells if block.dim == dim and len(block.data)}
    quadratic = set() if kinds in _QUADRATIC else kinds & _LINEAR.keys()
    corners = _LINEAR if quadratic else {}
    if {corners.get(kind, (kind, 0))[0] for kind in kinds} in _TOGETHER:
        content = [(*corners.get(block.type, (block.type, None)), np.asarray(block.data)) for block in data.cells]
        blocks = _widen([(kind, nodes[:, :count]) for kind, count, nodes in content], len(data.points))
        data.cells = [type(data.cells[0])(kind, nodes) for kind, nodes in blocks]
    return (f"nodes between the corners of {', '.join(sorted(quadratic))}",) if quadratic else ()


def _widen(blocks: list[tuple[str, Integers]], count: int) -> list[tuple[str, Integers]]:
    """Return blocks of cells on `count` nodes with triangles and prisms as quadrilaterals and hexahedra.

    Of prisms that stand on each other the same edges collapse, so that they share a face.
    """
    for number, (kind, nodes) in enumerate(blocks):
        wider, order = _WIDER.get(kind, (kind, list(range(nodes.shape[-1]))))
        nodes = nodes[:, order]  # noqa: PLW2901
        # Programs write such cells themselves, and any of their corners may be the two.
        for _ in range(4 * (nodes.shape[1] in _TURNED)):
            nodes = np.where(is_degenerate(nodes)[:, None], nodes, nodes[:, _TURNED[nodes.shape[1]]])  # noqa: PLW2901
        blocks[number] = wider, nodes
    prisms = [nodes[is_degenerate(nodes)] for kind, nodes in blocks if kind == "hexahedron"]
    edges = [np.stack([nodes[:, [0, 1, 2]], nodes[:, [4, 5, 6]]]).reshape(2, -1) for nodes in prisms]
    column = connected_pieces(count, np.hstack([np.empty((2, 0), dtype=np.int64), *edges]))
    for _, nodes in blocks:
        rows = np.flatnonzero(is_degenerate(nodes))
        for first in range(0, nodes.shape[1] if rows.size else 0, 4):
            corners = nodes[rows, first : first + 3]
            turn = (column[corners].argmin(axis=1)[:, None] + [1, 2, 3, 3]) % 3
            nodes[rows, first : first + 4] = np.take_along_axis(corners, turn, axis=1)
    return blocks
