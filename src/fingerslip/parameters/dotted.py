"""Dotted paths such as ``programme.0.press.depth`` in nested plain data."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any


def join_path(*parts: str) -> str:
    """Return a dotted path from its parts; empty ones are left out."""
    return ".".join(part for part in parts if part)


def is_below(path: str, group: str) -> bool:
    """Tell whether `path` is `group` or inside it."""
    return path == group or path.startswith(f"{group}.")


def walk(values: object, path: str = "") -> Iterator[str]:
    """Yield the path of every value inside nested mappings and lists, groups before what they hold."""
    inside = dict(enumerate(values)) if isinstance(values, list | tuple) else values
    for key, item in inside.items() if isinstance(inside, Mapping) else ():
        inner = join_path(path, str(key))
        yield inner
        yield from walk(item, inner)


def known_part(path: str, paths: Collection[str]) -> str:
    """Return the longest leading part of a path that is among `paths`; empty where none is."""
    while path and path not in paths:
        path = path.rpartition(".")[0]
    return path


def nearest(path: str, names: Sequence[str]) -> str | None:
    """Return the known path most like `path`: by its last part where that exists, else by its letters."""
    last = path.rsplit(".", 1)[-1]
    same_last = [other for other in names if other.rsplit(".", 1)[-1] == last]
    matches = difflib.get_close_matches(path, same_last or names, n=1, cutoff=0.0 if same_last else 0.5)
    return matches[0] if matches else None


def guesses(key: str, paths: Iterable[str]) -> str:
    """Return the question after paths whose last part is a key or begins with that word; empty without any."""
    alike = dict.fromkeys(path for path in paths if f"{path.rpartition('.')[2]}_".startswith(f"{key}_"))
    listed = "' or '".join([*alike][:4])
    return f"did you mean '{listed}'?" if alike else ""


def assign(values: dict[str, Any], path: str, value: object) -> None:
    """Put a value into nested plain data, in place; groups that are missing on the way are made."""
    *groups, last = path.split(".")
    inner: Any = values
    for key in groups:
        if isinstance(inner, dict) and inner.get(key) is None:
            inner[key] = {}
        inner = inner[_key(inner, key, path)]
    inner[_key(inner, last, path)] = value


def _key(inner: object, key: str, path: str) -> str | int:
    if isinstance(inner, dict):
        return key
    if isinstance(inner, list) and key.isdecimal() and int(key) < len(inner):
        return int(key)
    raise LookupError(path)


def flatten(mapping: Mapping[str, Any]) -> dict[str, Any]:
    """Turn nested plain data into values by dotted path."""
    flat: dict[str, Any] = {}
    for key, value in mapping.items():
        inner = dict(enumerate(value)) if isinstance(value, list | tuple) else value
        if isinstance(inner, Mapping) and inner:
            flat |= {f"{key}.{path}": leaf for path, leaf in flatten({str(k): v for k, v in inner.items()}).items()}
        else:
            flat[key] = value
    return flat
