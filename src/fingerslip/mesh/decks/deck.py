"""What a deck has for a mesh: sets of elements become regions, surfaces and sets of nodes become boundaries."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, TypeAlias, TypeVar

import numpy as np

from fingerslip.arrays import Floats, Integers
from fingerslip.units import LengthUnit

if TYPE_CHECKING:
    import meshio

Number = TypeVar("Number", int, float)
#: Cells of one kind, named as meshio does, and their nodes (k, n).
Block: TypeAlias = tuple[str, Integers]
#: Sides of cells with equally many corners each, by their nodes (k, n).
Sides: TypeAlias = list[Integers]

_QUADRILATERAL = ((0, 1), (1, 2), (2, 3), (3, 0))
_WEDGE = ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0))
_HEXAHEDRON = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))
#: The corners of the sides of each kind of cell; the order of the sides is that of Abaqus, S1 first.
SIDES: Mapping[str, tuple[tuple[int, ...], ...]] = MappingProxyType(
    {
        **dict.fromkeys(("triangle", "triangle6"), ((0, 1), (1, 2), (2, 0))),
        **dict.fromkeys(("quad", "quad8", "quad9"), _QUADRILATERAL),
        **dict.fromkeys(("tetra", "tetra10"), ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))),
        **dict.fromkeys(("wedge", "wedge15"), _WEDGE),
        **dict.fromkeys(("hexahedron", "hexahedron20", "hexahedron27"), _HEXAHEDRON),
    }
)
#: The number of an element that is not taken.
NO_CELL = -1
_LARGEST = 1e18
_SIDE_KINDS = {2: "line", 3: "triangle", 4: "quad"}
#: The values of cells that are the labels of elements.
LABELS = "deck:label"


@dataclass(frozen=True)
class Deck:
    """A deck as a mesh."""

    data: meshio.Mesh  # points, cells and their named groups
    left_out: tuple[str, ...] = ()  # what is not taken of the deck
    unit: LengthUnit | None = None  # of its lengths, where it says one


@dataclass
class Groups:
    """The named groups of a deck, while it is read."""

    regions: dict[str, Integers] = field(default_factory=dict)  # numbers of cells, counted through all blocks
    sides: dict[str, Sides] = field(default_factory=dict)
    nodes: dict[str, Integers] = field(default_factory=dict)


def to_numbers(kind: type[Number], entries: Iterable[str]) -> list[Number] | None:
    """Return entries of a deck as numbers; None where one is none, or too large to be counted or measured."""
    try:
        values = [kind(entry) for entry in entries]
    except ValueError:
        return None
    return values if all(abs(value) < _LARGEST for value in values) else None


def assemble(
    points: Floats, cells: Sequence[Block], groups: Groups, left_out: Iterable[str], labels: Mapping[int, str]
) -> Deck:
    """Return points (n, 3) and cells with their named groups; sets of nodes name the outer sides between them.

    Cells have their labels in the deck, by their numbers through all blocks.
    Elements of fewer dimensions, such as shells, are sides of cells, or left out where they belong to rigid surfaces.
    """
    # Slow to load, and this file is loaded with all that may read a mesh.
    import meshio

    if any(kind == "wedge15" for kind, _ in cells):  # meshio has no such cells
        cells = [("wedge", nodes[:, :6]) if kind == "wedge15" else (kind, nodes) for kind, nodes in cells]
        left_out = (*left_out, "nodes between the corners of wedge15")
    is_used = np.zeros(len(points), dtype=bool)
    for _, nodes in _highest(cells):
        is_used[nodes] = True
    boundaries = {
        name: [corners[is_used[corners].all(axis=1)] for corners in sides] for name, sides in groups.sides.items()
    }
    outer = outer_sides(cells)
    for name, nodes in groups.nodes.items():
        is_member = np.isin(np.arange(len(points)), nodes)
        boundaries.setdefault(name, [corners[is_member[corners].all(axis=1)] for corners in outer])
    named = [(name, corners) for name, sides in boundaries.items() for corners in sides if len(corners)]
    blocks = [*cells, *((_SIDE_KINDS[corners.shape[1]], corners) for _, corners in named)]
    empty = np.empty(0, dtype=np.int64)
    sets = {name: [empty] * len(blocks) for name in (*groups.regions, *boundaries)}
    first = 0
    for block, (_, nodes) in enumerate(cells):
        for name, numbers in groups.regions.items():
            members = numbers[(numbers >= first) & (numbers < first + len(nodes))] - first
            sets[name][block] = members[is_used[nodes[members]].all(axis=1)]
        first += len(nodes)
    for block, (name, corners) in enumerate(named, start=len(cells)):
        sets[name][block] = np.arange(len(corners))
    bare = [name for name, members in sets.items() if not any(map(len, members))]
    listed = [f"sets and surfaces with no cell and no side: {', '.join(bare)}"] if bare else []
    # A label that stands twice is of the last.
    every = [labels.get(number, f"{number} (counted from 0)") for number in range(first)]
    ends = np.cumsum([len(nodes) for _, nodes in cells])
    rows = [*np.split(np.array(every), ends[:-1]), *(np.full(len(corners), "") for _, corners in named)]
    return Deck(meshio.Mesh(points, blocks, cell_data={LABELS: rows}, cell_sets=sets), (*left_out, *listed))


def _highest(cells: Sequence[Block]) -> list[Block]:
    """Return the cells of the highest dimension."""
    solid = any(len(SIDES[kind][0]) > 2 for kind, _ in cells if kind in SIDES)
    return [(kind, nodes) for kind, nodes in cells if kind in SIDES and (len(SIDES[kind][0]) > 2) == solid]


def outer_sides(cells: Sequence[Block]) -> Sides:
    """Return the sides that no two cells of the highest dimension share, those with equally many corners together."""
    by_size: dict[int, Sides] = {}
    for kind, nodes in _highest(cells):
        for corners in SIDES[kind]:
            by_size.setdefault(len(corners), []).append(nodes[:, corners])
    outer = []
    for sides in map(np.vstack, by_size.values()):
        _, first, count = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
        outer.append(sides[first[count == 1]])
    return outer
