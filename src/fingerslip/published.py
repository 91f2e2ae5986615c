"""Published values, with their conditions and sources, that results are shown beside."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import resources
from importlib.resources.abc import Traversable
from types import MappingProxyType
from typing import Any, Literal

from fingerslip.errors import InputError, unknown_name
from fingerslip.parameters.yaml_text import parse_document
from fingerslip.units import parse_quantity, split_quantity

Kind = Literal["published", "derived", "qualitative"]

_FOLDER: Traversable = resources.files("fingerslip").joinpath("data", "published")


@dataclass(frozen=True)
class PublishedValue:
    """One published value or statement."""

    id: str  # its name within the paper's file
    quantity: str  # what it is: the event's name, or another quantity
    kind: Kind  # printed in the paper, arithmetic on printed values, or a statement in words
    source: str  # key of the reference, and the table, figure or section of it
    unit: str = ""  # SI unit of the values
    value: float | None = None  # the value
    span: tuple[float, float] | None = None  # smallest and largest published value
    resolution: float | None = None  # one unit of the last printed digit; None where ours is not judged by it
    # how the paper reads the event: 'slip', 'displacement' or 'acceleration'; empty where that is not said
    reading: str = ""
    conditions: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    programme: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    statement: str = ""  # the statement in words
    check: str = ""  # the number that the statement is compared with
    note: str = ""  # what else is known of it
    otherwise: str = ""  # why the time from accumulated slip is another quantity than the paper's
    calibrated: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))

    def holds_for(self, values: Mapping[str, Any]) -> bool:
        """Tell whether the dotted `values` of a run meet every condition; a value that is missing does not."""
        return not self.unmet(values)

    def unmet(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return the conditions that the dotted `values` of a run do not meet: paths, and what would be needed."""
        return _unmet({**self.conditions, **self.programme}, values)

    def is_calibrated(self, values: Mapping[str, Any]) -> bool:
        """Tell whether the dotted `values` of a run are those that were chosen so that this value comes out."""
        return bool(self.calibrated) and not _unmet(self.calibrated, values)


@dataclass(frozen=True)
class PublishedSet:
    """Published values under one title."""

    name: str  # the name that a study's `compare` uses, such as ``wang2014-table2``
    title: str  # what they are
    citation: str  # the paper
    note: str  # what to know before comparing
    values: tuple[PublishedValue, ...]  # the values


def published_names() -> tuple[str, ...]:
    """Return the names of all published sets."""
    return tuple(f"{paper}-{group}" for paper in _papers() for group in _document(paper)["groups"])


def published_set(name: str) -> PublishedSet:
    """Return a published set by its name: a paper and a group of its values, such as ``wang2014-table2``."""
    paper, _, group = name.partition("-")
    # The sets of one paper alone are read: reading all takes a while.
    document = _document(paper) if paper in _papers() else {"groups": {}}
    if group not in document["groups"]:
        raise unknown_name("compare", name, published_names())
    entry = document["groups"][group]
    values = tuple(_value(row, entry, document) for row in entry["rows"])
    note = entry.get("note", document["note"]).strip()
    return PublishedSet(name, entry["title"], document["citation"].strip(), note, values)


def _value(row: Mapping[str, Any], group: Mapping[str, Any], document: Mapping[str, Any]) -> PublishedValue:
    span = tuple(row["range"]) if "range" in row else None
    shared = group.get("conditions", document["conditions"])
    programme = group.get("programme", document["programme"])
    otherwise = group.get("otherwise", document.get("otherwise", {}))
    texts = {name: row.get(name, "") for name in ("unit", "reading", "statement", "check", "note")}
    return PublishedValue(
        id=row["id"],
        quantity=row["quantity"],
        kind=group.get("kind", "published"),
        source=f"{document['source']}, {group['source']}",
        value=sum(span) / 2.0 if span else row.get("value"),
        span=(float(span[0]), float(span[1])) if span else None,
        resolution=row.get("resolution", group.get("resolution")),
        conditions=MappingProxyType({**shared, **row.get("conditions", {})}),
        programme=MappingProxyType(dict(programme)),
        otherwise=otherwise.get(row["quantity"], "") if not row.get("reading") else "",
        calibrated=MappingProxyType(dict(row.get("calibrated", {}))),
        **texts,
    )


def _unmet(needed: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    return {path: value for path, value in needed.items() if path not in values or not _same(values[path], value)}


def _same(value: object, needed: object) -> bool:
    """Tell whether a value is the needed one; quantities and numbers may be written differently."""
    if isinstance(needed, float) and isinstance(value, int | float):
        return math.isclose(value, needed, rel_tol=1e-9)
    if not isinstance(needed, str) or not isinstance(value, str):
        return value == needed
    quantity, actual = split_quantity(needed), split_quantity(value)
    if quantity is None or actual is None:
        return value == needed
    number, unit = quantity
    try:
        return math.isclose(parse_quantity(value, unit), number, rel_tol=1e-9, abs_tol=1e-12)
    except InputError:
        return False


def _papers() -> tuple[str, ...]:
    names = (file.name for file in _FOLDER.iterdir())
    return tuple(sorted(name.removesuffix(".yaml") for name in names if name.endswith(".yaml")))


@functools.cache
def _document(paper: str) -> dict[str, Any]:
    text = _FOLDER.joinpath(f"{paper}.yaml").read_text(encoding="utf-8")
    document: dict[str, Any] = parse_document(text, f"{paper}.yaml").content
    return document
