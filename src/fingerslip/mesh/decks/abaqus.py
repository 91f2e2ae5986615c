"""Decks of Abaqus, as its own preprocessor and others write them: parts, instances, sets, surfaces, sections.

Parts have nodes, elements and sets; instances put them into the assembly, shifted, then rotated; the sets of the
assembly name an instance. A flat deck has all of it without parts. Capital and small letters are the same in names.
"""

from __future__ import annotations

import itertools
import re
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from fingerslip.arrays import Integers
from fingerslip.errors import MeshError, shorten, unknown_name
from fingerslip.mesh.decks.deck import (
    NO_CELL,
    SIDES,
    Block,
    Deck,
    Groups,
    Number,
    Sides,
    assemble,
    outer_sides,
    to_numbers,
)

# Kinds of cells and their nodes, by the beginning of a type of element; letters behind it tell how it is integrated,
# which is ours to choose.
_KINDS: Mapping[str, tuple[str, int]] = MappingProxyType(
    {
        r"(CP(E|S|EG)|CAX|S|M3D|SFM3D|STRI|R3D)3": ("triangle", 3),
        r"(CP(E|S|EG)|CAX|S|M3D|SFM3D|R3D)4": ("quad", 4),
        r"(CP(E|S|EG)|CAX|M3D|SFM3D)6|STRI65": ("triangle6", 6),
        r"(CP(E|S|EG)|CAX|S|M3D|SFM3D)8": ("quad8", 8),
        r"C3D4": ("tetra", 4),
        r"C3D6": ("wedge", 6),
        r"C3D8": ("hexahedron", 8),
        r"C3D10": ("tetra10", 10),
        r"C3D15": ("wedge15", 15),
        r"C3D20": ("hexahedron20", 20),
        r"[TR][23]D2|B[23][13]": ("line", 2),
        r"T[23]D3|B[23]2": ("line3", 3),
    }
)
_LETTERS = frozenset("EHILMNOPRSTVW")
_DEEPEST = 8  # files that include each other
_INCLUDE = re.compile(
    r'^[ \t]*\*[ \t]*INCLUDE\s*,[^*]*?INPUT\s*=\s*"?((?<=")[^"\n]+|[^,\n]+)', re.IGNORECASE | re.MULTILINE
)
_COPY = re.compile(r"-[0-9a-f]{8}$")  # folder of a deck and what it includes, in results

Line = tuple[Path, int]  # a file and the number of its line, from 1


@dataclass(frozen=True)
class Keyword:
    """A keyword with its options and its lines of data."""

    file: Path
    line: int  # of the file, from 1
    name: str  # in capitals
    options: Mapping[str, str]  # by their names in capitals
    data: list[tuple[Line, list[str]]] = field(default_factory=list)  # each line, and what commas divide

    def error(self, fault: str, allowed: str, repair: str = "", line: Line | None = None) -> MeshError:
        """Return the error of a line of data, or of the keyword itself."""
        file, number = line or (self.file, self.line)
        return MeshError(f"{file}: *{self.name.capitalize()}", fault, allowed, repair, number)

    def option(self, name: str) -> str:
        """Return an option, which must be there."""
        if not self.options.get(name):
            raise self.error(f"has no {name.lower()}=", f"needs {name.lower()}= and a name")
        return self.options[name]

    def numbers(self, kind: type[Number], line: Line, fields: Sequence[str]) -> list[Number]:
        """Return the numbers of a line, those of nodes and elements as ``int``, coordinates as ``float``."""
        values = to_numbers(kind, fields[:-1] if len(fields) > 1 and not fields[-1] else fields)
        if values is None:
            needed = "needs numbers between commas" if kind is float else "needs whole numbers between commas"
            raise self.error(f"got '{shorten(', '.join(fields))}'", needed, line=line)
        return values


def read_keywords(file: Path, depth: int = 0, before: Sequence[Keyword] = ()) -> list[Keyword]:
    """Return the keywords of a deck, those of files that it includes in their place; data may go on with one before."""
    keywords: list[Keyword] = []
    head, start = "", 0
    for number, raw in enumerate(file.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
        text = raw.strip()
        if not text or text.startswith("**"):
            continue
        if text.startswith("*") or head.endswith(","):
            head, start = (text, number) if text.startswith("*") else (head + text, start)
            if head.endswith(","):
                continue
            keywords += _keyword(file, start, head, depth, keywords or before)
        elif keywords or before:
            (keywords or before)[-1].data.append(((file, number), [entry.strip() for entry in text.split(",")]))
        else:
            raise MeshError(str(file), f"begins with '{shorten(text)}'", "needs a keyword such as *Node", "", number)
    return keywords


def _keyword(file: Path, line: int, head: str, depth: int, before: Sequence[Keyword]) -> list[Keyword]:
    """Return the keyword of a line, or the keywords of the file that it includes."""
    name, *entries = (entry.strip() for entry in re.findall(r'(?:[^,"]|"[^"]*"?)+', head[1:]) or [""])
    pairs = (entry.partition("=") for entry in entries)
    options = {key.strip().upper(): value.strip().strip('"') for key, _, value in pairs}
    keyword = Keyword(file, line, " ".join(name.upper().split()), options)
    if keyword.name != "INCLUDE":
        return [keyword]
    other = _included(file, keyword.option("INPUT"), depth)
    if depth == _DEEPEST or not other.is_file():
        fault = f"'{other}' includes itself" if depth == _DEEPEST else f"there is no file '{other}'"
        raise keyword.error(fault, "needs a file beside the deck")
    return read_keywords(other, depth + 1, before)


def _included(file: Path, name: str, depth: int) -> Path:
    """Return an included file; of a deck in results, or whose absolute path is gone, one beside it or below it."""
    other, folders = file.parent / name, file.parents[: depth + 1]
    is_copy = any(_COPY.search(folder.name) for folder in folders)
    if not Path(name).is_absolute() or (other.is_file() and not is_copy):
        return other
    parts = other.parts
    below = (folder.joinpath(*parts[start:]) for start in range(1, len(parts)) for folder in folders)
    return next((path for path in below if path.is_file()), other)


def included_files(file: Path, depth: int = 0) -> list[Path]:
    """Return the files that a deck includes, and those that these include, as far as they are there."""
    text = file.read_text(encoding="utf-8", errors="replace") if depth < _DEEPEST else ""
    names = (name.strip() for name in _INCLUDE.findall(text))
    others = [other for name in names if (other := _included(file, name, depth)).is_file()]
    return [inner for other in others for inner in (other, *included_files(other, depth + 1))]


@dataclass(frozen=True)
class _Set:
    """A named set of nodes or elements."""

    name: str
    is_internal: bool  # made by the preprocessor for its own use
    members: list[int] = field(default_factory=list)  # numbers of points or cells of the whole body


@dataclass(frozen=True)
class _Table:
    """The nodes or the elements of all instances, in scopes: the names of instances, or "" for the assembly."""

    word: str  # `node` or `element`
    labels: dict[str, dict[int, int]]  # numbers in the whole body by scope and label
    sets: dict[tuple[str, str], _Set] = field(default_factory=dict)  # by scope and name

    def extend(self, keyword: Keyword, scope: str, option: str, members: Sequence[int]) -> None:
        """Put members into the set that an option names; several keywords may fill it."""
        name = keyword.option(option)
        entry = self.sets.setdefault((scope, name.casefold()), _Set(name, "INTERNAL" in keyword.options))
        entry.members.extend(members)

    def find(self, keyword: Keyword, line: Line, entry: str, scope: str) -> Sequence[int]:
        """Return what an entry of a list means: a label or the name of a set, behind an instance and a dot or not."""
        name = entry.strip('"')
        instance, _, rest = name.rpartition(".")
        if instance and instance.casefold() in self.labels:
            scope, name = instance.casefold(), rest
        if name.isdecimal() and (label := keyword.numbers(int, line, [name])[0]) in self.labels[scope]:
            return [self.labels[scope][label]]
        members = self.sets.get((scope, name.casefold())) or self.sets.get(("", name.casefold()))
        if members is None:
            fault = f"has '{shorten(entry)}', which is no {self.word} and no set of them"
            raise keyword.error(fault, f"needs {self.word}s and sets that come before", line=line)
        return members.members


@dataclass
class _Body:
    """All instances in one, while they are read."""

    points: list[list[float]] = field(default_factory=list)  # [unit of the file]
    cells: list[Block] = field(default_factory=list)
    nodes: _Table = field(default_factory=lambda: _Table("node", {"": {}}))
    elements: _Table = field(default_factory=lambda: _Table("element", {"": {}}))
    surfaces: dict[tuple[str, str], tuple[_Set, Sides]] = field(default_factory=dict)
    # Surfaces and sections with their scopes, by the names of their keywords.
    later: defaultdict[str, list[tuple[Keyword, str]]] = field(default_factory=lambda: defaultdict(list))
    instances: dict[str, tuple[str, str, Integers]] = field(default_factory=dict)  # name, name of the part, cells
    left_out: Counter[str] = field(default_factory=Counter)

    @property
    def count(self) -> int:
        """Number of cells."""
        return sum(len(nodes) for _, nodes in self.cells)

    @property
    def labels(self) -> dict[int, str]:
        """The labels of cells by their numbers, behind their instance and a dot where there are several."""
        homes = {scope: f"{name}." * (len(self.instances) > 1) for scope, (name, *_) in self.instances.items()}
        tables = self.elements.labels.items()
        return {cell: f"{homes.get(scope, '')}{label}" for scope, table in tables for label, cell in table.items()}

    def add(self, keywords: Sequence[Keyword], scope: str = "") -> None:
        """Read the keywords of a part in the scope of its instance, or those of the assembly."""
        # Sets name elements and nodes, and surfaces name sets, wherever these are; sides are free among all cells.
        readers = (
            {"NODE": self._add_nodes, "SYSTEM": _refuse_system},
            {"ELEMENT": self._add_elements},
            {"NSET": self._add_set, "ELSET": self._add_set},
            dict.fromkeys(("SURFACE", "SOLID SECTION"), lambda key, home: self.later[key.name].append((key, home))),
        )
        for group in readers:
            for keyword in keywords:
                if keyword.name in group:
                    group[keyword.name](keyword, scope)
        names = {"HEADING", "PREPRINT", "ASSEMBLY", "END ASSEMBLY"}.union(*readers)
        self.left_out.update(f"*{keyword.name.capitalize()}" for keyword in keywords if keyword.name not in names)

    def _add_nodes(self, keyword: Keyword, scope: str) -> None:
        if keyword.options.get("SYSTEM", "R").upper() != "R":
            _refuse_system(keyword, scope)
        first = len(self.points)
        for line, fields in keyword.data:
            (label,), position = keyword.numbers(int, line, fields[:1]), keyword.numbers(float, line, fields[1:4])
            if not position:
                raise keyword.error(f"node {label} has no coordinates", "needs 2 or 3 of them", line=line)
            self.nodes.labels[scope][label] = len(self.points)
            self.points.append([*position, 0.0, 0.0][:3])
        if "NSET" in keyword.options:
            self.nodes.extend(keyword, scope, "NSET", range(first, len(self.points)))

    def _add_elements(self, keyword: Keyword, scope: str) -> None:
        name, first, labels = keyword.option("TYPE").upper(), self.count, self.elements.labels[scope]
        kind_and_count = _kind_of(keyword, name)
        if kind_and_count is None:
            self.left_out[f"elements {name}"] += 1
            for line, fields in keyword.data:
                labels.setdefault(keyword.numbers(int, line, fields[:1])[0], NO_CELL)
            return
        if name.startswith("CAX"):
            self.left_out[f"the axial symmetry of {name}"] += 1
        (kind, count), rows, record = kind_and_count, list[list[int]](), list[int]()
        for line, fields in keyword.data:
            record += keyword.numbers(int, line, fields)
            # Behind a comma an element goes on in the next line.
            if len(record) <= count and not fields[-1] and line != keyword.data[-1][0]:
                continue
            label, *nodes = record
            if len(nodes) != count:
                raise keyword.error(f"element {label} has {len(nodes)} nodes", f"{name} needs {count}", line=line)
            missing = [node for node in nodes if node not in self.nodes.labels[scope]]
            if missing:
                fault = f"element {label} has node {missing[0]}, which is not there"
                raise keyword.error(fault, "needs nodes of its part", "write them under *Node", line)
            labels[label] = first + len(rows)
            rows.append([self.nodes.labels[scope][node] for node in nodes])
            record = []
        self.cells.append((kind, np.array(rows, dtype=np.int64).reshape(-1, count)))
        if "ELSET" in keyword.options:
            self.elements.extend(keyword, scope, "ELSET", range(first, self.count))

    def _add_set(self, keyword: Keyword, scope: str) -> None:
        table = self.nodes if keyword.name == "NSET" else self.elements
        source = keyword.options.get("INSTANCE", scope).casefold()
        if source not in table.labels:
            names = [name for name, *_ in self.instances.values()]
            raise keyword.error(f"there is no instance '{source}'", f"needs one of {', '.join(names) or 'none'}")
        table.extend(keyword, scope, keyword.name, ())
        for line, fields in keyword.data:
            if "GENERATE" not in keyword.options:
                members = [member for entry in fields if entry for member in table.find(keyword, line, entry, source)]
            else:
                first, last, step = (*keyword.numbers(int, line, fields), 1, 0, 0)[:3]
                if step < 1:
                    raise keyword.error(f"got '{', '.join(fields)}'", "needs first, last and a step >= 1", line=line)
                wanted = range(first, last + 1, step)
                members = [number for label, number in table.labels[source].items() if label in wanted]
            table.extend(keyword, scope, keyword.name, members)

    def _add_surface(self, keyword: Keyword, scope: str) -> None:
        name, sides = keyword.option("NAME"), Sides()
        surface, kind = _Set(name, "INTERNAL" in keyword.options), keyword.options.get("TYPE", "ELEMENT").upper()
        if kind not in {"ELEMENT", "NODE"} or "COMBINE" in keyword.options:
            self.left_out[f"the surface {name}, {'of others' if 'COMBINE' in keyword.options else kind.lower()}"] += 1
            return
        for line, (entry, *faces) in keyword.data:
            if kind == "NODE":
                surface.members.extend(self.nodes.find(keyword, line, entry, scope))
                continue
            for block in self._cells_of(self.elements.find(keyword, line, entry, scope)):
                sides += self._faces(keyword, (line, faces[0].upper() if faces else ""), *block)
        self.surfaces[scope, name.casefold()] = surface, sides

    def _cells_of(self, numbers: Sequence[int]) -> list[Block]:
        """Return some of the cells, block by block."""
        starts = np.cumsum([0, *(len(nodes) for _, nodes in self.cells)])
        chosen = np.asarray(numbers, dtype=np.int64)
        blocks = zip(self.cells, starts[:-1], starts[1:], strict=True)
        return [(kind, nodes[chosen[(chosen >= a) & (chosen < b)] - a]) for (kind, nodes), a, b in blocks]

    def _faces(self, keyword: Keyword, entry: tuple[Line, str], kind: str, nodes: Integers) -> Sides:
        """Return the named side of each of some cells, a shell itself, or without a name all that are free."""
        line, face = entry
        if not len(nodes):
            return []
        if kind not in SIDES or face in {"SPOS", "SNEG"}:
            return [nodes[:, : len(SIDES.get(kind, "ab"))]]
        if not face:
            every = [nodes[:, corners] for corners in SIDES[kind]]
            return [rows[[tuple(row) in self._free for row in np.sort(rows, axis=1).tolist()]] for rows in every]
        names = [f"S{number}" for number in range(1, len(SIDES[kind]) + 1)]
        if face not in names:
            raise keyword.error(f"has the side '{shorten(face)}' of a {kind}", f"needs {', '.join(names)}", line=line)
        return [nodes[:, SIDES[kind][names.index(face)]]]

    @cached_property
    def _free(self) -> set[tuple[int, ...]]:
        """The sorted corners of all sides that only one cell has."""
        return {tuple(row) for corners in outer_sides(self.cells) for row in np.sort(corners, axis=1).tolist()}

    def groups(self) -> Groups:
        """Return regions and boundaries by their names."""
        for entry in self.later["SURFACE"]:
            self._add_surface(*entry)
        groups = Groups(self._sections())
        for key, elements in self.elements.sets.items():
            if not elements.is_internal and not self._is_along_edge(key):
                self.nodes.sets.pop(key, None)
                groups.regions.setdefault(self._name(key[0], elements), np.array(elements.members, dtype=np.int64))
        for (scope, _), (surface, sides) in self.surfaces.items():
            table: dict[str, Any] = groups.sides if sides else groups.nodes
            if not surface.is_internal:
                table[self._name(scope, surface)] = sides or np.array(surface.members, dtype=np.int64)
        for (scope, _), nodes in self.nodes.sets.items():
            if not nodes.is_internal:
                groups.nodes.setdefault(self._name(scope, nodes), np.array(nodes.members, dtype=np.int64))
        for _, part, cells in self.instances.values():
            if not any(np.isin(cells, members).any() for members in groups.regions.values()):
                groups.regions[part] = cells
        return groups

    def _is_along_edge(self, key: tuple[str, str]) -> bool:
        """Tell whether elements are those beside an edge, along which the set of nodes of the same name lies."""
        if key not in self.nodes.sets:
            return False
        numbers = [nodes.ravel() for _, nodes in self._cells_of(self.elements.sets[key].members)]
        return set(np.concatenate(numbers).tolist()) != set(self.nodes.sets[key].members)

    def _sections(self) -> dict[str, Integers]:
        """Return the regions of sections; one whose set the preprocessor named itself is called by its material."""
        regions: dict[str, list[int]] = {}
        for keyword, scope in self.later["SOLID SECTION"]:
            key = scope, keyword.option("ELSET").casefold()
            if key not in self.elements.sets:
                raise keyword.error(f"has no set '{keyword.options['ELSET']}'", "needs elset= and a set of elements")
            elements = self.elements.sets[key]
            material = keyword.options.get("MATERIAL") if elements.is_internal else None
            regions.setdefault(material or self._name(scope, elements), []).extend(elements.members)
        return {name: np.array(members, dtype=np.int64) for name, members in regions.items()}

    def _name(self, scope: str, entry: _Set) -> str:
        """Return the name of a set or surface, behind its instance and a dot where several scopes have it."""
        keys = (*self.nodes.sets, *self.elements.sets, *self.surfaces)
        scopes = {home for home, name in keys if name == entry.name.casefold()}
        return f"{self.instances[scope][0]}.{entry.name}" if scope and len(scopes) > 1 else entry.name


def _kind_of(keyword: Keyword, name: str) -> tuple[str, int] | None:
    """Return the kind of cells of a type of element and their nodes, where it is taken."""
    for start, kind in _KINDS.items():
        match = re.fullmatch(rf"({start})(?P<letters>[A-Z]*)5?", name)
        if match and len(_LETTERS.intersection(match["letters"])) < len(match["letters"]):
            needed = f"needs {match[1]} with letters such as {match[1]}R, {match[1]}H or {match[1]}RH"
            raise keyword.error(f"has elements of the type {name}, which is not known", needed)
        if match:
            return kind
    return None


def _refuse_system(keyword: Keyword, _scope: str) -> None:
    if keyword.data:  # without data *System goes back to the coordinates of the part
        raise keyword.error("has a system of its own", "needs the x, y and z of the part", "write the deck without it")


def read_abaqus(file: Path) -> Deck:
    """Read a deck of Abaqus; what is not taken of it is listed."""
    body, top = _Body(), list[Keyword]()
    blocks: dict[str, list[tuple[Keyword, list[Keyword]]]] = {"PART": [], "INSTANCE": []}
    target, opened = top, None
    keywords = read_keywords(file)
    steps = [keyword.options.get("NLGEOM", "NO").upper() for keyword in keywords if keyword.name == "STEP"]
    if steps:
        is_large = any(option != "NO" for option in steps)
        body.left_out["*Step" + " (its nlgeom=YES is large strain: write kinematics: finite)" * is_large] += 1
    for keyword in itertools.takewhile(lambda keyword: keyword.name != "STEP", keywords):
        if keyword.name in blocks:
            target, opened = [], keyword
            blocks[keyword.name].append((keyword, target))
        elif keyword.name.removeprefix("END ") in blocks:
            target, opened = top, None
        else:
            target.append(keyword)
    if opened is not None:
        raise opened.error("does not end", f"needs *End {opened.name.capitalize()}", "export the deck again")
    part_by_name = {keyword.option("NAME").casefold(): (keyword, content) for keyword, content in blocks["PART"]}
    for keyword, content in blocks["INSTANCE"]:
        _add_instance(body, keyword, content, part_by_name)
    body.add(top)
    if not body.count:
        fault = f"has no elements that can be taken ({', '.join(body.left_out) or 'nothing else either'})"
        repair = "put its parts into an assembly, by *Instance" * (bool(part_by_name) and not body.instances)
        raise MeshError(str(file), fault, "needs elements such as CPE4, CPS3, C3D8 or C3D10", repair)
    points = np.array(body.points, dtype=float).reshape(-1, 3)
    return assemble(points, body.cells, body.groups(), body.left_out, body.labels)


def _add_instance(
    body: _Body, keyword: Keyword, content: list[Keyword], part_by_name: Mapping[str, tuple[Keyword, list[Keyword]]]
) -> None:
    """Put an instance of a part into the body: shifted first, then rotated about an axis through two points."""
    name, part = keyword.option("NAME"), keyword.option("PART")
    if part.casefold() not in part_by_name:
        error = unknown_name("", part, [entry.options["NAME"] for entry, _ in part_by_name.values()])
        raise keyword.error(error.found, error.allowed, error.repair)
    scope, first, first_cell = name.casefold(), len(body.points), body.count
    body.nodes.labels[scope], body.elements.labels[scope] = {}, {}
    body.add([*part_by_name[part.casefold()][1], *content], scope)
    body.instances[scope] = name, part, np.arange(first_cell, body.count)
    points = np.array(body.points[first:], dtype=float).reshape(-1, 3)
    for (line, fields), needed in zip(keyword.data, (3, 7), strict=False):
        values = np.array(keyword.numbers(float, line, fields))
        axis = values[3:6] - values[:3] if len(values) == needed == 7 else np.ones(1)
        if len(values) != needed or not axis.any():
            allowed = f"needs {needed} numbers" + ", two points of an axis and an angle" * (needed == 7)
            raise keyword.error(f"got '{shorten(', '.join(fields))}'", allowed, line=line)
        if needed == 3:
            points += values
        else:
            # Slow to load, and this file is loaded with all that may read a mesh.
            from scipy.spatial.transform import Rotation

            turn = Rotation.from_rotvec(np.radians(values[6]) * axis / np.linalg.norm(axis))
            points = turn.apply(points - values[:3]) + values[:3]
    body.points[first:] = points.tolist()
