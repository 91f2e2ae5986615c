"""The keywords of a deck of Abaqus with their options and lines of data."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fingerslip.errors import MeshError, shorten
from fingerslip.mesh.decks.deck import Number, to_numbers

_DEEPEST = 8  # files that include each other


@dataclass(frozen=True)
class Keyword:
    """A keyword with its options and its lines of data."""

    file: Path
    line: int  # of the file, from 1
    name: str  # in capitals
    options: Mapping[str, str]  # by their names in capitals
    data: list[tuple[int, list[str]]] = field(default_factory=list)  # numbers of lines, and what commas divide

    def error(self, fault: str, allowed: str, repair: str = "", line: int | None = None) -> MeshError:
        """Return the error of a line of data, or of the keyword itself."""
        return MeshError(f"{self.file}: *{self.name.capitalize()}", fault, allowed, repair, line or self.line)

    def option(self, name: str) -> str:
        """Return an option, which must be there."""
        if not self.options.get(name):
            raise self.error(f"has no {name.lower()}=", f"needs {name.lower()}= and a name")
        return self.options[name]

    def numbers(self, kind: type[Number], line: int, fields: Sequence[str]) -> list[Number]:
        """Return the numbers of a line, those of nodes and elements as ``int``, coordinates as ``float``."""
        values = to_numbers(kind, fields[:-1] if len(fields) > 1 and not fields[-1] else fields)
        if values is None:
            needed = "needs numbers between commas" if kind is float else "needs whole numbers between commas"
            raise self.error(f"got '{shorten(', '.join(fields))}'", needed, line=line)
        return values


def read_keywords(file: Path, depth: int = 0) -> list[Keyword]:
    """Return the keywords of a deck, those of the files that it includes in their place."""
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
            keywords += _keyword(file, start, head, depth)
        elif keywords:
            keywords[-1].data.append((number, [entry.strip() for entry in text.split(",")]))
        else:
            raise MeshError(str(file), f"begins with '{shorten(text)}'", "needs a keyword such as *Node", "", number)
    return keywords


def _keyword(file: Path, line: int, head: str, depth: int) -> list[Keyword]:
    """Return the keyword of a line, or the keywords of the file that it includes."""
    name, *entries = (entry.strip() for entry in re.findall(r'(?:[^,"]|"[^"]*"?)+', head[1:]) or [""])
    pairs = (entry.partition("=") for entry in entries)
    options = {key.strip().upper(): value.strip().strip('"') for key, _, value in pairs}
    keyword = Keyword(file, line, " ".join(name.upper().split()), options)
    if keyword.name != "INCLUDE":
        return [keyword]
    other = file.parent / keyword.option("INPUT")
    if depth == _DEEPEST or not other.is_file():
        fault = f"'{other}' includes itself" if depth == _DEEPEST else f"there is no file '{other}'"
        raise keyword.error(fault, "needs a file beside the deck")
    return read_keywords(other, depth + 1)
