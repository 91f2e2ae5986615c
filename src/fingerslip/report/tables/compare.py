"""Tables that compare: results beside published numbers, and numbers over refinements."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from fingerslip.published import PublishedSet, PublishedValue
from fingerslip.report.labels import first_named, path_label, prose, run_title, swept_text
from fingerslip.report.tables.parameters import DEFAULT, ShownValue, group_of
from fingerslip.report.tables.runs import run_notes, swept_cells, swept_columns, swept_paths, time_cell
from fingerslip.results import RunResult
from fingerslip.slip.measures import measure_of
from fingerslip.slip.windows import LATENCY, MAIN_EVENTS, NOTICED_NOTE, READING_HEADINGS, READINGS
from fingerslip.tables.table import Cell, Column, Measured, Missing, Table
from fingerslip.uncertainty import SETTINGS, Convergence, Refinement, settings_in_words, varied_settings

_TIMES = (*MAIN_EVENTS, LATENCY)
# Relative difference that sums of thousands of steps may have without a reason.
_ROUNDING = 1e-9


def compare_table(runs: Sequence[RunResult], reference: PublishedSet) -> Table:
    """Put slip events beside published ones: a row for every run that meets the conditions of a published time.

    One that no run meets has a row that says so; the note says which runs are not compared, and what differs.
    """
    values = [value for value in reference.values if value.value is not None and value.quantity in _TIMES]
    beside = (Column(*column) for name in READING_HEADINGS.values() for column in ((name, "s", 3), ("diff.", "ms", 0)))
    columns = (*swept_columns(runs), Column("event"), Column("published", "s"), *beside)
    compared = [
        (*swept_cells(run, runs), *_event_cells(value), *_reading_cells(run, value))
        for run in runs
        for value in values
        if value.holds_for(run.all_values)
    ]
    # A value that no run meets has its conditions in the columns of the runs; a single run has none.
    unnamed = (Missing.NOT_COMPARED,) if len(runs) != 1 else ()
    others = [
        (
            *(tuple(swept_text(value.conditions.get(path)) for path in swept_paths(runs)) or unnamed),
            *_event_cells(value, runs),
            *([Missing.NOT_COMPARED] * 2 * len(READINGS)),
        )
        for value in values
        if not any(value.holds_for(run.all_values) for run in runs)
    ]
    note = f"{prose('notes', 'readings')} {reference.citation} {_left_out(runs, values)}{run_notes(runs)}"
    return Table(reference.title, columns, (*compared, *others), note.rstrip())


def statements_table(reference: PublishedSet) -> Table:
    """Show published statements in words, each with the number that it is compared with."""
    columns = (Column("statement"), Column("what to check"), Column("holds for"))
    rows = tuple(
        (value.statement, value.check, ", ".join(f"{path} = {needed}" for path, needed in value.conditions.items()))
        for value in reference.values
        if value.statement
    )
    return Table(reference.title, columns, rows, f"Published: {reference.citation}")


def _left_out(runs: Sequence[RunResult], values: Sequence[PublishedValue]) -> str:
    """Say which runs are compared with nothing, and in what they differ from the paper; empty where there are none."""
    reasons: dict[str, list[str]] = {}
    for run in runs:
        differences = ", ".join(
            f"{path} is {run.all_values.get(path, 'not known')}, published for {needed}"
            for path, needed in min((value.unmet(run.all_values) for value in values), key=len, default={}).items()
        )
        if differences:
            reasons.setdefault(differences, []).append(run_title(run, "this run"))
    texts = [f"{', '.join(names)} ({reason})" for reason, names in reasons.items()]
    return f"Not compared: {'; '.join(texts)}. " if texts else ""


def _event_cells(value: PublishedValue, unlike: Sequence[RunResult] = ()) -> tuple[Cell, ...]:
    """Return event and published time; beside the event what none of other runs has, but for their columns."""
    low, high = span_of(value)
    unmet = min((value.unmet(run.all_values) for run in unlike), key=len, default={})
    columns = swept_paths(unlike)
    words = ", ".join(
        f"{path_label(path)} {swept_text(needed)}" for path, needed in unmet.items() if path not in columns
    )
    event = f"{value.quantity.replace('_', '-')}{f' ({words})' if words else ''}"
    return event, f"{low:.2f}" if low == high else f"{low:.2f} to {high:.2f}"


def span_of(value: PublishedValue) -> tuple[float, float]:
    """Return the smallest and the largest of a published number."""
    assert value.value is not None  # held by those who ask
    return value.span or (value.value, value.value)


def difference_from(ours: float, span: tuple[float, float]) -> float:
    """Return how much `ours` lies above (positive) or below a published range; 0 within it."""
    return ours - min(max(ours, span[0]), span[1])


def _reading_cells(run: RunResult, value: PublishedValue) -> list[Cell]:
    """Return our time in each reading and how much later it is than published [ms], 0 within a published range."""
    cells: list[Cell] = []
    for reading in READINGS:
        cell, time = time_cell(run, reading, value.quantity), run.events.reading(reading).time(value.quantity)
        if value.reading not in ("", reading):
            cells += [Missing.NOT_COMPARED] * 2
        elif time is None:
            cells += [cell, cell]
        else:
            cells += [cell, 1e3 * difference_from(time, span_of(value))]
    return cells


def difference_cell(first: Cell, second: Cell, factor: float = 1.0) -> Cell:
    """Return the second number less the first, with the uncertainty of both where both are known; None without two."""
    numbers = [cell.value if isinstance(cell, Measured) else cell for cell in (first, second)]
    if not all(isinstance(number, int | float) for number in numbers):
        return None
    low, high = map(float, numbers)  # type: ignore[arg-type]
    difference = 0.0 if math.isclose(low, high, rel_tol=_ROUNDING) else factor * (high - low)
    if isinstance(first, Measured) and isinstance(second, Measured):
        return Measured(difference, factor * math.hypot(first.uncertainty, second.uncertainty))
    return difference


def exceeds_uncertainty(first: Cell, second: Cell) -> bool:
    """Tell whether two numbers differ by more than the uncertainty of both, or of the one that has it."""
    bars = [cell.uncertainty for cell in (first, second) if isinstance(cell, Measured)]
    before, after = (cell.value if isinstance(cell, Measured) else cell for cell in (first, second))
    difference = difference_cell(before, after)
    return bool(bars) and isinstance(difference, float) and abs(difference) > math.hypot(*bars)


def marked_notes(runs: Sequence[RunResult]) -> str:
    """Say what the sign ± leaves out, and which differences are marked; nothing where no run has it."""
    return f"{run_notes(runs)} {prose('notes', 'bold')}" if any(run.uncertainty for run in runs) else ""


# What is only kept or filmed differs between most studies, and moves no slip event.
_ASIDE = "Recording"
_BASIS = "dynamics.basis"


def compared_values(*sides: Sequence[ShownValue]) -> list[dict[str, str]]:
    """Return the values of each side by their paths, without a basis that the program chose on all sides."""
    is_chosen = all(value.source == DEFAULT for side in sides for value in side if value.path == _BASIS)
    return [{shown.path: shown.value for shown in side if shown.path != _BASIS or not is_chosen} for side in sides]


def differences_table(first: Mapping[str, str], second: Mapping[str, str], *, same: str, note: str = "") -> Table:
    """Put the values that differ into a table; values that only say what is recorded are named below it."""
    paths = [path for path in dict.fromkeys((*first, *second)) if first.get(path) != second.get(path)]
    aside = [path for path in paths if group_of(path) == _ASIDE]
    rows = tuple(
        (path, *(values.get(path, Missing.NOT_DEFINED) for values in (first, second)))
        for path in paths
        if path not in aside
    )
    recorded = f"Recorded differently, too, which moves no slip event: {first_named(aside, 4)}."
    said = " ".join(filter(None, ("" if paths else same, note, recorded if aside else "")))
    return Table("Values that differ", (Column("value"), Column("A"), Column("B")), rows, said)


_UNCHANGED = "unchanged"
_WORDS = {"oscillatory": "up/down", "divergent": "away", "slow": "slow", "fast": "fast"}


def convergence_table(quantities: Mapping[str, Convergence], title: str) -> Table:
    """Show how well the numbers of a run are known."""
    varied = varied_settings(quantities.values())
    settings = [setting.name for setting in SETTINGS if setting.name != ("mesh" if "bulk" in varied else "bulk")]
    names = ("quantity", "unit", "value", "uncertainty", *(f"± {name}" for name in settings), "converges")
    rows = tuple(_row(key, quantity, settings) for key, quantity in quantities.items() if _is_there(key, quantity))
    note = prose("notes", "convergence", {"settings": settings_in_words(varied)})
    left_out = settings_in_words(name for name in settings if name not in varied)
    note = f"{note} Not studied: {left_out}." if left_out else note
    note = f"{note} {prose('notes', 'no-mesh')}" if varied and "mesh" not in varied else note
    note = f"{note} {NOTICED_NOTE}" if "slip.noticed" in quantities else note
    return Table(f"Numerical uncertainty, {title}", tuple(map(Column, names)), rows, note)


def series_table(runs: Mapping[str, Mapping[str, Convergence]]) -> Table:
    """List every number at every level, one row each, for other programs."""
    names = ("run", "quantity", "unit", "setting", "size", "value")
    rows = tuple(
        (run, key, quantity.unit, setting, size, value)
        for run, quantities in runs.items()
        for key, quantity in quantities.items()
        for setting, series in quantity.sources.items()
        for size, value in zip(series.sizes, series.values, strict=True)
    )
    return Table("Refinement", tuple(map(Column, names)), rows)


def _is_there(key: str, quantity: Convergence) -> bool:
    """Tell whether a number belongs to a run: one of markers or receptors that it does not have has no row."""
    every = (quantity.value, *(value for series in quantity.sources.values() for value in series.values))
    return _reason(key) is not Missing.NOT_DEFINED or any(value is not None for value in every)


def _reason(key: str) -> Missing:
    """Return why a number is not there: the times of events have dots in their keys, measures know their reading."""
    measure = measure_of(key)
    return Missing.NO_EVENT if "." in key or (measure and measure.reading) else Missing.NOT_DEFINED


def _row(key: str, quantity: Convergence, settings: Sequence[str]) -> tuple[Cell, ...]:
    reason = _reason(key)
    if quantity.value is None:
        return (quantity.quantity, quantity.unit, *([reason] * (3 + len(settings))))
    refinements = quantity.refinements
    cells = [_setting_cell(refinements.get(name), reason) for name in settings]
    uncertainty: Cell = reason if quantity.uncertainty is None else f"{quantity.uncertainty:.4g}"
    if quantity.uncertainty is None and {refinement.behaviour for refinement in refinements.values()} == {_UNCHANGED}:
        uncertainty = _UNCHANGED
    # A mesh that is read cannot be refined.
    settled = "yes" if "mesh" in refinements else "as far as studied"
    verdict = f"not with {', '.join(quantity.unsettled_settings)}" if quantity.unsettled_settings else settled
    return (quantity.quantity, quantity.unit, f"{quantity.value:.4g}", uncertainty, *cells, verdict)


def _setting_cell(refinement: Refinement | None, reason: Missing) -> Cell:
    if refinement is None:
        return Missing.NOT_STUDIED
    if refinement.uncertainty is None:
        return reason
    if refinement.behaviour == _UNCHANGED:
        return _UNCHANGED
    word = _WORDS.get(refinement.behaviour) or (f"{refinement.order:.1f}" if refinement.order is not None else "")
    return f"{refinement.uncertainty:.4g} ({word})" if word else f"{refinement.uncertainty:.4g}"
