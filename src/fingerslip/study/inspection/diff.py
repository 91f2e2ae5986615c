"""Two runs side by side: the values in which they differ, and what came of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from fingerslip.report.tables.differences import differences_table
from fingerslip.report.tables.events import time_cell
from fingerslip.report.tables.measures import measures_table
from fingerslip.report.tables.table import Cell, Column, Measured, Table
from fingerslip.results import RunResult
from fingerslip.run_folder import RUN
from fingerslip.slip.names import LATENCY, READINGS, TIMES, event_label, is_defined
from fingerslip.study.storage.reporting import read_stored_run
from fingerslip.study.storage.values import read_specified, value_rows

__all__ = ["diff_runs"]

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
    values = {value.path: value.value for value in value_rows([read_specified(folder / RUN)])}
    return values | {f"version of {name}": version for name, version in run.versions.items()}


def _results_table(runs: tuple[RunResult, RunResult]) -> Table:
    measures = ((str(row[0]), str(row[1]), row[2], row[3]) for row in measures_table(runs, _SIDES).rows)
    rows = tuple((*row, _difference(*row[2:])) for row in (*_event_rows(runs), *measures))
    marked = tuple(number for number, row in enumerate(rows) if _is_clear(row[-1]))
    columns = (
        Column("result"),
        Column("unit"),
        *(Column(name, significant=5) for name in _SIDES),
        Column("B - A", significant=3),
    )
    known = any(run.uncertainty for run in runs)
    note = "After ±: numerical uncertainty; bold: the difference exceeds that of both runs." if known else ""
    return Table("Slip events and measures", columns, rows, note, marked)


def _event_rows(runs: tuple[RunResult, RunResult]) -> Iterator[tuple[str, str, Cell, Cell]]:
    for reading, words in READINGS.items():
        for time in (time for time in TIMES if is_defined(reading, time)):
            unit, factor = ("ms", 1e3) if time == LATENCY else ("s", 1.0)
            first, second = (time_cell(run, reading, time, factor) for run in runs)
            yield f"{event_label(time)} ({words})", unit, first, second


def _difference(first: Cell, second: Cell) -> Cell:
    """Return the difference of two cells, with the uncertainty of both where both are known; empty without numbers."""
    match first, second:
        case Measured(), Measured():
            uncertainty = math.hypot(first.uncertainty, second.uncertainty)
            return Measured(_beyond_rounding(first.value, second.value), uncertainty)
        case ((Measured() | int() | float()), (Measured() | int() | float())):
            return _beyond_rounding(_number(first), _number(second))
        case _:
            return None


def _beyond_rounding(first: float, second: float) -> float:
    return 0.0 if math.isclose(first, second, rel_tol=_ROUNDING) else second - first


def _number(cell: Measured | float) -> float:
    return cell.value if isinstance(cell, Measured) else cell


def _is_clear(difference: Cell) -> bool:
    return isinstance(difference, Measured) and abs(difference.value) > difference.uncertainty
