"""Intervals from resampled trials: frames of one trial are no independent evidence, trials are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Estimate", "bootstrapped"]


@dataclass(frozen=True)
class Estimate:
    """A number and the middle 95 % of what it is for resampled trials.

    Parameters
    ----------
    value : float or None
        The number; None where it is not defined.
    low, high : float or None
        Ends of the interval.
    """

    value: float | None
    low: float | None = None
    high: float | None = None


def bootstrapped(
    statistic: Callable[[NDArray[np.intp]], float], trials: int, *, draws: int = 1000, seed: int = 0
) -> Estimate:
    """Return a statistic of trials with its interval (percentile bootstrap, Efron & Tibshirani 1993).

    Parameters
    ----------
    statistic : callable
        From the numbers of trials, each as often as it was drawn, to a number; NaN where it is not defined.
    trials : int
        Number of trials.
    draws, seed : int, optional
        How often they are drawn anew, and the seed of that.

    Returns
    -------
    Estimate
        Without an interval where there are fewer than two trials, or most draws have no value.
    """
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
