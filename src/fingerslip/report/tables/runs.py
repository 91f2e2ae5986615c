"""Tables of runs: their slip events, numbers and measures, and the summary of a study."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from fingerslip.libraries import pd, xr
from fingerslip.report.labels import first_named, groups, path_labels, prose, run_title, swept_text
from fingerslip.results import RefusedRun, RunResult, StudyResult
from fingerslip.slip import PeakTable, measures
from fingerslip.slip.front import edge_warning
from fingerslip.slip.measures import Measure
from fingerslip.slip.windows import EVENTS, LATENCY, NOTICED_NOTE, READINGS, TIMES, defines_time
from fingerslip.tables.table import Cell, Column, Measured, Missing, Resolved, Table, typeset
from fingerslip.uncertainty import studied_settings
from fingerslip.units import si_quantity, unit_suffix

# Digits of a time [s] that a step of 1 ms and less allows.
_MOST_DIGITS = 3
# Of the columns of times, by their reading.
_ENDINGS = {reading: "" if reading == "slip" else f"_{reading}" for reading in READINGS}
_FINEST = 1e-3
_LATENCIES = Column(LATENCY, "ms", 0, answers=True)
_ORIGIN = "counted from the start of the run"


def time_cell(run: RunResult, reading: str, time: str, factor: float = 1.0) -> Cell:
    """Return the time of an event, or the latency, with its uncertainty where that is known; else why there is none.

    A latency has the digits of its uncertainty, milliseconds at least; without one those of a step, at most these.
    """
    events = run.events.reading(reading)
    value = events.time(time)
    if not defines_time(reading, time):
        return Missing.NOT_DEFINED
    if value is None:
        return Missing.NO_EVENT if events.recorded else Missing.NOT_RECORDED
    uncertainty = run.uncertainty.get(f"{reading}.{time}")
    number = factor * value
    if time == LATENCY:
        step = max(float(run.numbers.get("slide_step_s") or 0.0), _FINEST)
        finest = step if uncertainty is None else min(max(uncertainty, 1e-6) / 3.0, _FINEST)
        number = Resolved(number, -math.floor(math.log10(factor * finest) + 1e-6))
    return number if uncertainty is None else Measured(number, factor * uncertainty)


def events_table(runs: Sequence[RunResult], reading: str = "slip") -> Table:
    """Show the slip events of all runs in one reading."""
    columns = (*swept_columns(runs), *_event_columns(runs))
    rows = tuple((*swept_cells(run, runs), *_event_cells(run, reading)) for run in runs)
    title = f"Slip events from {READINGS[reading]}, {_ORIGIN}"
    return Table(title, columns, rows, _notes(runs, [reading]))


def readings_table(run: RunResult, title: str = "Slip events") -> Table:
    """Show the slip events of one run, a row for each reading."""
    rows = tuple((words, *_event_cells(run, reading)) for reading, words in READINGS.items())
    return Table(f"{title}, {_ORIGIN}", (Column("read from"), *_event_columns([run])), rows, _notes([run], READINGS))


def peaks_table(peaks: PeakTable) -> Table:
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
    return Table("Acceleration peaks", columns, rows, note)


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
    """Say what the sign ± means; nothing where no run has it."""
    varied = studied_settings(quantity for run in runs for quantity in run.convergence.values())
    over = f" over {varied}" if varied else ""
    return prose("notes", "bars", {"over": over}) if any(run.uncertainty for run in runs) else ""


def run_caveats(runs: Sequence[RunResult]) -> tuple[str, ...]:
    """Say what to know beside the times of slip: contact at a free edge, a doubtful model, and what is too coarse."""
    titled = {run_title(run, run.name): run for run in runs}
    edges = edge_warning({title: run.edge for title, run in titled.items()})
    return (
        *filter(None, [edges]),
        *doubt_warnings(runs),
        *measures.caveats({title: run.numbers for title, run in titled.items()}),
    )


def doubt_warnings(runs: Sequence[RunResult]) -> tuple[str, ...]:
    """Say what is doubtful in the models of runs, beside what their numbers tell."""
    doubtful: dict[str, list[str]] = {}
    for run in runs:
        for doubt in run.doubts:
            doubtful.setdefault(doubt, []).append(run_title(run, run.name))
    return tuple(f"Doubtful in {first_named(names)}: {doubt}." for doubt, names in doubtful.items())


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
    return (*times, _LATENCIES)


def latency_span(runs: Sequence[RunResult]) -> str:
    """Return the shortest and the longest latency of runs as tables show them; nothing where none has one."""
    timed = sorted((run for run in runs if run.events.latency is not None), key=lambda run: run.events.latency or 0.0)
    ends = (_LATENCIES.format(time_cell(run, "slip", LATENCY, 1e3)) for run in (*timed[:1], *timed[-1:]))
    return f"{' to '.join(dict.fromkeys(ends))} ms" if timed else ""


def _event_cells(run: RunResult, reading: str) -> tuple[Cell, ...]:
    return (*(time_cell(run, reading, event) for event in EVENTS), time_cell(run, reading, LATENCY, 1e3))


def summary_table(runs: Sequence[RunResult], refused: Sequence[RefusedRun] = ()) -> Table:
    """Put the slip events and measures of all runs into one table: one row per run, SI units, full precision.

    Swept and sampled values, such as ``mesh.contact_size_m``; times, such as ``overall_s_displacement``; in
    ``readings_recorded`` the readings whose empty times say that the event did not happen; measures; derived
    quantities; uncertainties that are known, such as ``overall_uncertainty_s``; why samples were ``refused``.
    """
    columns = _summary_columns(runs, refused)
    rows = zip(*(cells for _, cells in columns.values()), strict=True)
    return Table("Slip events and measures", tuple(map(Column, columns)), tuple(rows))


def _summary_columns(
    runs: Sequence[RunResult], refused: Sequence[RefusedRun]
) -> dict[str, tuple[str, tuple[Cell, ...]]]:
    """Return unit and cells of the columns of a summary by their names; of most, refused samples have nothing."""
    every: list[RunResult | RefusedRun] = [*runs, *refused]
    nothing = (None,) * len(refused)
    columns: dict[str, tuple[str, tuple[Cell, ...]]] = {"run": ("", tuple(run.name for run in every))}
    sampled = tuple(dict.fromkeys(path for run in runs for path in run.sampled))
    for path in (*swept_paths(runs), *sampled):
        values = [{**run.swept, **run.sampled}.get(path) for run in every]
        # Numbers in one SI unit, or words where not all are quantities of one kind.
        quantities = [si_quantity(value) if isinstance(value, str) else None for value in values]
        units = {quantity[1] if quantity else None for quantity in quantities}
        unit = units.pop() if len(units) == 1 else None
        if unit is None:
            columns[path] = ("", tuple(map(swept_text, values)))
        else:
            columns[f"{path}_{unit_suffix(unit)}"] = (unit, tuple(quantity and quantity[0] for quantity in quantities))
    for reading, time in ((reading, time) for reading in READINGS for time in TIMES if defines_time(reading, time)):
        cells = (run.events.reading(reading).time(time) for run in runs)
        columns[f"{time}_s{_ENDINGS[reading]}"] = ("s", (*cells, *nothing))
    recorded = (" ".join(name for name in READINGS if run.events.reading(name).recorded) for run in runs)
    columns["readings_recorded"] = ("", (*recorded, *nothing))
    for measure in measures.MEASURES:
        numbers = (run.numbers.get(measure.key) for run in runs)
        columns[measure.key] = (measure.unit.si if measure.unit else "", (*numbers, *nothing))
    for name in dict.fromkeys(name for run in runs for name in run.reaction):
        # A detector may have the name of a time of slip.
        cells = (run.reaction.get(name) for run in runs)
        columns[_unused(f"reaction_{_word(name)}_s", columns)] = ("s", (*cells, *nothing))
    # A derived quantity has its unit in the name: `slip_travel_m`.
    derived = {name: quantity.unit for run in runs for name, quantity in run.derived.items()}
    for name, unit in derived.items():
        heading = f"{name}_{unit_suffix(unit)}" if unit else name
        cells = (run.derived[name].value if name in run.derived else None for run in runs)
        columns[heading] = (unit, (*cells, *nothing))
    for key in dict.fromkeys(key for run in runs for key in run.uncertainty):
        # Of a time of slip or of a reaction, or of a measure.
        reading, _, time = key.partition(".")
        heading = f"{time}_uncertainty_s{_ENDINGS[reading]}" if reading in READINGS else f"{_word(key)}_uncertainty_s"
        unit = "s"
        if (known := measures.measure_of(key)) is not None:
            heading = f"{known.name}_uncertainty{known.key.removeprefix(known.name)}"
            unit = known.unit.si if known.unit else ""
        columns[heading] = (unit, (*(run.uncertainty.get(key) for run in runs), *nothing))
    if sampled:
        columns["refused"] = ("", (*("" for _ in runs), *(sample.reason for sample in refused)))
    return columns


def _word(name: str) -> str:
    """Return a name as columns have it that MATLAB takes, too."""
    return re.sub(r"\W+", "_", name.replace("%", "percent")).strip("_")


def _unused(name: str, names: Mapping[str, object]) -> str:
    """Return a name that is not among others, which may differ from it in signs that it lacks."""
    return _unused(f"{name}_", names) if name in names else name


def runs_frame(study: StudyResult) -> pd.DataFrame:
    """Put the results of a study into a data frame: a row for each run, the columns of its ``summary.csv``.

    Its attribute ``units`` has the units of the columns.
    """
    frame = table_frame(summary_table(study.runs, study.refused))
    units = {name: unit for name, (unit, _) in _summary_columns(study.runs, study.refused).items() if unit}
    frame.attrs = {"units": units, "title": study.title}
    return frame


def table_frame(table: Table) -> pd.DataFrame:
    """Put a table into a data frame: a column has numbers where all that it has are numbers, or missing."""

    def number_or_text(cell: Cell) -> Cell:
        if isinstance(cell, Measured):
            return cell.value
        return None if isinstance(cell, Missing) else cell

    series = {}
    for index, column in enumerate(table.columns):
        cells = [number_or_text(row[index]) for row in table.rows]
        numbers = all(cell is None or (isinstance(cell, int | float) and not isinstance(cell, bool)) for cell in cells)
        series[column.name] = pd.Series(cells, dtype="float64" if cells and numbers else "object")
    frame = pd.DataFrame(series)
    units = {column.name: column.unit for column in table.columns if column.unit}
    frame.attrs = {"units": units, "title": table.title, "note": table.note}
    return frame


def energies_table(histories: Mapping[str, xr.Dataset]) -> Table:
    """Show energies at the end of runs [mJ], and the largest imbalance over time as a share of the largest work."""
    columns = (Column("energy at the end"), Column("unit"), *(Column(title, significant=3) for title in histories))
    every, shares = list(histories.values()), list[Cell]()
    rows = [
        (words, "mJ", *(1e3 * float(run[name].values[-1]) if name in run else Missing.NOT_RECORDED for run in every))
        for name, words in groups()["energies"].items()
    ]
    for history in every:
        work, imbalance = (
            np.abs(history[name].values).max(initial=0.0) for name in ("external_work", "energy_imbalance")
        )
        shares.append(float(imbalance) / float(work) if work else Missing.NOT_DEFINED)
    note = "The work equals the energies stored and dissipated, but for the imbalance."
    return Table("Energy balance", columns, (*rows, ("largest imbalance over largest work", "", *shares)), note)


def measures_table(runs: Sequence[RunResult], titles: Sequence[str]) -> Table:
    """Show the measures of runs, a row for each measure and a column for each run."""
    columns = (Column("measure"), Column("unit"), *(Column(heading, significant=4) for heading in titles))
    rows = tuple(
        (measure.label, typeset(measure.unit.shown) if measure.unit else "", *(_measure(run, measure) for run in runs))
        for measure in measures.MEASURES
    )
    return Table("Measures", columns, rows)


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
