"""``fingerslip show``: presets, studies and results as tables."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from fingerslip.errors import InputError
from fingerslip.parameters import walk_quantities
from fingerslip.report.tables.events import RunEvents, flatten, ways_table
from fingerslip.report.tables.table import Column, Table
from fingerslip.slip import events_from_mapping
from fingerslip.specimens.fingertip import preset_header, preset_names, preset_table
from fingerslip.study.convergence.uncertainties import read_uncertainties
from fingerslip.study.definition.spec import Study, read_study
from fingerslip.study.definition.yaml import read_mapping
from fingerslip.study.inspection.draw import draw_fingertip
from fingerslip.study.storage.reporting import event_tables, read_stored
from fingerslip.study.storage.store import read_result
from fingerslip.units import Unit

__all__ = ["presets_table", "show"]

_VALUE_COLUMNS = (Column("value of"), Column("is"), Column("source"), Column("note"))
_STUDY_FILE = "study file"


def show(target: str = "", figure: Path | None = None) -> tuple[Table, ...]:
    """Return tables of a preset, of a study file, or of a folder of results.

    Parameters
    ----------
    target : str, optional
        Name of a preset, or a path; without it the presets are listed.
    figure : Path, optional
        Picture of the fingertip to write, of a preset or a study.

    Returns
    -------
    tuple of Table
        Values with unit and source, the assumed ones first; or the events and numbers of a result.

    Raises
    ------
    InputError
        Where nothing has that name, or it has no fingertip to draw.
    ResultError
        Where a folder holds no results, or the picture cannot be written.
    """
    if figure is not None:
        draw_fingertip(target, figure)
    return _tables(target) if target else (presets_table(),)


def _tables(target: str) -> tuple[Table, ...]:
    path = Path(target)
    if path.is_dir():
        return _show_result(path)
    if path.suffix in (".yaml", ".yml"):
        return (_study_table(path),)
    if target in preset_names():
        return (_preset_table(target),)
    repair = f"presets: {', '.join(preset_names())}"
    raise InputError(f"show {target}", "is not there", "needs a preset, a study file or a folder of results", repair)


def presets_table() -> Table:
    """Return the presets that ship."""
    rows = tuple((name, preset_header(name)["citation"]) for name in preset_names())
    return Table("Presets", (Column("name"), Column("after")), rows, "fingerslip show NAME lists all values.")


def _preset_table(name: str) -> Table:
    header = preset_header(name)
    rows = tuple((row.path, row.value, row.source, row.note) for row in preset_table(name))
    return Table(f"{name}: {header['citation']}", _VALUE_COLUMNS, rows, f"{header['published']} {header['claims_not']}")


def _study_table(path: Path) -> Table:
    given = flatten(read_mapping(path))
    study = read_study(path)
    rows = [*_fingertip_rows(study, given), *_own_rows(study, given)]
    ordered = sorted((_swept(row, study) for row in rows), key=lambda row: row[2] != "assumed")
    return Table(f"{path}: {study.title}", _VALUE_COLUMNS, tuple(ordered), "The assumed values come first.")


Row = tuple[str, str, str, str]


def _fingertip_rows(study: Study, given: Mapping[str, Any]) -> Iterator[Row]:
    """Yield the values of the preset, those that the study changes with its own."""
    if study.fingertip is None:
        return
    for entry in preset_table(str(study.fingertip["preset"])):
        path = f"fingertip.{entry.path}"
        if path in given:
            yield path, _text(given[path]), _STUDY_FILE, f"preset: {entry.value}"
        else:
            yield path, entry.value, entry.source, entry.note


def _own_rows(study: Study, given: Mapping[str, Any]) -> Iterator[Row]:
    """Yield the values of the study file itself, and the defaults of those that it leaves out."""
    others = {path: value for path, value in given.items() if not path.startswith(("sweep.", "fingertip."))}
    for path, value in others.items():
        yield path, _text(value), _STUDY_FILE, ""
    for path, value, unit in walk_quantities(study):
        absent = value is None or value in ((), {}, "")
        if absent or any(path == other or other.startswith(f"{path}.") for other in given):
            continue
        yield path, _text(value, unit), "default", ""


def _swept(row: Row, study: Study) -> Row:
    path, _, _, note = row
    if path not in study.sweep:
        return row
    return path, ", ".join(_text(value) for value in study.sweep[path]), f"{_STUDY_FILE}, swept", note


def _text(value: object, unit: Unit | None = None) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(_text(item, unit) for item in value)
    if unit is not None and isinstance(value, int | float):
        return unit.format(value)
    return str(value).lower() if isinstance(value, bool) else str(value)


def _show_result(folder: Path) -> tuple[Table, ...]:
    result = read_result(folder)
    if result is None:
        stored = read_stored(folder)
        return event_tables(stored.runs, stored.compare)
    numbers = tuple((name, value) for name, value in result["numbers"].items())
    versions = ", ".join(f"{name} {version}" for name, version in result["versions"].items())
    uncertainty = read_uncertainties(folder.parent, {folder.name: result["identity"]}).get(folder.name, {})
    events = RunEvents(folder.name, result["swept"], events_from_mapping(result["events_s"]), {}, uncertainty)
    return (
        ways_table(events, f"Slip events of {folder}"),
        Table("Key numbers", (Column("name"), Column("value")), numbers, f"{result['wall_time_s']} s with {versions}"),
        _swept_table(result),
    )


def _swept_table(result: Mapping[str, Any]) -> Table:
    rows = tuple((path, json.dumps(value)) for path, value in result["swept"].items())
    return Table("Swept values", (Column("path"), Column("value")), rows)
