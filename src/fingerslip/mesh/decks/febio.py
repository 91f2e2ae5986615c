"""Files of FEBio (.feb, versions 2.5 to 4.0): nodes, elements, sets and surfaces; every tag knows its line."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from xml.etree import ElementTree as ET
from xml.parsers import expat

import numpy as np

from fingerslip.arrays import Integers
from fingerslip.errors import MeshError, shorten
from fingerslip.mesh.decks.deck import NO_CELL, Block, Deck, Groups, Number, Sides, assemble, to_numbers
from fingerslip.units import LengthUnit, metres

_VERSIONS = ("2.5", "3.0", "4.0")
_KINDS: Mapping[str, tuple[str, int]] = MappingProxyType(
    {
        "tri3": ("triangle", 3),
        "tri6": ("triangle6", 6),
        "quad4": ("quad", 4),
        "quad8": ("quad8", 8),
        "quad9": ("quad9", 9),
        "tet4": ("tetra", 4),
        "tet10": ("tetra10", 10),
        "penta6": ("wedge", 6),
        "penta15": ("wedge15", 15),
        "hex8": ("hexahedron", 8),
        "hex20": ("hexahedron20", 20),
        "hex27": ("hexahedron27", 27),
    }
)
# The length and the newtons of a unit of force in the systems of units that FEBio Studio writes.
_UNITS: Mapping[str, tuple[LengthUnit, float]] = MappingProxyType(
    {
        "SI": ("m", 1.0),
        "mm-N-s": ("mm", 1.0),
        "mm-kg-s": ("mm", 1e-3),
        "um-nN-s": ("um", 1e-9),
        "CGS": ("cm", 1e-5),
        "mm-g-s": ("mm", 1e-6),
        "mm-mg-s": ("mm", 1e-9),
    }
)
_SECTIONS = frozenset({"Module", "Globals", "Material", "Mesh", "Geometry", "MeshDomains", "Output"})
#: The attribute that every tag has besides its own: its line.
LINE = "line of the file"


@dataclass(frozen=True)
class Content:
    """What stands in a file."""

    file: Path
    root: ET.Element

    def error(self, tag: ET.Element, fault: str, allowed: str) -> MeshError:
        """Return the error of a tag."""
        return MeshError(f"{self.file}: <{tag.tag}>", fault, allowed, line=int(tag.attrib[LINE]))

    @property
    def mesh(self) -> ET.Element:
        """The tag of nodes and elements, which older versions call geometry."""
        for name in ("Mesh", "Geometry"):
            if (tag := self.root.find(name)) is not None:
                return tag
        raise self.error(self.root, "has no <Mesh>", "needs one, with nodes and elements")

    @property
    def units(self) -> tuple[LengthUnit | None, float]:
        """The unit of length that the file says, if it says one, and its unit of force [N]."""
        for entry in self.root.iterfind("Module/units"):
            name = (entry.text or "").strip()
            if name and name not in _UNITS:
                raise self.error(entry, f"got '{shorten(name)}'", f"needs one of {', '.join(_UNITS)}")
            if name:
                return _UNITS[name]
        return None, 1.0

    def numbers(self, tag: ET.Element, kind: type[Number], text: str | None) -> list[Number]:
        """Return the numbers between the commas of a text of a tag."""
        values = to_numbers(kind, filter(str.strip, (text or "").split(",")))
        if values is None:
            raise self.error(tag, f"got '{shorten(text or '')}'", "needs numbers between commas")
        return values

    def label(self, tag: ET.Element) -> int:
        """Return the number that a tag has as its `id`."""
        labels = self.numbers(tag, int, tag.get("id"))
        if len(labels) != 1:
            raise self.error(tag, f"got id='{tag.get('id', '')}'", "needs the id of one thing")
        return labels[0]

    def members(self, tag: ET.Element, numbers: Mapping[int, int]) -> list[int]:
        """Return the numbers of labels that stand between commas, or each in a tag of its own."""
        labels = [*self.numbers(tag, int, tag.text), *(self.label(entry) for entry in tag)]
        missing = [label for label in labels if label not in numbers]
        if missing:
            raise self.error(tag, f"has {missing[0]}, which is not there", "needs labels that the mesh has")
        return [numbers[label] for label in labels]

    def parts(self) -> dict[str, list[ET.Element]]:
        """Return the elements of kinds that are taken by the names of their parts."""
        by_name: dict[str, list[ET.Element]] = {}
        for tag in self.mesh.iterfind("Elements"):
            if tag.get("type") in _KINDS:
                by_name.setdefault(tag.get("name") or f"Part{len(by_name) + 1}", []).append(tag)
        return by_name


def read_content(file: Path) -> Content:
    """Read a file of FEBio."""
    parser, builder = expat.ParserCreate(), ET.TreeBuilder()

    def start(name: str, attributes: dict[str, str]) -> None:
        builder.start(name, attributes | {LINE: str(parser.CurrentLineNumber)})

    parser.StartElementHandler, parser.EndElementHandler = start, builder.end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(file.read_bytes(), True)
    except (expat.ExpatError, LookupError, ValueError) as error:
        allowed, line = "needs a whole file of FEBio", getattr(error, "lineno", None)
        raise MeshError(str(file), f"is no XML ({error})", allowed, "export it again", line) from None
    content = Content(file, builder.close())
    version = content.root.get("version", "none")
    if content.root.tag != "febio_spec" or version not in _VERSIONS:
        raise content.error(content.root, f"has version {version}", f"needs <febio_spec> of {', '.join(_VERSIONS)}")
    return content


def read_febio(file: Path) -> Deck:
    """Read the mesh of a file of FEBio; what is not taken of it is listed."""
    content = read_content(file)
    points: list[list[float]] = []
    nodes: dict[int, int] = {}
    for tag in content.mesh.iterfind("Nodes/node"):
        nodes[content.label(tag)] = len(points)
        points.append(content.numbers(tag, float, tag.text))
        if len(points[-1]) != 3:
            raise content.error(tag, f"got {len(points[-1])} numbers", "needs 3 coordinates")
    cells, elements, regions = _elements(content, nodes)
    groups, left_out = Groups(regions), [f"<{tag.tag}>" for tag in content.root if tag.tag not in _SECTIONS]
    for tag in content.mesh:
        name = tag.get("name", "")
        if tag.tag == "Elements" and tag.get("type") not in _KINDS:
            left_out.append(f"elements {name} ({tag.get('type', 'of no type')})")
        elif tag.tag == "NodeSet" and name:
            groups.nodes[name] = np.array(content.members(tag, nodes), dtype=np.int64)
        elif tag.tag == "ElementSet" and name:
            groups.regions.setdefault(name, np.array(content.members(tag, elements), dtype=np.int64))
        elif tag.tag == "Surface" and name:
            groups.sides[name] = _faces(content, tag, nodes)
        elif tag.tag not in {"Nodes", "Elements", "SurfacePair"}:
            left_out.append(f"<{tag.tag}> {name}".rstrip())
    labels = {number: str(label) for label, number in elements.items()}
    deck = assemble(np.array(points), cells, groups, dict.fromkeys(left_out), labels)
    return dataclasses.replace(deck, unit=content.units[0])


def unit_of_file(file: Path) -> LengthUnit | None:
    """Return the unit of length that a file says; None where it is none of FEBio, or says none."""
    return read_content(file).units[0] if file.suffix.lower() == ".feb" and file.is_file() else None


def chosen_unit(file: Path, said: LengthUnit | None, given: LengthUnit | None) -> LengthUnit:
    """Return the unit of a file's lengths: the one that it says, else the one that is given, else metres."""
    metres(given or "m")
    if said is not None and given not in {None, said}:
        allowed = f"the file's own units have {said}"
        raise MeshError(f"{file}: unit", f"got {given!r}", allowed, "leave it out, or correct <units> in the file")
    return said or given or "m"


def _elements(content: Content, nodes: Mapping[int, int]) -> tuple[list[Block], dict[int, int], dict[str, Integers]]:
    """Return the cells, their numbers by the labels of all elements, and the numbers of each part."""
    cells: list[Block] = []
    elements = {content.label(tag): NO_CELL for tag in content.mesh.iterfind("Elements/elem")}
    regions: dict[str, Integers] = {}
    first = 0
    for name, block in ((name, block) for name, blocks in content.parts().items() for block in blocks):
        kind, count = _KINDS[block.attrib["type"]]
        rows = []
        for tag in block.iterfind("elem"):
            rows.append(content.members(tag, nodes))
            if len(rows[-1]) != count:
                fault = f"element {tag.get('id')} has {len(rows[-1])} nodes"
                raise content.error(tag, fault, f"{block.get('type')} needs {count}")
            elements[content.label(tag)] = first + len(rows) - 1
        cells.append((kind, np.array(rows, dtype=np.int64).reshape(-1, count)))
        numbers = np.arange(first, first + len(rows))
        regions[name] = np.append(regions.get(name, numbers[:0]), numbers)
        first += len(rows)
    if not first:
        raise content.error(content.mesh, "has no elements that can be taken", f"needs some of {', '.join(_KINDS)}")
    return cells, elements, regions


def _faces(content: Content, surface: ET.Element, nodes: Mapping[int, int]) -> Sides:
    """Return the corners of the faces of a surface, whose kinds are the names of their tags."""
    faces: dict[int, list[list[int]]] = {3: [], 4: []}
    for face in surface:
        row, count = content.members(face, nodes), 3 if face.tag.startswith("tri") else 4
        if len(row) < count:
            raise content.error(face, f"has {len(row)} nodes", f"needs {count} or more")
        faces[count].append(row[:count])
    return [np.array(rows) for rows in faces.values() if rows]
