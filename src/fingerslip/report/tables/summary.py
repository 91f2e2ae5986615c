"""The summary of a study as a table for other programs: a row for each run, in SI units."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from fingerslip.report.labels import swept_text
from fingerslip.report.tables.events import swept_paths
from fingerslip.report.tables.table import Cell, Column, Table
from fingerslip.results import RefusedRun, RunResult
from fingerslip.slip import measures
from fingerslip.slip.windows import READINGS, TIMES, defines_time
from fingerslip.units import si_quantity, unit_suffix

__all__ = ["summary_table", "summary_units"]


def summary_table(runs: Sequence[RunResult], refused: Sequence[RefusedRun] = ()) -> Table:
    """Put the slip events and measures of all runs into one table: one row per run, SI units, full precision.

    The columns are ``run``, its name; the swept paths, in a study with samples also ``sample``, its number, and the
    sampled paths, as numbers with their SI unit in the name, such as ``mesh.contact_size_m``, or as words; then
    ``incipient_s, noticed_s, three_quarter_s, overall_s, latency_s`` from accumulated slip, and the same with
    ``_displacement`` and ``_acceleration``, as far as the reading defines them (``noticed_s`` is when 48 % of the
    contact slips, the share at which people notice it: Barrea et al. 2018); then ``readings_recorded``, the
    readings whose signals the run recorded, so that an empty time says that the event did not happen where its
    reading is named and that it was not recorded where it is not; then the measures, such as
    ``normal_force_max_N``; then derived quantities; then the numerical uncertainties that are known, such as
    ``slip_overall_uncertainty_s``; then, in a study with samples, ``refused``: why a sample was not computed. Such
    rows stand at the end.
    """
    columns = _columns(runs, refused)
    rows = tuple(tuple(column.of_run(run) for column in columns) for run in runs)
    without = tuple(tuple(column.of_refused(sample) for column in columns) for sample in refused)
    return Table("Slip events and measures", tuple(Column(column.name) for column in columns), (*rows, *without))


def summary_units(runs: Sequence[RunResult], refused: Sequence[RefusedRun] = ()) -> dict[str, str]:
    """Return the SI units of the columns of a summary by their names; pure numbers and words have none."""
    return {column.name: column.unit for column in _columns(runs, refused) if column.unit}


@dataclass(frozen=True)
class _Known:
    """A column of the summary: its name and SI unit, and what stands there for a run and for a refused sample."""

    name: str
    unit: str
    of_run: Callable[[RunResult], Cell]
    of_refused: Callable[[RefusedRun], Cell] = lambda _: None


def _columns(runs: Sequence[RunResult], refused: Sequence[RefusedRun]) -> list[_Known]:
    sampled = tuple(dict.fromkeys(path for run in runs for path in run.sampled))
    paths, keys = (*swept_paths(runs), *sampled), dict.fromkeys(key for run in runs for key in run.uncertainty)
    columns = [
        _Known("run", "", lambda run: run.name, lambda one: one.name),
        *(_swept_column(path, (*runs, *refused)) for path in paths),
        *(_time_column(reading, time) for reading in READINGS for time in TIMES if defines_time(reading, time)),
        _Known("readings_recorded", "", _reading_cell),
        *(_measure_column(measure) for measure in measures.MEASURES),
        *(_derived_column(name, runs) for name in dict.fromkeys(name for run in runs for name in run.derived)),
        *(_uncertainty_column(key) for key in keys),
    ]
    return [*columns, _Known("refused", "", lambda _: "", lambda one: one.reason)] if sampled else columns


def _swept_column(path: str, runs: Sequence[RunResult | RefusedRun]) -> _Known:
    """Return the column of a swept path: numbers in one SI unit, or words where not all are quantities of one kind."""
    quantities = [_quantity(_swept(run, path)) for run in runs]
    units = {quantity[1] for quantity in quantities if quantity}
    if not (all(quantities) and len(units) == 1):
        return _Known(path, "", *(2 * [lambda run: swept_text(_swept(run, path))]))
    (unit,) = units
    return _Known(f"{path}_{unit_suffix(unit)}", unit, *(2 * [lambda run: _si_value(_swept(run, path))]))


def _swept(run: RunResult | RefusedRun, path: str) -> Any:
    return {**run.swept, **run.sampled}.get(path)


def _quantity(value: object) -> tuple[float, str] | None:
    return si_quantity(value) if isinstance(value, str) else None


def _si_value(value: object) -> float | None:
    quantity = _quantity(value)
    return quantity[0] if quantity else None


def _time_column(reading: str, time: str) -> _Known:
    suffix = "" if reading == "slip" else f"_{reading}"
    return _Known(f"{time}_s{suffix}", "s", lambda run: run.events.reading(reading).time(time))


def _reading_cell(run: RunResult) -> Cell:
    return " ".join(reading for reading in READINGS if run.events.reading(reading).recorded)


def _measure_column(measure: measures.Measure) -> _Known:
    return _Known(measure.key, measure.unit.si if measure.unit else "", lambda run: run.numbers.get(measure.key))


def _derived_column(name: str, runs: Sequence[RunResult]) -> _Known:
    """Return the column of a derived quantity, with its unit in the name: `slip_travel_m`."""
    unit = next(run.derived[name].unit for run in runs if name in run.derived)
    heading = f"{name}_{unit_suffix(unit)}" if unit else name
    return _Known(heading, unit, lambda run: run.derived[name].value if name in run.derived else None)


def _uncertainty_column(key: str) -> _Known:
    """Return the column of an uncertainty: `slip_overall_uncertainty_s`, `normal_force_max_uncertainty_N`."""
    measure = measures.measure_of(key)
    if measure is None:
        return _Known(f"{key.replace('.', '_')}_uncertainty_s", "s", lambda run: run.uncertainty.get(key))
    name = f"{measure.name}_uncertainty{measure.key.removeprefix(measure.name)}"
    return _Known(name, measure.unit.si if measure.unit else "", lambda run: run.uncertainty.get(key))
