"""``fingerslip show``: presets, studies and results as tables."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from fingerslip.errors import InputError
from fingerslip.history import read_history
from fingerslip.materials.choice import material_header, material_names, material_table
from fingerslip.parameters.presets import PresetValue
from fingerslip.report.tables.compare import differences_table
from fingerslip.report.tables.parameters import ASSUMED, COLUMNS, NOT_USED
from fingerslip.report.tables.runs import measures_table, readings_table, time_cell
from fingerslip.results import HISTORY, RESULT, RUN, RunResult
from fingerslip.slip.windows import LATENCY, READINGS, TIMES, defines_time, event_label
from fingerslip.specimens.choice import preset_names, presets_of
from fingerslip.study.definition.runs import read_runs
from fingerslip.study.opened import open_study
from fingerslip.study.storage.reporting import read_results, read_stored_run, study_tables
from fingerslip.study.storage.summary import read_manifest
from fingerslip.study.storage.values import read_run_values, value_rows
from fingerslip.tables.table import Cell, Column, Measured, Table


def show(target: str = "", figure: Path | None = None) -> tuple[Table, ...]:
    """Return tables of a preset or a material that ships, of a study file, or of a folder of results.

    Parameters
    ----------
    target : str, optional
        Name of a preset or a material, or a path; without it both are listed.
    figure : Path, optional
        Picture of the fingertip or the sensor to write, of a preset or a study.

    Returns
    -------
    tuple of Table
        Values with unit and source, the assumed ones first; or the events and numbers of a result.

    Raises
    ------
    InputError
        Where nothing has that name, or it has no specimen to draw.
    ResultError
        Where a folder holds no results, or the picture cannot be written.
    """
    if figure is not None:
        from fingerslip.study.inspection.specimen import draw_specimen

        draw_specimen(target, figure)
    return _tables(target) if target else (presets_table(), materials_table())


def _tables(target: str) -> tuple[Table, ...]:
    path = Path(target)
    if path.is_dir():
        return _show_result(path)
    if path.suffix in (".yaml", ".yml"):
        return (_study_table(path),)
    if target in preset_names():
        presets = presets_of(target)
        return (_preset_table(target, presets.header(target), presets.table(target)),)
    if target in material_names():
        return (_preset_table(target, material_header(target), material_table(target)),)
    repair = f"presets: {', '.join((*preset_names(), *material_names()))}"
    raise InputError(f"show {target}", "is not there", "needs a preset, a study file or a folder of results", repair)


def presets_table() -> Table:
    """Return the presets that ship."""
    rows = tuple((name, presets_of(name).header(name)["citation"]) for name in preset_names())
    return Table("Presets", (Column("name"), Column("after")), rows, "fingerslip show NAME lists all values.")


def materials_table() -> Table:
    """Return the materials that ship."""
    rows = tuple((name, material_header(name)["citation"]) for name in material_names())
    return Table(
        "Materials", (Column("name"), Column("after")), rows, "In study files: materials: {REGION: {preset: NAME}}."
    )


def _preset_table(name: str, header: Mapping[str, str], values: Sequence[PresetValue]) -> Table:
    rows = tuple((row.path, row.value, row.source, row.note) for row in values)
    return Table(f"{name}: {header['citation']}", COLUMNS, rows, f"{header['published']} {header['claims_not']}")


def _study_table(path: Path) -> Table:
    expansion = read_runs(path)
    shown_values = value_rows(expansion.runs, expansion.given)
    values = sorted(shown_values, key=lambda value: (value.source == NOT_USED, value.source != ASSUMED))
    rows = tuple((value.path, value.value, value.source, value.note) for value in values)
    return Table(f"{path}: {expansion.study.title}", COLUMNS, rows, "The assumed values come first.")


def _show_result(folder: Path) -> tuple[Table, ...]:
    if not (folder / RESULT).exists():
        return study_tables(read_results(folder))
    result = read_stored_run(folder)
    versions = ", ".join(f"{name} {version}" for name, version in result.versions.items())
    measures = measures_table([result], ["value"])
    swept = tuple((path, json.dumps(value)) for path, value in result.swept.items())
    return (
        readings_table(result, f"Slip events of {folder}"),
        dataclasses.replace(measures, note=f"Computed in {result.seconds} s with {versions}."),
        Table("Swept values", (Column("path"), Column("value")), swept),
    )


_SIDES = ("A", "B")
# Relative difference that sums of thousands of steps may have without a reason.
_ROUNDING = 1e-9


def diff_runs(first: str | Path, second: str | Path) -> tuple[Table, ...]:
    """Compare two finished runs, of one study or of two."""
    runs = read_stored_run(first), read_stored_run(second)
    values = _values(Path(first), runs[0]), _values(Path(second), runs[1])
    differ = differences_table(
        *values, same="Both have the same values and versions.", note=f"A: {first}; B: {second}."
    )
    return differ, _results_table(runs)


def _values(folder: Path, run: RunResult) -> dict[str, str]:
    """Return the values of a run as people read them, and the versions of the programs that made it."""
    values = {value.path: value.value for value in value_rows([read_run_values(folder / RUN)])}
    return values | {f"version of {name}": version for name, version in run.versions.items()}


def _results_table(runs: tuple[RunResult, RunResult]) -> Table:
    events: list[tuple[Cell, ...]] = []
    for reading, words in READINGS.items():
        for time in (time for time in TIMES if defines_time(reading, time)):
            unit, factor = ("ms", 1e3) if time == LATENCY else ("s", 1.0)
            cells = (time_cell(run, reading, time, factor) for run in runs)
            events.append((f"{event_label(time)} ({words})", unit, *cells))
    rows = tuple((*row, _difference(row[2], row[3])) for row in (*events, *measures_table(runs, _SIDES).rows))
    clear = [isinstance(row[-1], Measured) and abs(row[-1].value) > row[-1].uncertainty for row in rows]
    columns = (
        Column("result"),
        Column("unit"),
        *(Column(name, significant=5) for name in _SIDES),
        Column("B - A", significant=3),
    )
    has_uncertainty = any(run.uncertainty for run in runs)
    note = "After ±: numerical uncertainty; bold: the difference exceeds that of both runs." if has_uncertainty else ""
    marked = tuple(number for number, is_clear in enumerate(clear) if is_clear)
    return Table("Slip events and measures", columns, rows, note, marked)


def _difference(first: Cell, second: Cell) -> Cell:
    """Return the difference of two cells, with the uncertainty of both where both are known; empty without numbers."""
    numbers = [cell.value if isinstance(cell, Measured) else cell for cell in (first, second)]
    if not all(isinstance(number, int | float) for number in numbers):
        return None
    low, high = map(float, numbers)  # type: ignore[arg-type]
    difference = 0.0 if math.isclose(low, high, rel_tol=_ROUNDING) else high - low
    if isinstance(first, Measured) and isinstance(second, Measured):
        return Measured(difference, math.hypot(first.uncertainty, second.uncertainty))
    return difference


def export_result(target: Path, kind: str, output: Path | None = None) -> Path:
    """Write a result for other programs, whole or not at all."""
    # Data frames and the formats are slow to load: what is wrong with the result is said before.
    folder = output or target / f"export-{kind}"
    if read_manifest(target).get("runs"):
        study = open_study(target)
        from fingerslip.export.formats import export_tables

        return export_tables({"runs": study.to_dataframe()}, folder, kind)
    read_stored_run(target)
    from fingerslip.export.formats import export_history

    return export_history(read_history(target / HISTORY), folder, kind)
