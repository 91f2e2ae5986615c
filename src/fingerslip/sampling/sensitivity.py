"""What each sampled value does to a slip time: linear regression over the samples, and rank correlation.

With the sampled values x_j of sample i in the middle m_j and over the range r_j, the fit is

    t_i = t_m + sum_j b_j (x_ij - m_j) + e_i,

by least squares. b_j is the partial derivative of the time, b_j r_j its change over the range, b_j s(x_j) / s(t) the
standardised coefficient with standard deviations s. R^2 is the share of the variance that the fit explains; predicted
R^2 is the same where every sample is left out of the fit that predicts it, which too many values for too few samples
cannot flatter.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.results import REPEAT, SAMPLE, RunResult, StudyResult
from fingerslip.sampling.intervals import Interval, interval_of
from fingerslip.slip.names import READINGS, TIMES, is_defined
from fingerslip.units import split_quantity

__all__ = ["Effect", "Fit", "fit_samples", "fits_of", "groups_of", "number_and_unit"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Effect:
    """What one sampled value does to a slip time."""

    path: str  # dotted path of the value
    unit: str  # its unit
    low: float  # ends of its range, in its unit
    high: float  # ends of its range, in its unit
    slope: float  # partial derivative of the time and its standard error [s per unit]
    error: float  # partial derivative of the time and its standard error [s per unit]
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
    reading: str  # which time, in which reading
    time: str  # which time, in which reading
    middle: float  # fitted time in the middle of all ranges [s]
    residual: float  # standard deviation of the samples from the fit [s]
    determination: float  # R^2 and predicted R^2 [-]
    predicted: float  # R^2 and predicted R^2 [-]
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
        if is_defined(reading, time)
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
    if interval is None or len(interval.values) < len(ranges) + 2 or interval.smallest == interval.largest:
        return None
    observed = np.array([one for one in times if one is not None])
    known = [run for run, one in zip(runs, times, strict=True) if one is not None]
    values = np.array([[number_and_unit(run.sampled[path])[0] for path in ranges] for run in known])
    ends = np.array([[number_and_unit(end)[0] for end in two] for two in ranges.values()])
    fit = _regression((values - ends.mean(axis=1)) / np.ptp(ends, axis=1), observed)
    effects = (
        Effect(
            path,
            number_and_unit(two[0])[1],
            float(ends[j, 0]),
            float(ends[j, 1]),
            slope=float(fit.slopes[j] / np.ptp(ends[j])),
            error=float(fit.errors[j] / np.ptp(ends[j])),
            standardised=float(fit.slopes[j] / np.ptp(ends[j]) * values[:, j].std() / observed.std()),
            rank=float(np.corrcoef(rankdata(values[:, j]), rankdata(observed))[0, 1]),
        )
        for j, (path, two) in enumerate(ranges.items())
    )
    return Fit(
        group=dict(group or {}),
        reading=reading,
        time=time,
        interval=interval,
        effects=tuple(sorted(effects, key=lambda effect: -abs(effect.change))),
        **{name: value for name, value in dataclasses.asdict(fit).items() if name not in ("slopes", "errors")},
    )


@dataclass(frozen=True)
class _Regression:
    """A least-squares fit; slopes and their standard errors are per column."""

    middle: float
    slopes: Array
    errors: Array
    residual: float
    determination: float
    predicted: float


def _regression(columns: Array, observed: Array) -> _Regression:
    """Fit `observed` (n,) by a constant and the `columns` (n, p)."""
    n, p = columns.shape
    design = np.column_stack([np.ones(n), columns])
    orthonormal, triangle = np.linalg.qr(design)
    found = np.linalg.solve(triangle, orthonormal.T @ observed)
    left_over = observed - design @ found
    leverage = np.sum(orthonormal**2, axis=1)
    total = float(np.sum((observed - observed.mean()) ** 2))
    variance = float(left_over @ left_over) / (n - p - 1)
    errors = np.sqrt(variance * np.sum(np.linalg.inv(triangle) ** 2, axis=1))
    return _Regression(
        middle=float(found[0]),
        slopes=found[1:],
        errors=errors[1:],
        residual=float(np.sqrt(variance)),
        determination=1.0 - float(left_over @ left_over) / total,
        predicted=1.0 - float(np.sum((left_over / (1.0 - leverage)) ** 2)) / total,
    )


def number_and_unit(value: object) -> tuple[float, str]:
    """Return the number of a sampled value and its unit, which is empty for a plain number.

    Examples
    --------
    >>> number_and_unit("6.5 mm"), number_and_unit(0.48)
    ((6.5, 'mm'), (0.48, ''))
    """
    parts = split_quantity(value) if isinstance(value, str) else None
    return parts or (float(str(value)), "")
