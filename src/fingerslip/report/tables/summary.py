"""The summary of a study as a table for other programs: a row for each run, in SI units."""

from __future__ import annotations

from collections.abc import Sequence

from fingerslip.report.labels import swept_text
from fingerslip.report.tables.events import swept_paths
from fingerslip.report.tables.table import Cell, Column, Table
from fingerslip.results import RefusedRun, RunResult
from fingerslip.slip import measures
from fingerslip.slip.names import LATENCY, MAIN_EVENTS, READINGS

__all__ = ["summary_table"]

_TIMES = (*MAIN_EVENTS, LATENCY)


def summary_table(runs: Sequence[RunResult], refused: Sequence[RefusedRun] = ()) -> Table:
    """Put the slip events and measures of all runs into one table: one row per run, SI units, full precision.

    The columns are the swept paths, in a study with samples also ``sample``, its number, and the sampled paths; then
    ``incipient_s, three_quarter_s, overall_s, latency_s`` from accumulated slip, and the same four with
    ``_displacement`` and ``_acceleration``; then ``readings_recorded``, the readings whose signals the run recorded,
    so that an empty time says that the event did not happen where its reading is named and that it was not recorded
    where it is not; then the measures, such as ``normal_force_max_N``; then the numerical uncertainties that are known,
    such as ``slip_overall_uncertainty_s``; then, in a study with samples, ``refused``: why a sample was not computed.
    Such rows stand at the end.

    Parameters
    ----------
    runs : sequence of RunResult
        The finished runs.
    refused : sequence of RefusedRun, optional
        Samples that were not computed.
    """
    keys = [measure.key for measure in measures.MEASURES]
    sampled = tuple(dict.fromkeys(path for run in runs for path in run.sampled))
    paths, last = (*swept_paths(runs), *sampled), ("refused",) if sampled else ()
    known = list(dict.fromkeys(key for run in runs for key in run.uncertainty))
    names = [f"{time}_s{_suffix(reading)}" for reading in READINGS for time in _TIMES]
    columns = (*paths, *names, "readings_recorded", *keys, *(_uncertainty_name(key) for key in known), *last)
    rows = tuple(
        (
            *_values(run, paths),
            *_times(run),
            " ".join(reading for reading in READINGS if run.events.reading(reading).recorded),
            *(run.numbers.get(key) for key in keys),
            *(run.uncertainty.get(key) for key in known),
            *("" for _ in last),
        )
        for run in runs
    )
    empty = (None,) * (len(columns) - len(paths) - 1)
    without = tuple((*_values(one, paths), *empty, one.reason) for one in refused)
    return Table("Slip events and measures", tuple(Column(name) for name in columns), (*rows, *without))


def _values(run: RunResult | RefusedRun, paths: Sequence[str]) -> list[Cell]:
    values = {**run.swept, **run.sampled}
    return [swept_text(values.get(path)) for path in paths]


def _times(run: RunResult) -> list[Cell]:
    return [run.events.reading(reading).time(time) for reading in READINGS for time in _TIMES]


def _suffix(reading: str) -> str:
    return "" if reading == "slip" else f"_{reading}"


def _uncertainty_name(key: str) -> str:
    """Name the column of an uncertainty: `slip_overall_uncertainty_s`, `normal_force_max_uncertainty_N`."""
    measure = measures.measure_of(key)
    if measure is None:
        return f"{key.replace('.', '_')}_uncertainty_s"
    return f"{measure.name}_uncertainty{measure.key.removeprefix(measure.name)}"
