"""Study files that start from another one: ``base: other.yaml`` and what differs from it."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fingerslip.errors import InputError, shortened
from fingerslip.study.definition.yaml import read_mapping

__all__ = ["BASE", "read_with_base"]

#: The key that names the base of a study file.
BASE = "base"


def read_with_base(path: Path) -> dict[str, Any]:
    """Read a study file, and what it does not write from its base.

    Groups are merged key by key; anything else that is written replaces what the base has, lists as a whole.
    """
    files, mappings = [path], [read_mapping(path)]
    while BASE in mappings[-1]:
        base = _base_of(files[-1], mappings[-1].pop(BASE))
        if base in files:
            names = shortened(" -> ".join(file.name for file in (*files, base)))
            found = f"leads back to {base.name} ({names})"
            raise InputError(f"{files[-1]}: {BASE}", found, "needs a file without this one as base")
        files.append(base)
        mappings.append(read_mapping(base))
    return functools.reduce(_merged, reversed(mappings))


def _base_of(path: Path, name: object) -> Path:
    """Return the file of a base, which is in the folder of the study, as paths of mesh files are."""
    if not isinstance(name, str) or not name or Path(name).name != name:
        found = f"got {shortened(repr(name))}"
        raise InputError(f"{path}: {BASE}", found, "needs the name of a study file in the same folder", "copy it there")
    return path.with_name(name)


def _merged(base: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    found = dict(base)
    for key, value in own.items():
        inner = None if key == "sweep" else base.get(key)
        found[key] = _merged(inner, value) if isinstance(inner, Mapping) and isinstance(value, Mapping) else value
    return found
