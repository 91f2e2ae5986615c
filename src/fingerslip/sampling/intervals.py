"""The interval of a number over samples, and where a published value lies in it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fingerslip.published import PublishedSet, PublishedValue
from fingerslip.results import RunResult
from fingerslip.slip.names import READINGS, TIMES

__all__ = ["Interval", "PublishedInterval", "interval_of", "position", "published_intervals"]

# How a paper that names no reading may have read: from slip, or from acceleration peaks.
_LIKELY_READINGS = ("slip", "acceleration")


@dataclass(frozen=True)
class Interval:
    """Numbers of samples, from the smallest to the largest."""

    values: tuple[float, ...]  # the numbers in ascending order
    missing: int = 0  # samples without it: the event did not happen

    @property
    def smallest(self) -> float:
        """Smallest number."""
        return self.values[0]

    @property
    def largest(self) -> float:
        """Largest number."""
        return self.values[-1]

    def percentile(self, percent: float) -> float:
        """Return the number below which `percent` [%] of the samples lie, linear between samples."""
        return float(np.percentile(self.values, percent))


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
    """Return the interval of some numbers; None where there is none at all.

    Examples
    --------
    >>> interval_of([1.5, None, 1.2])
    Interval(values=(1.2, 1.5), missing=1)
    """
    known = sorted(value for value in values if value is not None)
    return Interval(tuple(known), len(values) - len(known)) if known else None


def position(span: tuple[float, float], interval: Interval) -> str:
    """Return where a published range lies in an interval: the share of samples below its middle where they overlap.

    Parameters
    ----------
    span : tuple of float
        Smallest and largest published value, the same for a single one.
    interval : Interval
        Ours.

    Examples
    --------
    >>> position((1.5, 1.5), Interval((1.0, 1.4, 1.6, 2.0))), position((0.8, 0.9), Interval((1.0, 2.0)))
    ('within, at 50 %', 'below all')
    """
    if span[1] < interval.smallest:
        return "below all"
    if span[0] > interval.largest:
        return "above all"
    below = np.mean(np.asarray(interval.values) < 0.5 * (span[0] + span[1]))
    return f"within, at {100.0 * below:.0f} %"


def published_intervals(runs: Sequence[RunResult], references: Sequence[PublishedSet]) -> tuple[PublishedInterval, ...]:
    """Return the interval over samples for every published time, in the reading of the paper or the likely ones."""
    found: dict[tuple[object, ...], PublishedInterval] = {}
    for value in (value for reference in references for value in reference.values):
        for one in _intervals(runs, value):
            # A paper may print one time twice.
            key = (value.quantity, one.reading, value.value, *sorted(map(str, value.conditions.items())))
            found.setdefault(key, one)
    return tuple(found.values())


def _intervals(runs: Sequence[RunResult], value: PublishedValue) -> Iterator[PublishedInterval]:
    # A condition on a sampled value is what the samples leave open.
    members = [run for run in runs if value.unmet(run.all_values).keys() <= run.sampled.keys()]
    if value.value is None or value.quantity not in TIMES or not members:
        return
    for reading in (value.reading,) if value.reading else _LIKELY_READINGS:
        assert reading in READINGS
        events = [run.events.reading(reading) for run in members]
        if any(event.recorded for event in events):
            times = [event.time(value.quantity) for event in events]
            yield PublishedInterval(value, reading, interval_of(times), len(members))
