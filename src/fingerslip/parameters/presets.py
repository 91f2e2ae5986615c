"""Presets: parameter files that ship, of specimens and materials, in which every value says where it comes from.

A file holds `citation`, `published` and `claims_not`, and below `values` for each dotted path a value with its unit,
its `source` (a key of the references, or ``assumed``), a `note`, and the `range` in which it lies where one is known.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any, Generic, TypeVar

from fingerslip.errors import InputError, unknown_name
from fingerslip.parameters import from_mapping
from fingerslip.parameters.dotted import assign, join_path
from fingerslip.parameters.yaml_text import parse_document

T = TypeVar("T")

_Group = Mapping[str, Any]


@dataclass(frozen=True)
class PresetValue:
    """One value of a preset and where it comes from."""

    path: str  # dotted path in the parameter set, such as ``layers.skin_thickness``
    value: str  # the value as the file writes it, with its unit
    source: str  # key of the reference, or ``assumed``
    note: str  # what the value rests on, and its range


@dataclass(frozen=True)
class Presets(Generic[T]):
    """The presets of one kind of parameter set: the YAML files of a folder ``presets``.

    The methods that take a name raise :class:`~fingerslip.errors.InputError` where no preset has that name.
    """

    kind: type[T]  # class of the parameter set, made with :func:`~fingerslip.parameters.parameters`
    package: str  # the package whose folder ``presets`` holds the files
    # given a group of a preset's values and what changes in it, returns those that the change leaves
    kept: Callable[[_Group, _Group], _Group] = lambda group, _: group

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all presets."""
        files = resources.files(self.package).joinpath("presets").iterdir()
        return tuple(sorted(file.name.removesuffix(".yaml") for file in files if file.name.endswith(".yaml")))

    def read(self, name: str) -> T:
        """Return the parameter set of a preset."""
        return from_mapping(self.kind, _nest(self._document(name, "preset")), f"preset {name}")

    def table(self, name: str) -> tuple[PresetValue, ...]:
        """Return every value of a preset with its source, the assumed ones first."""
        rows = []
        for path, entry in self._document(name, "preset")["values"].items():
            value = str(entry["value"])
            notes = (entry.get("note", ""), f"range {entry['range']}" if "range" in entry else "")
            text = value.lower() if isinstance(entry["value"], bool) else value
            rows.append(PresetValue(path, text, entry["source"], "; ".join(filter(None, notes))))
        return tuple(sorted(rows, key=lambda row: row.source != "assumed"))

    def header(self, name: str) -> dict[str, str]:
        """Return what a preset says of itself: `citation`, `published` and `claims_not`."""
        return {key: str(text).strip() for key, text in self._document(name, "preset").items() if key != "values"}

    def changed(self, mapping: Mapping[str, Any], where: str = "") -> T:
        """Return a parameter set from plain data with the key ``preset``, whose other keys override its values."""
        if "preset" not in mapping:
            raise InputError(join_path(where, "preset"), "is missing", f"needs one of {', '.join(self.names)}")
        changes = {key: value for key, value in mapping.items() if key != "preset"}
        values = _nest(self._document(str(mapping["preset"]), join_path(where, "preset")))
        return from_mapping(self.kind, self._merge(self.kept(values, changes), changes), where)

    def _merge(self, base: _Group, changes: _Group) -> dict[str, Any]:
        merged = dict(base)
        for key, value in changes.items():
            inner: Any = base.get(key)
            both = isinstance(inner, Mapping) and isinstance(value, Mapping)
            merged[key] = self._merge(self.kept(inner, value), value) if both else value
        return merged

    def _document(self, name: str, where: str) -> dict[str, Any]:
        if name not in self.names:
            raise unknown_name(where, name, self.names)
        return _read_preset(self.package, name)


def _nest(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a preset's values as nested plain data."""
    nested: dict[str, Any] = {}
    for path, entry in document["values"].items():
        assign(nested, path, entry["value"])
    return nested


@functools.cache
def _read_preset(package: str, name: str) -> dict[str, Any]:
    text = resources.files(package).joinpath("presets", f"{name}.yaml").read_text(encoding="utf-8")
    document: dict[str, Any] = parse_document(text, f"{name}.yaml").content
    return document
