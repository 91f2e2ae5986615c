"""Sweeps: the runs of a study, each with all its values and a name for its folder."""

from __future__ import annotations

import copy
import difflib
import hashlib
import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fingerslip.errors import InputError
from fingerslip.parameters import as_mapping
from fingerslip.specimens.protocol import Specimen
from fingerslip.study.definition.spec import Study, parse_study, study_mapping

__all__ = ["Run", "expand", "known_paths"]

_LONGEST_NAME = 100
_NOT_SWEPT = ("title", "sweep", "compare", "converge")


@dataclass(frozen=True)
class Run:
    """One run of a study.

    Parameters
    ----------
    name : str
        Name of its folder, from the swept values.
    where : str
        Its name in errors: the study file, and the swept values.
    swept : mapping of str to object
        The swept values by dotted path, as the study file writes them.
    study : Study
        The study with these values, without a sweep.
    specimen : Specimen or None
        The specimen with all its values.
    """

    name: str
    where: str
    swept: Mapping[str, Any]
    study: Study
    specimen: Specimen | None

    def resolved(self) -> dict[str, Any]:
        """Return everything that makes the run as plain data, which is a study file of its own."""
        mapping = study_mapping(self.study)
        kind = self.study.specimen_kind
        if kind is not None:
            mapping[kind] = {"preset": mapping[kind]["preset"], **as_mapping(self.specimen)}
        named = f"{mapping['title']}: {self.name}" if self.swept else mapping["title"]
        kept = {key: value for key, value in mapping.items() if key not in _NOT_SWEPT}
        result: dict[str, Any] = _without_empty({"title": named, **kept})
        return result


def expand(study: Study, source: Path) -> tuple[Run, ...]:
    """Return the runs of a study, all of them checked; the first swept path varies slowest.

    Parameters
    ----------
    study : Study
        The study.
    source : Path
        Its file, which errors name and to which paths of mesh files are relative.

    Raises
    ------
    InputError
        For a swept path that does not exist, or a value that does not fit there.
    """
    base = study_mapping(study)
    known = known_paths(study, source)
    for path in study.sweep:
        _check_path(path, known, source)
    combinations = [dict(zip(study.sweep, values, strict=True)) for values in itertools.product(*study.sweep.values())]
    names = _names(combinations)
    return tuple(_run(base, swept, name, source) for swept, name in zip(combinations, names, strict=True))


def known_paths(study: Study, source: Path) -> tuple[str, ...]:
    """Return every dotted path that a sweep of this study may name."""
    mapping = study_mapping(study)
    if study.specimen_kind is not None:
        mapping[study.specimen_kind] = {"preset": "", **as_mapping(study.specimen(str(source)))}
    return tuple(path for key in mapping if key not in _NOT_SWEPT for path in _paths(mapping[key], key))


def _paths(value: object, path: str) -> Iterator[str]:
    yield path
    items: Sequence[tuple[object, object]] = ()
    if isinstance(value, Mapping):
        items = tuple(value.items())
    elif isinstance(value, list):
        items = tuple(enumerate(value))
    for key, item in items:
        yield from _paths(item, f"{path}.{key}")


def _check_path(path: str, known: Sequence[str], source: Path) -> None:
    if path in known:
        return
    near = _nearest(path, known)
    repair = f"did you mean '{near}'?" if near else "fingerslip show STUDY lists all paths"
    raise InputError(f"{source}: sweep.{path}", "is not known", "needs the dotted path of a value of the study", repair)


def _nearest(path: str, known: Sequence[str]) -> str | None:
    """Return the known path most like `path`: by its last name where that exists, else by its letters."""
    leaf = path.rsplit(".", 1)[-1]
    same_leaf = [other for other in known if other.rsplit(".", 1)[-1] == leaf]
    matches = difflib.get_close_matches(path, same_leaf or known, n=1, cutoff=0.0 if same_leaf else 0.5)
    return matches[0] if matches else None


def _run(base: Mapping[str, Any], swept: Mapping[str, Any], name: str, source: Path) -> Run:
    mapping = copy.deepcopy({**base, "sweep": {}})
    for path, value in swept.items():
        _assign(mapping, path.split("."), copy.deepcopy(value))
    study = parse_study(mapping, source)
    values = ", ".join(f"{path} = {value}" for path, value in swept.items())
    where = f"{source} ({values})" if swept else str(source)
    return Run(name, where, dict(swept), study, study.specimen(str(source)))


def _assign(mapping: Any, keys: Sequence[str], value: object) -> None:
    """Put `value` at the place that `keys` name, making the groups on the way."""
    inner = mapping
    for key in keys[:-1]:
        if isinstance(inner, list):
            inner = inner[int(key)]
            continue
        if inner.get(key) is None:
            inner[key] = {}
        inner = inner[key]
    inner[int(keys[-1]) if isinstance(inner, list) else keys[-1]] = value


def _names(combinations: Sequence[Mapping[str, Any]]) -> list[str]:
    """Name the folders, short and each of them once, on file systems that take no notice of case too."""
    names: list[str] = []
    taken: set[str] = set()
    for swept in combinations:
        name = plain = _name(swept)
        number = 1
        while name.lower() in taken:
            number += 1
            name = f"{plain}-{number}"
        taken.add(name.lower())
        names.append(name)
    return names


def _name(swept: Mapping[str, Any]) -> str:
    labels = _labels(tuple(swept))
    name = "_".join(f"{labels[path]}-{_slug(value)}" for path, value in swept.items()) or "run"
    if len(name) <= _LONGEST_NAME:
        return name
    return f"{name[: _LONGEST_NAME - 9]}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"


def _labels(paths: Sequence[str]) -> dict[str, str]:
    """Return the shortest endings of the paths that tell them apart; 'x.enabled' is called 'x'."""
    clean = {path: path.removesuffix(".enabled").split(".") for path in paths}
    labels = {path: parts[-1] for path, parts in clean.items()}
    repeated = [path for path in paths if list(labels.values()).count(labels[path]) > 1]
    return labels | {path: "-".join(clean[path]) for path in repeated}


def _slug(value: object) -> str:
    if isinstance(value, list | tuple):
        return "_".join(_slug(item) for item in value)
    if isinstance(value, int | float) and not isinstance(value, bool):
        return f"{value:g}"
    text = str(value).lower() if isinstance(value, bool) else str(value)
    compact = re.sub(r"(?<=\d)\s+(?=[A-Za-z])", "", text).replace("/", "-per-").replace("µ", "u")
    return re.sub(r"[^A-Za-z0-9.+-]+", "-", compact).strip("-.") or "value"


def _without_empty(value: Any) -> Any:
    """Leave out what was not given, so that the written run reads like a study file."""
    if isinstance(value, Mapping):
        return {key: _without_empty(item) for key, item in value.items() if item is not None and item not in ({}, [])}
    return [_without_empty(item) for item in value] if isinstance(value, list) else value
