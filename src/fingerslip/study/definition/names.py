"""The names of runs, which are those of their folders: short, safe on every file system, and different."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from fingerslip.storage.files import digest
from fingerslip.units import without_rounding

__all__ = ["run_names"]

_LONGEST = 100
_UNSAFE = re.compile(r"[^A-Za-z0-9.+-]+")
_UNSAFE_IN_LABELS = re.compile(r"[^A-Za-z0-9_+-]+")


def run_names(combinations: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return a name for each run of a sweep, from the values that it has.

    Names keep signs, and twelve digits, or all where that does not tell runs apart. Where two values still look alike
    once what no folder may be called is taken out, as ``a b`` and ``a-b``, or differ only in case, a hash of the values
    does.

    Examples
    --------
    >>> run_names([{"fingertip.finger_angle": "-15 deg"}, {"fingertip.finger_angle": "15 deg"}])
    ['finger_angle--15deg', 'finger_angle-15deg']
    """
    exact = [_name(swept, str) for swept in combinations]
    names = _apart([_name(swept, without_rounding) for swept in combinations], exact)
    hashed = [f"{name}-{digest(dict(swept))[:8]}" for name, swept in zip(names, combinations, strict=True)]
    return _apart(names, hashed)


def _apart(names: Sequence[str], longer: Sequence[str]) -> list[str]:
    """Return names, and longer ones in the place of those that several runs have."""
    alike = Counter(name.lower() for name in names)
    return [name if alike[name.lower()] == 1 else other for name, other in zip(names, longer, strict=True)]


def _name(swept: Mapping[str, Any], digits: Callable[[str], str]) -> str:
    labels = _labels(tuple(swept))
    name = "_".join(f"{labels[path]}-{_slug(value, digits)}" for path, value in swept.items()) or "run"
    if len(name) <= _LONGEST:
        return name
    return f"{name[: _LONGEST - 9]}-{digest(name.encode())[:8]}"


def _labels(paths: Sequence[str]) -> dict[str, str]:
    """Return the shortest endings of the paths that tell them apart; 'x.enabled' is called 'x'."""
    keys_of_path = {path: path.removesuffix(".enabled").split(".") for path in paths}
    last = Counter(keys[-1] for keys in keys_of_path.values())
    return {
        path: _UNSAFE_IN_LABELS.sub("-", keys[-1] if last[keys[-1]] == 1 else "-".join(keys))
        for path, keys in keys_of_path.items()
    }


def _slug(value: object, digits: Callable[[str], str]) -> str:
    """Return a value as part of a name; `digits` rounds the numbers of a text, or leaves them."""
    if isinstance(value, Mapping):
        return "-".join(f"{_safe(str(key))}-{_slug(item, digits)}" for key, item in value.items()) or "none"
    if isinstance(value, list | tuple):
        return "_".join(_slug(item, digits) for item in value) or "none"
    if isinstance(value, float):
        value = float(digits(repr(value)))
        short = f"{value:g}"
        return short if float(short) == value else repr(value)
    text = str(value).lower() if isinstance(value, bool) else digits(str(value))
    compact = re.sub(r"(?<=\d)\s+(?=[A-Za-z])", "", text).replace("/", "-per-").replace("µ", "u")
    return _safe(compact).rstrip("-.") or "value"


def _safe(text: str) -> str:
    """Return text with every stretch of characters replaced that no folder should have in its name."""
    return _UNSAFE.sub("-", text)
