"""What reports say: the texts of ``templates/prose.yaml``."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from importlib import resources
from types import MappingProxyType
from typing import Any

from fingerslip.parameters.yaml_text import parse_document

_NOTHING: Mapping[str, object] = MappingProxyType({})


def asset(name: str) -> str:
    """Return a file of the folder of templates."""
    return resources.files("fingerslip.report").joinpath("templates", name).read_text(encoding="utf-8")


@functools.cache
def groups() -> Mapping[str, Mapping[str, Any]]:
    """Return all texts by the group and the name."""
    content: Mapping[str, Mapping[str, Any]] = parse_document(asset("prose.yaml"), "prose.yaml").content
    return content


def prose(group: str, name: str, values: Mapping[str, object] = _NOTHING) -> str:
    """Return a text with the values that stand in it by their names.

    Examples
    --------
    >>> prose("captions", "energy", {"run": ": phalanx original"})
    'Where the work of the plate goes: phalanx original.'
    """
    return str(groups()[group][name]).format_map(values)
