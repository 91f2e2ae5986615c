"""What samples of unknown values say: the interval of each slip time, and what each value does to it."""

from __future__ import annotations

from fingerslip.sampling.sensitivity import (
    Effect,
    Fit,
    Interval,
    PublishedInterval,
    fit_samples,
    fits_of,
    groups_of,
    interval_of,
    published_intervals,
)

__all__ = [
    "Effect",
    "Fit",
    "Interval",
    "PublishedInterval",
    "fit_samples",
    "fits_of",
    "groups_of",
    "interval_of",
    "published_intervals",
]
