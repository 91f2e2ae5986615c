"""Tables of slip events and acceleration peaks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from fingerslip.report.labels import path_labels, run_title, swept_text
from fingerslip.report.tables.table import Cell, Column, Measured, Missing, Table
from fingerslip.results import RunResult
from fingerslip.slip import PeakTable
from fingerslip.slip.front import edge_warning
from fingerslip.slip.windows import EVENTS, LATENCY, NOTICED_NOTE, READINGS, defines_time

__all__ = [
    "events_table",
    "peaks_table",
    "readings_table",
    "run_notes",
    "swept_cells",
    "swept_columns",
    "swept_paths",
    "time_cell",
    "time_digits",
]

# Digits of a time [s] that a step of 1 ms and less allows.
_MOST_DIGITS = 3


def time_cell(run: RunResult, reading: str, time: str, factor: float = 1.0) -> Cell:
    """Return the time of an event, or the latency, with its uncertainty where that is known; else why there is none."""
    events = run.events.reading(reading)
    value = events.time(time)
    if not defines_time(reading, time):
        return Missing.NOT_DEFINED
    if value is None:
        return Missing.NO_EVENT if events.recorded else Missing.NOT_RECORDED
    uncertainty = run.uncertainty.get(f"{reading}.{time}")
    return factor * value if uncertainty is None else Measured(factor * value, factor * uncertainty)


def events_table(runs: Sequence[RunResult], reading: str = "slip") -> Table:
    """Show the slip events of all runs in one reading."""
    columns = (*swept_columns(runs), *_event_columns(runs))
    rows = tuple((*swept_cells(run, runs), *_event_cells(run, reading)) for run in runs)
    return Table(f"Slip events from {READINGS[reading]}", columns, rows, _notes(runs, [reading]))


def readings_table(run: RunResult, title: str = "Slip events") -> Table:
    """Show the slip events of one run, a row for each reading."""
    rows = tuple((words, *_event_cells(run, reading)) for reading, words in READINGS.items())
    return Table(title, (Column("read from"), *_event_columns([run])), rows, _notes([run], READINGS))


def peaks_table(peaks: PeakTable, title: str = "Acceleration peaks") -> Table:
    """Show the acceleration peaks of one run, the most prominent first."""
    columns = (
        Column("rank"),
        Column("time", "s", 3),
        Column("height", "m/s²", 3),
        Column("prominence", "m/s²", 3),
        Column("over noise", "", 1),
    )
    spread = peaks.noise_spread
    rows = tuple(
        (rank, peak.time, peak.height, peak.prominence, peak.prominence / spread if spread else None)
        for rank, peak in enumerate(peaks.by_prominence, start=1)
    )
    note = f"Noise floor {peaks.noise_floor:.3g} m/s², spread {spread:.2g} m/s²; over noise is prominence by spread."
    if not rows:
        note = f"No peak stands out from the noise. {note}"
    return Table(title, columns, rows, note)


def swept_paths(runs: Sequence[RunResult]) -> tuple[str, ...]:
    """Return the dotted paths that are swept in any of the runs."""
    return tuple(dict.fromkeys(path for run in runs for path in run.swept))


def swept_columns(runs: Sequence[RunResult]) -> tuple[Column, ...]:
    """Return the columns that tell runs apart: a swept value each, or the name of the run; none for a single one."""
    named = () if len(runs) == 1 else (Column("run"),)
    return tuple(Column(label) for label in path_labels(swept_paths(runs)).values()) or named


def swept_cells(run: RunResult, runs: Sequence[RunResult]) -> tuple[Cell, ...]:
    """Return the cells of a run in the columns of :func:`swept_columns`."""
    named = () if len(runs) == 1 else (run.name,)
    return tuple(swept_text(run.swept.get(path)) for path in swept_paths(runs)) or named


def run_notes(runs: Sequence[RunResult]) -> str:
    """Say what the sign ± means, and which contact came close to a free edge; nothing where neither is the case."""
    notes = []
    if any(run.uncertainty for run in runs):
        notes.append(
            "After ±: numerical uncertainty over element sizes, time steps, contact stiffness and numerical damping."
        )
    notes.append(edge_warning({run_title(run, run.name): run.edge for run in runs}))
    return " ".join(note for note in notes if note)


def _notes(runs: Sequence[RunResult], readings: Iterable[str]) -> str:
    explained = any(defines_time(reading, "noticed") for reading in readings)
    return " ".join(filter(None, (NOTICED_NOTE if explained else "", run_notes(runs))))


def time_digits(runs: Sequence[RunResult]) -> int:
    """Return how many digits of a time [s] runs allow: none finer than their steps, unless an error bar says how good.

    Runs of several steps have the digits of the shortest.
    """
    steps = [float(step) for run in runs if (step := run.numbers.get("slide_step_s"))]
    if not steps or any(run.uncertainty for run in runs):
        return _MOST_DIGITS
    return min(max(-math.floor(math.log10(min(steps)) + 1e-6), 0), _MOST_DIGITS)


def _event_columns(runs: Sequence[RunResult]) -> tuple[Column, ...]:
    digits = time_digits(runs)
    times = (Column(words, "s", digits, answers=name == "overall") for name, words in EVENTS.items())
    return (*times, Column(LATENCY, "ms", digits - 3, answers=True))


def _event_cells(run: RunResult, reading: str) -> tuple[Cell, ...]:
    return (*(time_cell(run, reading, event) for event in EVENTS), time_cell(run, reading, LATENCY, 1e3))
