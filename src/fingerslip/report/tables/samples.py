"""Tables of a study with samples: intervals of slip times, sensitivities, and samples that were refused."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from fingerslip.published import PublishedSet, PublishedValue
from fingerslip.report.labels import path_label, short_labels, swept_text
from fingerslip.results import RefusedRun, RunResult, StudyResult
from fingerslip.sampling.indices import Prediction, Sensitivity, Surrogate, Validation
from fingerslip.sampling.sensitivity import Effect, Fit, Interval, fits_of, groups_of, interval_of, published_intervals
from fingerslip.slip.windows import READINGS, TIMES, defines_time, event_label
from fingerslip.tables.table import Cell, Column, Missing, Table

INTERVAL_COLUMNS = tuple(Column(name, "s", 3) for name in ("smallest", "5 %", "median", "95 %", "largest"))
_WHERE = (
    "Percentages are shares of the samples: 5 % of them are earlier than the time below '5 %', and a published time "
    "'within, at 34 %' is later than 34 % of them."
)


def group_text(group: Mapping[str, Any]) -> str:
    """Return what samples have in common in words, such as 'phalanx original'; empty where nothing is swept."""
    return ", ".join(f"{path_label(path)} {swept_text(value)}" for path, value in group.items())


def interval_cells(interval: Interval | None) -> tuple[Cell, ...]:
    """Return the cells of :data:`INTERVAL_COLUMNS`."""
    if interval is None:
        return (Missing.NO_EVENT,) * len(INTERVAL_COLUMNS)
    return (interval.smallest, *(interval.percentile(percent) for percent in (5, 50, 95)), interval.largest)


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
            _span_text(value),
            *interval_cells(interval.interval),
            interval.where or Missing.NOT_DEFINED,
            f"{0 if interval.interval is None else len(interval.interval.values)} of {interval.samples}",
        ))  # fmt: skip
    return Table("Published times in the intervals of the samples", columns, tuple(rows), _WHERE)


def intervals_table(runs: Sequence[RunResult]) -> Table:
    """Show the interval of every slip time in every reading that was recorded."""
    columns = (Column("samples"), Column("time"), *INTERVAL_COLUMNS, Column("found in"))
    return Table("Slip times over the samples", columns, tuple(_interval_rows(runs)))


def _interval_rows(runs: Sequence[RunResult]) -> Iterator[tuple[Cell, ...]]:
    for group, members in groups_of(runs):
        for reading, words in READINGS.items():
            events = [run.events.reading(reading) for run in members]
            for time in TIMES if any(event.recorded for event in events) else ():
                interval = interval_of([event.time(time) for event in events])
                if defines_time(reading, time):
                    fault = f"{0 if interval is None else len(interval.values)} of {len(members)}"
                    name = f"{event_label(time)} ({words})"
                    yield (group_text(group) or "all", name, *interval_cells(interval), fault)


def sensitivity_table(fit: Fit) -> Table:
    """Show what each sampled value does to one slip time, the largest change over a range first."""
    columns = (
        *map(Column, ("value", "from", "to", "slope", "change over the range [ms]")),
        *(Column(name, digits=2) for name in ("standardised", "rank correlation")),
    )
    labels = short_labels([effect.path for effect in fit.effects])
    rows = tuple(
        (
            labels[effect.path],
            f"{effect.low:g} {effect.unit}".strip(),
            f"{effect.high:g} {effect.unit}".strip(),
            _slope_text(effect),
            f"{1e3 * effect.change:+.0f} ± {1e3 * effect.change_error:.0f}",
            effect.standardised,
            effect.rank,
        )
        for effect in fit.effects
    )
    note = (
        f"Linear regression over {len(fit.interval.values)} samples, ± standard error: {fit.middle:.3f} s in the "
        f"middle of all ranges, R² {fit.determination:.3f}, {fit.predicted:.3f} for samples that the fit has not "
        f"seen, standard deviation from it {1e3 * fit.residual:.0f} ms. Standardised: slope in standard deviations. "
        "Rank correlation: Spearman's, of each value alone."
    )
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


def _slope_text(effect: Effect) -> str:
    """Write a slope with its error, to two digits of the error but no fewer than three decimals."""
    decimals = min(max(1 - math.floor(math.log10(effect.error or 1.0)), 3), 6)
    unit = f"s/{effect.unit}" if effect.unit else "s"
    return f"{effect.slope:+.{decimals}f} ± {effect.error:.{decimals}f} {unit}"


def _span_text(value: PublishedValue) -> str:
    if value.span is not None:
        return f"{value.span[0]:.2f} to {value.span[1]:.2f}"
    return "" if value.value is None else f"{value.value:.2f}"


_SOBOL = (
    "Total: the share of the variance that is left when all other values are known; first: the share that goes when "
    "this one is known; the difference is interaction. ± half of the 95 % interval."
)
_MORRIS = (
    "Elementary effects: change over a step of a value by two thirds of its range, over the step. ± half of the 95 % "
    "interval. A large standard deviation means that the effect depends on the other values."
)


def indices_table(sensitivity: Sensitivity) -> Table:
    """Show what moves an output, the value that matters most first."""
    labels = short_labels([index.path for index in sensitivity.indices])
    names, note = ("total index", "± total", "first index", "± first"), _SOBOL
    columns = [Column(name, digits=3) for name in names]
    if sensitivity.method == "morris":
        names, note = ("mean size", "± size", "mean", "standard deviation"), _MORRIS
        columns = [Column(name, sensitivity.unit, significant=3) for name in names]
    rows = []
    for index in sensitivity.indices:
        last = (index.mean, index.other) if sensitivity.method == "morris" else (index.other, index.other_error)
        rows.append((labels[index.path], index.size, index.size_error, *last))
    title = _title(sensitivity.label, sensitivity.group)
    return Table(title, (Column("value"), *columns), tuple(rows), f"{_of_runs(sensitivity)} {note}")


def _of_runs(sensitivity: Sensitivity) -> str:
    unit = f" {sensitivity.unit}" if sensitivity.unit else ""
    spread = f"mean {sensitivity.mean:.3g}{unit}, standard deviation {sensitivity.deviation:.3g}{unit}"
    runs = f"{sensitivity.runs} runs, {spread}"
    surrogate = sensitivity.surrogate
    if surrogate is not None:
        return f"{runs}; indices of a surrogate of {_fitted_to(surrogate)}: {_goodness(surrogate, unit)}."
    left = sensitivity.left_out
    words = f", {left} left out because the event did not happen in all of their runs" if left else ""
    return f"{runs}; {sensitivity.blocks} blocks{words}."


def _goodness(fit: Validation, unit: str) -> str:
    return (
        f"for runs that it has not seen, its error is {fit.error:.3g}{unit} (root mean square), at most "
        f"{fit.largest:.3g}{unit}, Q² {fit.explained:.3f}, and {100 * fit.covered:.0f} % lie in its 95 % interval"
    )


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
    at = ", ".join(f"{label} {values[path]}" for path, label in short_labels(list(values)).items())
    fitted = {surrogate.output.replace("_", " "): _fitted_to(surrogate.validation) for surrogate, _ in predicted}
    same = len(set(fitted.values())) == 1
    of = next(iter(fitted.values())) if same else "; ".join(f"{name}: {runs}" for name, runs in fitted.items())
    note = (
        f"A Gaussian process of {of}. From, to: its 95 % interval. Errors and Q²: of runs that it has not seen, "
        "in five-fold cross-validation."
    )
    return Table(f"Predicted for {at}", columns, rows, note)
