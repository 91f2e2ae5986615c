"""Tables of a study with samples: intervals of slip times, sensitivities, and samples that were refused."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from fingerslip.published import PublishedSet
from fingerslip.report.labels import path_label, path_labels, prose, swept_text
from fingerslip.results import RefusedRun, RunResult, StudyResult
from fingerslip.sampling.indices import Prediction, Sensitivity, Surrogate, Validation
from fingerslip.sampling.sensitivity import Fit, Interval, fits_of, groups_of, interval_of, published_intervals
from fingerslip.slip.windows import READINGS, TIMES, defines_time, event_label
from fingerslip.tables.table import Cell, Column, Missing, Table

INTERVAL_COLUMNS = tuple(Column(name, "s", 3) for name in ("smallest", "5 %", "median", "95 %", "largest"))


def group_text(group: Mapping[str, Any]) -> str:
    """Return what samples have in common in words, such as 'phalanx original'; empty where nothing is swept."""
    return ", ".join(f"{path_label(path)} {swept_text(value)}" for path, value in group.items())


def interval_cells(interval: Interval | None) -> tuple[Cell, ...]:
    """Return the cells of :data:`INTERVAL_COLUMNS`."""
    return (Missing.NO_EVENT,) * len(INTERVAL_COLUMNS) if interval is None else interval.summary


def sample_tables(study: StudyResult, references: Sequence[PublishedSet]) -> tuple[Table, ...]:
    """Return the tables of a study with samples: intervals beside published times, and what moves overall slip."""
    overall = [sensitivity_table(fit) for fit in fits_of(study) if (fit.reading, fit.time) == ("slip", "overall")]
    tables = (published_table(study.runs, references), intervals_table(study.runs), *overall)
    return tuple(table for table in (*tables, refused_table(study.refused)) if table.rows)


def published_table(runs: Sequence[RunResult], references: Sequence[PublishedSet]) -> Table:
    """Show every published time, the interval of the samples, and where the published time lies in it."""
    before, after = ("time", "holds for", "published [s]"), ("published lies", "found in")
    columns = (*map(Column, before), *INTERVAL_COLUMNS, *map(Column, after))
    intervals = published_intervals(runs, references)
    conditions = [interval.value.conditions for interval in intervals]
    rows = []
    for interval in intervals:
        value = interval.value
        apart = {
            path: needed
            for path, needed in value.conditions.items()
            if not all((path, needed) in others.items() for others in conditions)
        }
        rows.append((
            f"{event_label(value.quantity)} ({READINGS[interval.reading]})",
            group_text(apart) or "all",
            f"{value.span[0]:.2f} to {value.span[1]:.2f}" if value.span else f"{value.value:.2f}",
            *interval_cells(interval.interval),
            interval.where or Missing.NOT_DEFINED,
            f"{0 if interval.interval is None else len(interval.interval.values)} of {interval.samples}",
        ))  # fmt: skip
    return Table("Published times in the intervals of the samples", columns, tuple(rows), prose("notes", "intervals"))


def intervals_table(runs: Sequence[RunResult]) -> Table:
    """Show the interval of every slip time in every reading that was recorded."""
    columns = (Column("samples"), Column("time"), *INTERVAL_COLUMNS, Column("found in"))
    rows: list[tuple[Cell, ...]] = []
    for group, members in groups_of(runs):
        for reading, words in READINGS.items():
            events = [run.events.reading(reading) for run in members]
            for time in TIMES if any(event.recorded for event in events) else ():
                interval = interval_of([event.time(time) for event in events])
                if defines_time(reading, time):
                    fault = f"{0 if interval is None else len(interval.values)} of {len(members)}"
                    name = f"{event_label(time)} ({words})"
                    rows.append((group_text(group) or "all", name, *interval_cells(interval), fault))
    return Table("Slip times over the samples", columns, tuple(rows))


def sensitivity_table(fit: Fit) -> Table:
    """Show what each sampled value does to one slip time, the largest change over a range first."""
    columns = (
        *map(Column, ("value", "from", "to", "slope", "change over the range [ms]")),
        *(Column(name, digits=2) for name in ("standardised", "rank correlation")),
    )
    labels = path_labels([effect.path for effect in fit.effects])
    rows = tuple(
        (
            labels[effect.path],
            f"{effect.low:g} {effect.unit}".strip(),
            f"{effect.high:g} {effect.unit}".strip(),
            f"{effect.slope:+.{decimals}f} ± {effect.error:.{decimals}f} {f's/{effect.unit}' if effect.unit else 's'}",
            f"{1e3 * effect.change:+.0f} ± {1e3 * effect.change_error:.0f}",
            effect.standardised,
            effect.rank,
        )
        for effect in fit.effects
        # Two digits of the error, but no fewer than three decimals.
        for decimals in [min(max(1 - math.floor(math.log10(effect.error or 1.0)), 3), 6)]
    )
    numbers = {"middle": fit.middle, "determination": fit.determination, "predicted": fit.predicted}
    numbers |= {"samples": len(fit.interval.values), "residual": 1e3 * fit.residual}
    note = prose("notes", "regression", numbers)
    return Table(_title(f"{event_label(fit.time)} ({READINGS[fit.reading]})", fit.group), columns, rows, note)


def _title(output: str, group: Mapping[str, Any]) -> str:
    return f"What moves {output}{f', {group_text(group)}' if group else ''}"


def sensitivity_rows(fits: Sequence[Fit]) -> Table:
    """Put all fits into one table for other programs: a row for each time and value, in the units of the ranges."""
    swept = tuple(dict.fromkeys(path for fit in fits for path in fit.group))
    names = (
        *("reading", "time", "samples", "middle_s", "r2", "r2_predicted", "residual_s", "value", "unit", "low", "high"),
        *("slope_s_per_unit", "slope_standard_error", "change_s", "standardised", "rank_correlation"),
    )
    rows = tuple(
        (
            *(swept_text(fit.group.get(path)) for path in swept),
            *(fit.reading, fit.time, len(fit.interval.values), fit.middle),
            *(fit.determination, fit.predicted, fit.residual),
            *(effect.path, effect.unit, effect.low, effect.high, effect.slope, effect.error),
            *(effect.change, effect.standardised, effect.rank),
        )
        for fit in fits
        for effect in fit.effects
    )
    return Table("Sensitivities", tuple(map(Column, (*swept, *names))), rows)


def refused_table(refused: Sequence[RefusedRun]) -> Table:
    """Show the samples that were not computed, and why."""
    rows = tuple((sample.name, sample.reason) for sample in refused)
    return Table("Samples whose values do not fit together", (Column("run"), Column("reason")), rows)


def indices_table(sensitivity: Sensitivity) -> Table:
    """Show what moves an output, the value that matters most first."""
    labels, is_morris = path_labels([index.path for index in sensitivity.indices]), sensitivity.method == "morris"
    unit = f" {sensitivity.unit}" if sensitivity.unit else ""
    columns = [Column(name, digits=3) for name in ("total index", "± total", "first index", "± first")]
    if is_morris:
        names = ("mean size", "± size", "mean", "standard deviation")
        columns = [Column(name, sensitivity.unit, significant=3) for name in names]
    rows = []
    for index in sensitivity.indices:
        last = (index.mean, index.other) if is_morris else (index.other, index.other_error)
        rows.append((labels[index.path], index.size, index.size_error, *last))
    runs = f"{sensitivity.runs} runs, mean {sensitivity.mean:.3g}{unit}, standard deviation {sensitivity.deviation:.3g}"
    if (surrogate := sensitivity.surrogate) is not None:
        goodness = {name: getattr(surrogate, name) for name in ("error", "largest", "explained")}
        goodness |= {"unit": unit, "covered": 100 * surrogate.covered, "runs": _fitted_to(surrogate)}
        of = prose("notes", "surrogate", goodness)
    elif sensitivity.left_out:
        of = prose("notes", "left-out", {"blocks": sensitivity.blocks, "count": sensitivity.left_out})
    else:
        of = f"{sensitivity.blocks} blocks"
    note = f"{runs}{unit}; {of}. {prose('notes', sensitivity.method)}"
    return Table(_title(sensitivity.label, sensitivity.group), (Column("value"), *columns), tuple(rows), note)


def _fitted_to(fit: Validation) -> str:
    """Say how many runs a surrogate was fitted to, of how many, and why the others were left out."""
    why = [
        *([f"{fit.repeated} with the inputs of another"] if fit.repeated else []),
        *([f"{fit.missing} without this output"] if fit.missing else []),
    ]
    total = fit.runs + fit.repeated + fit.missing
    return f"{fit.runs} of {total} runs (left out: {', '.join(why)})" if why else f"{fit.runs} runs"


def prediction_table(predicted: Sequence[tuple[Surrogate, Prediction]], values: Mapping[str, Any]) -> Table:
    """Show predictions with their 95 % intervals, and how good the surrogates are."""
    columns = (
        *map(Column, ("output", "unit")),
        *(Column(name, significant=5) for name in ("predicted", "from", "to")),
        *(Column(name, significant=2) for name in ("error", "largest error")),
        Column("Q²", digits=3),
    )
    rows = tuple(
        (
            *(surrogate.output.replace("_", " "), surrogate.unit, prediction.value, prediction.low, prediction.high),
            *(surrogate.validation.error, surrogate.validation.largest, surrogate.validation.explained),
        )
        for surrogate, prediction in predicted
    )
    at = ", ".join(f"{label} {values[path]}" for path, label in path_labels(list(values)).items())
    fitted = {surrogate.output.replace("_", " "): _fitted_to(surrogate.validation) for surrogate, _ in predicted}
    same = len(set(fitted.values())) == 1
    of = next(iter(fitted.values())) if same else "; ".join(f"{name}: {runs}" for name, runs in fitted.items())
    return Table(f"Predicted for {at}", columns, rows, prose("notes", "prediction", {"runs": of}))
