"""Tables of runs: their slip events, numbers and measures, and the summary of a study."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from fingerslip.report.labels import path_labels, run_title, swept_text
from fingerslip.results import RefusedRun, RunResult, StudyResult
from fingerslip.slip import PeakTable, measures
from fingerslip.slip.front import edge_warning
from fingerslip.slip.measures import Measure
from fingerslip.slip.windows import EVENTS, LATENCY, NOTICED_NOTE, READINGS, TIMES, defines_time
from fingerslip.tables.table import Cell, Column, Measured, Missing, Table, typeset
from fingerslip.units import si_quantity, unit_suffix

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

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
    sizes = (Column(name, "m/s²", 3) for name in ("height", "prominence"))
    columns, spread = (Column("rank"), Column("time", "s", 3), *sizes, Column("over noise", "", 1)), peaks.noise_spread
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


def differing_paths(runs: Sequence[RunResult]) -> tuple[str, ...]:
    """Return the dotted paths that are swept and have more than one value in the runs."""
    values = {path: {swept_text(run.swept[path]) for run in runs if path in run.swept} for path in swept_paths(runs)}
    return tuple(path for path in values if len(values[path]) > 1)


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
    bars = "After ±: numerical uncertainty over element sizes, time steps, contact stiffness and numerical damping."
    edges = edge_warning({run_title(run, run.name): run.edge for run in runs})
    return " ".join(filter(None, (bars if any(run.uncertainty for run in runs) else "", edges)))


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
class _SummaryColumn:
    """A column of the summary: its name and SI unit, and what stands there for a run and for a refused sample."""

    name: str
    unit: str
    of_run: Callable[[RunResult], Cell]
    of_refused: Callable[[RefusedRun], Cell] = lambda _: None


def _columns(runs: Sequence[RunResult], refused: Sequence[RefusedRun]) -> list[_SummaryColumn]:
    sampled = tuple(dict.fromkeys(path for run in runs for path in run.sampled))
    columns = [
        _SummaryColumn("run", "", lambda run: run.name, lambda sample: sample.name),
        *(_swept_column(path, (*runs, *refused)) for path in (*swept_paths(runs), *sampled)),
    ]

    def add(name: str, unit: str, of_run: Callable[[RunResult, Any], Cell], of: Any) -> None:
        columns.append(_SummaryColumn(name, unit, lambda run: of_run(run, of)))

    for reading, time in ((reading, time) for reading in READINGS for time in TIMES if defines_time(reading, time)):
        name = f"{time}_s" if reading == "slip" else f"{time}_s_{reading}"
        add(name, "s", lambda run, of: run.events.reading(of[0]).time(of[1]), (reading, time))
    add("readings_recorded", "", lambda run, of: " ".join(n for n in of if run.events.reading(n).recorded), READINGS)
    for measure in measures.MEASURES:
        add(measure.key, measure.unit.si if measure.unit else "", lambda run, key: run.numbers.get(key), measure.key)
    # A derived quantity has its unit in the name: `slip_travel_m`.
    units = {name: quantity.unit for run in runs for name, quantity in run.derived.items()}
    for name, unit in units.items():
        heading = f"{name}_{unit_suffix(unit)}" if unit else name
        add(heading, unit, lambda run, of: run.derived[of].value if of in run.derived else None, name)
    columns += map(_uncertainty_column, dict.fromkeys(key for run in runs for key in run.uncertainty))
    if sampled:
        columns.append(_SummaryColumn("refused", "", lambda _: "", lambda sample: sample.reason))
    return columns


def _swept_column(path: str, runs: Sequence[RunResult | RefusedRun]) -> _SummaryColumn:
    """Return the column of a swept path: numbers in one SI unit, or words where not all are quantities of one kind."""

    def value(run: RunResult | RefusedRun) -> Any:
        return {**run.swept, **run.sampled}.get(path)

    def quantity(run: RunResult | RefusedRun) -> tuple[float, str] | None:
        return si_quantity(value(run)) if isinstance(value(run), str) else None

    def number(run: RunResult | RefusedRun) -> float | None:
        converted = quantity(run)
        return converted[0] if converted else None

    def words(run: RunResult | RefusedRun) -> Cell:
        return swept_text(value(run))

    units = {pair[1] if pair else None for pair in map(quantity, runs)}
    unit = units.pop() if len(units) == 1 else None
    if unit is None:
        return _SummaryColumn(path, "", words, words)
    return _SummaryColumn(f"{path}_{unit_suffix(unit)}", unit, number, number)


def _uncertainty_column(key: str) -> _SummaryColumn:
    """Return the column of an uncertainty: `slip_overall_uncertainty_s`, `normal_force_max_uncertainty_N`."""
    measure, name, unit = measures.measure_of(key), f"{key.replace('.', '_')}_uncertainty_s", "s"
    if measure is not None:
        name = f"{measure.name}_uncertainty{measure.key.removeprefix(measure.name)}"
        unit = measure.unit.si if measure.unit else ""
    return _SummaryColumn(name, unit, lambda run: run.uncertainty.get(key))


def runs_frame(study: StudyResult) -> pd.DataFrame:
    """Put the results of a study into a data frame: a row for each run, the columns of its ``summary.csv``.

    Its attribute ``units`` has the units of the columns.
    """
    table = summary_table(study.runs, study.refused)
    frame = _frame(table)
    frame.attrs |= {"units": summary_units(study.runs, study.refused), "title": study.title}
    return frame


def table_frame(table: Table) -> pd.DataFrame:
    """Put a table into a data frame."""
    frame = _frame(table)
    units = {column.name: column.unit for column in table.columns if column.unit}
    frame.attrs |= {"units": units, "title": table.title, "note": table.note}
    return frame


def _frame(table: Table) -> pd.DataFrame:
    """Return the columns of a table: numbers where all that one has are numbers, or missing."""
    import pandas as pd

    series = {}
    for index, column in enumerate(table.columns):
        cells = [_plain(row[index]) for row in table.rows]
        numbers = all(cell is None or (isinstance(cell, int | float) and not isinstance(cell, bool)) for cell in cells)
        series[column.name] = pd.Series(cells, dtype="float64" if cells and numbers else "object")
    return pd.DataFrame(series)


def _plain(cell: Cell) -> Cell:
    if isinstance(cell, Measured):
        return cell.value
    return None if isinstance(cell, Missing) else cell


_ENERGIES: Mapping[str, str] = MappingProxyType(
    {
        "external_work": "work of plate, supports and loads",
        "strain_energy": "strain energy",
        "friction_dissipation": "friction",
        "viscous_dissipation": "relaxation of materials",
        "damping_dissipation": "material damping",
        "numerical_dissipation": "numerical damping",
        "contact_energy": "contact penalties",
        "kinetic_energy": "kinetic energy",
        "energy_imbalance": "imbalance",
    }
)


def energies_table(histories: Mapping[str, xr.Dataset]) -> Table:
    """Show energies at the end of runs [mJ], and the largest imbalance over time as a share of the largest work."""
    columns = (Column("energy at the end"), Column("unit"), *(Column(title, significant=3) for title in histories))
    rows = [(words, "mJ", *(_energy(run, name) for run in histories.values())) for name, words in _ENERGIES.items()]
    shares = ("largest imbalance over largest work", "", *(_imbalance(history) for history in histories.values()))
    note = "The work equals the energies stored and dissipated, but for the imbalance."
    return Table("Energy balance", columns, (*rows, shares), note)


def _energy(history: xr.Dataset, name: str) -> Cell:
    return 1e3 * float(history[name].values[-1]) if name in history else Missing.NOT_RECORDED


def _imbalance(history: xr.Dataset) -> Cell:
    work = float(np.abs(history["external_work"].values).max(initial=0.0))
    return float(np.abs(history["energy_imbalance"].values).max()) / work if work else Missing.NOT_DEFINED


def measures_table(runs: Sequence[RunResult], titles: Sequence[str], title: str = "Measures") -> Table:
    """Show the measures of runs, a row for each measure and a column for each run."""
    columns = (Column("measure"), Column("unit"), *(Column(heading, significant=4) for heading in titles))
    rows = tuple(
        (measure.label, typeset(measure.unit.shown) if measure.unit else "", *(_measure(run, measure) for run in runs))
        for measure in measures.MEASURES
    )
    return Table(title, columns, rows)


def _measure(run: RunResult, measure: Measure) -> Cell:
    """Return the value of a measure with its uncertainty, or why a run has none."""
    value, uncertainty = run.numbers.get(measure.key), run.uncertainty.get(measure.key)
    if measure.key not in run.numbers:
        return Missing.NOT_RECORDED
    if value is None and measure.reading:
        return Missing.NO_EVENT if run.events.reading(measure.reading).recorded else Missing.NOT_RECORDED
    if value is None:
        return Missing.NOT_DEFINED
    if measure.unit:
        value = measure.unit.to_display(value)
        uncertainty = None if uncertainty is None else measure.unit.to_display(uncertainty)
    return value if uncertainty is None else Measured(value, uncertainty)
