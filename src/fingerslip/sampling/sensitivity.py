"""What each sampled value does to a slip time: linear regression over the samples, and rank correlation.

With the sampled values x_j of sample i in the middle m_j and over the range r_j, the fit is

    t_i = t_m + sum_j b_j (x_ij - m_j) + e_i,

by least squares. b_j is the partial derivative of the time, b_j r_j its change over the range, b_j s(x_j) / s(t) the
standardised coefficient with standard deviations s. R^2 is the share of the variance that the fit explains; predicted
R^2 is the same where every sample is left out of the fit that predicts it, which too many values for too few samples
cannot flatter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.published import PublishedSet, PublishedValue
from fingerslip.results import REPEAT, SAMPLE, RunResult, StudyResult
from fingerslip.slip.windows import READINGS, TIMES, defines_time
from fingerslip.units import split_quantity

# How a paper that names no reading may have read: from slip, or from acceleration peaks.
_LIKELY_READINGS = ("slip", "acceleration")


@dataclass(frozen=True)
class Interval:
    """Numbers of samples, from the smallest to the largest."""

    values: tuple[float, ...]  # the numbers in ascending order
    missing: int = 0  # samples without it: the event did not happen

    @property
    def summary(self) -> tuple[float, ...]:
        """Smallest number, the percentiles 5, 50 and 95, linear between samples, and the largest."""
        return tuple(np.percentile(self.values, (0, 5, 50, 95, 100)).tolist())


@dataclass(frozen=True)
class PublishedInterval:
    """A published time, and the interval of ours."""

    value: PublishedValue  # the published time
    reading: str  # how ours was read
    interval: Interval | None  # ours over the samples
    samples: int  # samples that were computed

    @property
    def where(self) -> str:
        """Where the published time lies: 'within, at 34 %', 'below all', 'above all'; empty without an interval."""
        span = self.value.span or (self.value.value or 0.0,) * 2
        return "" if self.interval is None else position(span, self.interval)


def interval_of(values: Sequence[float | None]) -> Interval | None:
    """Return the interval of some numbers; None where there is none at all."""
    times = sorted(value for value in values if value is not None)
    return Interval(tuple(times), len(values) - len(times)) if times else None


def position(span: tuple[float, float], interval: Interval) -> str:
    """Return where a published range lies in an interval: the share of samples below its middle where they overlap."""
    if span[1] < interval.values[0]:
        return "below all"
    if span[0] > interval.values[-1]:
        return "above all"
    below = np.mean(np.asarray(interval.values) < 0.5 * (span[0] + span[1]))
    return f"within, at {100.0 * below:.0f} %"


def published_intervals(runs: Sequence[RunResult], references: Sequence[PublishedSet]) -> tuple[PublishedInterval, ...]:
    """Return the interval over samples for every published time, in the reading of the paper or the likely ones."""
    intervals: dict[tuple[object, ...], PublishedInterval] = {}
    for value in (value for reference in references for value in reference.values):
        # A condition on a sampled value is what the samples leave open.
        members = [run for run in runs if value.unmet(run.all_values).keys() <= run.sampled.keys()]
        if value.value is None or value.quantity not in TIMES or not members:
            continue
        for reading in (value.reading,) if value.reading else _LIKELY_READINGS:
            events = [run.events.reading(reading) for run in members]
            if any(event.recorded for event in events):
                interval = interval_of([event.time(value.quantity) for event in events])
                # A paper may print one time twice.
                key = (value.quantity, reading, value.value, *sorted(map(str, value.conditions.items())))
                intervals.setdefault(key, PublishedInterval(value, reading, interval, len(members)))
    return tuple(intervals.values())


@dataclass(frozen=True)
class Effect:
    """What one sampled value does to a slip time."""

    path: str  # dotted path of the value
    unit: str  # its unit
    low: float  # ends of its range, in its unit
    high: float
    slope: float  # partial derivative of the time [s per unit]
    error: float  # its standard error
    standardised: float  # slope times the standard deviation of the value over that of the time [-]
    rank: float  # rank correlation of value and time (Spearman) [-]

    @property
    def change(self) -> float:
        """Change of the time from one end of the range to the other [s]."""
        return self.slope * (self.high - self.low)

    @property
    def change_error(self) -> float:
        """Standard error of the change [s]."""
        return self.error * (self.high - self.low)


@dataclass(frozen=True)
class Fit:
    """The linear fit of one slip time over the samples."""

    group: Mapping[str, Any]  # what the samples have in common: their swept values by dotted path
    reading: str
    time: str
    middle: float  # fitted time in the middle of all ranges [s]
    residual: float  # standard deviation of the samples from the fit [s]
    determination: float  # R^2
    predicted: float  # predicted R^2
    interval: Interval  # the times of the samples [s]
    effects: tuple[Effect, ...]  # the effect of each value, the largest change first


def groups_of(runs: Sequence[RunResult]) -> tuple[tuple[Mapping[str, Any], tuple[RunResult, ...]], ...]:
    """Return the samples of each combination of swept values, beside these values."""
    groups: dict[str, tuple[Mapping[str, Any], list[RunResult]]] = {}
    for run in runs:
        swept = {path: value for path, value in run.swept.items() if path not in (SAMPLE, REPEAT)}
        groups.setdefault(repr(swept), (swept, []))[1].append(run)
    return tuple((swept, tuple(members)) for swept, members in groups.values())


def fits_of(study: StudyResult) -> tuple[Fit, ...]:
    """Fit every time in every reading for each combination of swept values; see :func:`fit_samples`."""
    fits = (
        fit_samples(members, study.ranges, reading, time, group)
        for reading in READINGS
        for time in TIMES
        if defines_time(reading, time)
        for group, members in groups_of(study.runs)
    )
    return tuple(fit for fit in fits if fit is not None)


def fit_samples(
    runs: Sequence[RunResult],
    ranges: Mapping[str, Sequence[Any]],
    reading: str,
    time: str,
    group: Mapping[str, Any] | None = None,
) -> Fit | None:
    """Fit one slip time as a linear function of the sampled values."""
    # scipy.stats is slow to import, and needed here alone.
    from scipy.stats import rankdata

    times = [run.events.reading(reading).time(time) for run in runs]
    interval = interval_of(times)
    if interval is None or len(interval.values) < len(ranges) + 2 or len(set(interval.values)) == 1:
        return None
    observed = np.array([entry for entry in times if entry is not None])
    runs_with_time = [run for run, entry in zip(runs, times, strict=True) if entry is not None]
    values = np.array([[number_and_unit(run.sampled[path])[0] for path in ranges] for run in runs_with_time])
    ends = np.array([[number_and_unit(end)[0] for end in two] for two in ranges.values()])
    widths = np.ptp(ends, axis=1)
    coefficients, errors, quality = _regression((values - ends.mean(axis=1)) / widths, observed)
    slopes = coefficients[1:] / widths
    standardised = slopes * values.std(axis=0) / observed.std()
    ranks = [np.corrcoef(rankdata(column), rankdata(observed))[0, 1] for column in values.T]
    numbers = np.column_stack((ends, slopes, errors[1:] / widths, standardised, ranks)).tolist()
    effects = (
        Effect(path, number_and_unit(two[0])[1], *row) for (path, two), row in zip(ranges.items(), numbers, strict=True)
    )
    ordered = tuple(sorted(effects, key=lambda effect: -abs(effect.change)))
    return Fit(dict(group or {}), reading, time, float(coefficients[0]), *quality, interval, ordered)


def _regression(columns: Floats, observed: Floats) -> tuple[Floats, Floats, tuple[float, float, float]]:
    """Fit `observed` (n,) by a constant and the `columns` (n, p).

    Return the coefficients and their standard errors, (p + 1,), and residual, R^2 and predicted R^2.
    """
    n, p = columns.shape
    design = np.column_stack([np.ones(n), columns])
    orthonormal, triangle = np.linalg.qr(design)
    coefficients = np.linalg.solve(triangle, orthonormal.T @ observed)
    left_over = observed - design @ coefficients
    leverage = np.sum(orthonormal**2, axis=1)
    total = float(np.sum((observed - observed.mean()) ** 2))
    variance = float(left_over @ left_over) / (n - p - 1)
    errors = np.sqrt(variance * np.sum(np.linalg.inv(triangle) ** 2, axis=1))
    determination = 1.0 - float(left_over @ left_over) / total
    predicted = 1.0 - float(np.sum((left_over / (1.0 - leverage)) ** 2)) / total
    return coefficients, errors, (float(np.sqrt(variance)), determination, predicted)


def number_and_unit(value: object) -> tuple[float, str]:
    """Return the number of a sampled value and its unit, which is empty for a plain number."""
    quantity = split_quantity(value) if isinstance(value, str) else None
    return quantity or (float(str(value)), "")
