"""Published fingertips: the parameter files that ship, and a study's changes to them."""

from __future__ import annotations

import difflib
import functools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable
from typing import Any

from fingerslip.dotted import joined
from fingerslip.errors import InputError
from fingerslip.parameters import from_mapping
from fingerslip.specimens.fingertip.fingertip import Fingertip
from fingerslip.yaml_text import parse_document

__all__ = ["PresetValue", "fingertip_from", "preset", "preset_header", "preset_names", "preset_table"]


@dataclass(frozen=True)
class PresetValue:
    """One value of a preset and where it comes from.

    Parameters
    ----------
    path : str
        Dotted path in the fingertip, such as ``layers.skin_thickness``.
    value : str
        The value as the file writes it, with its unit.
    source : str
        Key of the reference, or ``assumed``.
    note : str
        What the value rests on.
    """

    path: str
    value: str
    source: str
    note: str


def preset_names() -> tuple[str, ...]:
    """Return the names of all presets."""
    files = _folder().iterdir()
    return tuple(sorted(file.name.removesuffix(".yaml") for file in files if file.name.endswith(".yaml")))


def preset(name: str) -> Fingertip:
    """Return the fingertip of a preset.

    Parameters
    ----------
    name : str
        One of :func:`preset_names`.

    Raises
    ------
    InputError
        Where no preset has that name.
    """
    return from_mapping(Fingertip, _values(name, "preset"), f"preset {name}")


def preset_table(name: str) -> tuple[PresetValue, ...]:
    """Return every value of a preset with its source, the assumed ones first.

    Parameters
    ----------
    name : str
        One of :func:`preset_names`.

    Raises
    ------
    InputError
        Where no preset has that name.
    """
    entries = _document(name, "preset")["values"].items()
    rows = [PresetValue(path, _text(e["value"]), e["source"], e.get("note", "")) for path, e in entries]
    return tuple(sorted(rows, key=lambda row: row.source != "assumed"))


def preset_header(name: str) -> dict[str, str]:
    """Return what a preset says of itself: `citation`, `published` and `claims_not`.

    Raises
    ------
    InputError
        Where no preset has that name.
    """
    return {key: str(text).strip() for key, text in _document(name, "preset").items() if key != "values"}


def fingertip_from(mapping: Mapping[str, Any], where: str = "") -> Fingertip:
    """Return the fingertip of a study: a preset and what the study changes in it.

    Parameters
    ----------
    mapping : mapping
        Nested plain data as YAML gives it, with the key ``preset``; the other keys override the preset's values.
    where : str, optional
        What errors put first, such as ``studies/x.yaml: fingertip``.

    Raises
    ------
    InputError
        For an unknown preset, or for all unknown keys and values that do not fit.
    """
    if "preset" not in mapping:
        names = ", ".join(preset_names())
        raise InputError(joined(where, "preset"), "is missing", f"needs one of {names}")
    changes = {key: value for key, value in mapping.items() if key != "preset"}
    values = _merged(_values(str(mapping["preset"]), joined(where, "preset")), changes)
    return from_mapping(Fingertip, values, where)


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _values(name: str, where: str) -> dict[str, Any]:
    """Return a preset's values as nested plain data."""
    nested: dict[str, Any] = {}
    for path, entry in _document(name, where)["values"].items():
        *groups, leaf = path.split(".")
        inner = nested
        for group in groups:
            inner = inner.setdefault(group, {})
        inner[leaf] = entry["value"]
    return nested


def _merged(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    return {**base, **dict(_merge_items(base, changes))}


def _merge_items(base: Mapping[str, Any], changes: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for key, value in changes.items():
        inner = base.get(key)
        if isinstance(inner, Mapping) and isinstance(value, Mapping):
            yield key, _merged(inner, value)
        else:
            yield key, value


def _document(name: str, where: str) -> dict[str, Any]:
    names = preset_names()
    if name not in names:
        near = difflib.get_close_matches(name, names, n=1)
        repair = f"did you mean '{near[0]}'?" if near else ""
        raise InputError(where, f"'{name}' is not known", f"needs one of {', '.join(names)}", repair)
    return _read(name)


def _folder() -> Traversable:
    return resources.files("fingerslip.specimens.fingertip").joinpath("presets")


@functools.cache
def _read(name: str) -> dict[str, Any]:
    text = _folder().joinpath(f"{name}.yaml").read_text(encoding="utf-8")
    document: dict[str, Any] = parse_document(text, f"{name}.yaml").content
    return document
