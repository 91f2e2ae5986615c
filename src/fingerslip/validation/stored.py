"""Rows that take long to compute: they are stored, and read back unless they are asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from fingerslip.digest import digest
from fingerslip.errors import FingerslipError, ResultError
from fingerslip.files import read_json, write_json
from fingerslip.study.definition.base import read_with_base
from fingerslip.study.storage.provenance import versions
from fingerslip.validation.rows import rows_mapping

__all__ = ["RowFile", "Stored", "stored_rows"]

R = TypeVar("R")
_READING = "reading"


@dataclass(frozen=True)
class Stored(Generic[R]):
    """Rows, and where they come from."""

    rows: tuple[R, ...]  # the rows
    origin: str = ""  # where they come from, in a sentence
    computed: bool = False  # whether they were computed, or read back


@dataclass(frozen=True)
class RowFile(Generic[R]):
    """Where rows of one kind are stored, and what makes them."""

    name: str  # name of the file, in the folder of all results or in its folder `reference`
    kind: str  # what the rows are called, such as 'intervals'
    command: str  # the command that computes them
    effort: str  # how long that takes, in words
    studies: tuple[str, ...]  # names of the studies that they are computed from
    row: Callable[..., R]  # dataclass of a row
    reading: Mapping[str, Any] = field(default_factory=dict)


def stored_rows(
    file: RowFile[R],
    studies: str | Path,
    results: str | Path,
    compute: Callable[[], Sequence[R]] | None = None,
) -> Stored[R]:
    """Return rows that are computed and stored, or else those that were stored last, or else those that ship."""
    if compute is not None:
        rows = tuple(compute())
        made = {"command": file.command, "version": versions()["fingerslip"], "inputs": _inputs(file, Path(studies))}
        write_json(Path(results) / file.name, {"made": made, "rows": rows_mapping(rows)})
        return Stored(rows, computed=True)
    for path in (Path(results) / file.name, Path(results) / "reference" / file.name):
        try:
            return _read(file, path, Path(studies))
        except FileNotFoundError:
            continue
    return Stored((), f"No {file.kind} are stored; {file.command} computes them, which takes {file.effort}.")


def _read(file: RowFile[R], path: Path, studies: Path) -> Stored[R]:
    stored: Any = read_json(path, f"run {file.command}")
    try:
        rows = tuple(file.row(**_values(entry)) for entry in stored["rows"])
        version, inputs = stored["made"]["version"], stored["made"]["inputs"]
    except (KeyError, TypeError) as error:
        raise ResultError(f"{path}: is of another version ({error}); run {file.command}") from error
    state = _state(inputs, _inputs(file, studies))
    again = f"{file.command} computes them again."
    return Stored(rows, f"{file.kind.capitalize()} are stored in {path} by fingerslip {version}; {state}. {again}")


def _state(then: Mapping[str, str], now: Mapping[str, str]) -> str:
    """Tell whether what rows were computed from is the same."""
    if {**then, _READING: now.get(_READING)} != {**now, _READING: now.get(_READING)}:
        return "the studies have changed since"
    is_read_alike = then.get(_READING) == now.get(_READING)
    return "the studies are the same" if is_read_alike else "how their runs are read has changed since"


def _values(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a row with tuples, which JSON has as lists."""
    return {name: tuple(value) if isinstance(value, list) else value for name, value in entry.items()}


def _inputs(file: RowFile[Any], studies: Path) -> dict[str, str]:
    """Return a hash of what each study holds, of one that cannot be read none, and of how the runs are read."""
    found = {_READING: digest(file.reading)} if file.reading else {}
    for name in file.studies:
        try:
            found[name] = digest([read_with_base(studies / f"{name}.yaml")])
        except FingerslipError:
            continue
    return found
