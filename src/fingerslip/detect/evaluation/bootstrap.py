"""Intervals from resampled trials: frames of one trial are no independent evidence, trials are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Estimate", "bootstrapped"]


@dataclass(frozen=True)
class Estimate:
    """A number and the middle 95 % of what it is for resampled trials."""

    value: float | None  # the number
    low: float | None = None  # ends of the interval
    high: float | None = None  # ends of the interval


def bootstrapped(
    statistic: Callable[[NDArray[np.intp]], float], trials: int, *, draws: int = 1000, seed: int = 0
) -> Estimate:
    """Return a statistic of trials with its interval (percentile bootstrap, Efron & Tibshirani 1993)."""
    if trials == 0:
        return Estimate(None)
    value = statistic(np.arange(trials))
    if not np.isfinite(value):
        return Estimate(None)
    if trials < 2:
        return Estimate(float(value))
    draw = np.random.default_rng(seed)
    found = np.array([statistic(draw.integers(trials, size=trials)) for _ in range(draws)])
    found = found[np.isfinite(found)]
    if len(found) < draws / 2:
        return Estimate(float(value))
    low, high = np.quantile(found, (0.025, 0.975))
    return Estimate(float(value), float(low), float(high))
