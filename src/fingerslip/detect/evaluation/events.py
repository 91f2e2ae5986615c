"""Scores of events: how early or late slip is found, how long before gross slip, and how often where there is none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.conformal import lead_bound, least_trials
from fingerslip.detect.evaluation.bootstrap import Estimate, bootstrapped
from fingerslip.detect.onsets import Onsets

__all__ = ["EventScores", "event_scores_of"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class EventScores:
    """How well events are found."""

    trials: int  # trials with incipient slip
    missed: int  # trials in which no slip was found
    before_gross: Estimate  # share of the trials with gross slip in which slip was found before it
    error: Estimate  # mean of the time found less the label, and of its size [s]
    absolute_error: Estimate  # mean of the time found less the label, and of its size [s]
    error_spread: float | None  # standard deviation of the error [s]
    delay_frames: float | None  # median error in frames
    early: Estimate  # share of the trials in which slip was found before its label
    # share of all trials in which slip was found while the sensor was at rest, or where there is none
    at_rest: Estimate
    lead: Estimate  # mean time from the slip found to the label of gross slip [s]
    lead_spread: float | None  # its standard deviation [s]
    bound: float | None  # lead that a new trial has with 95 % [s]
    gross_error: Estimate  # mean of the time of gross slip found less its label [s]
    gross_found: Estimate  # share of the trials with gross slip in which gross slip was found at all


def event_scores_of(
    found: Mapping[str, Onsets],
    labels: Mapping[str, Onsets],
    rest_end: Mapping[str, float],
    *,
    frame: float = np.nan,
    share: float = 0.05,
    seed: int = 0,
) -> EventScores:
    """Return the scores of the onsets found in trials.

    Units: rest_end [s]; frame [s].
    """
    names = list(found)
    slips = [name for name in names if labels[name].incipient is not None]
    error = _times([(found[name].first, labels[name].incipient) for name in slips])
    lead = _times([(labels[name].gross, found[name].first) for name in names if labels[name].gross is not None])
    gross = _times([(found[name].gross, labels[name].gross) for name in names if labels[name].gross is not None])
    alarms = np.array([_is_false(found[name], labels[name], rest_end[name]) for name in names], dtype=float)
    early = np.where(np.isnan(error), 0.0, error < 0.0)
    before = np.where(np.isnan(lead), 0.0, lead > 0.0)
    leads = [None if np.isnan(one) else float(one) for one in lead]
    return EventScores(
        trials=len(slips),
        missed=int(np.isnan(error).sum()),
        before_gross=_mean(before, seed),
        error=_mean(error, seed),
        absolute_error=_mean(np.abs(error), seed),
        error_spread=_spread(error),
        delay_frames=_middle(error / frame),
        early=_mean(early, seed),
        at_rest=_mean(alarms, seed),
        lead=_mean(lead, seed),
        lead_spread=_spread(lead),
        bound=lead_bound(leads, share) if len(leads) >= least_trials(share) else None,
        gross_error=_mean(gross, seed),
        gross_found=_mean((~np.isnan(gross)).astype(float), seed),
    )


def _times(pairs: list[tuple[float | None, float | None]]) -> Floats:
    """Return differences of times; NaN where one of them is missing."""
    return np.array([np.nan if one is None or other is None else one - other for one, other in pairs], dtype=float)


def _is_false(found: Onsets, label: Onsets, rest_end: float) -> bool:
    return found.first is not None and (label.first is None or found.first <= rest_end)


def _mean(values: Floats, seed: int) -> Estimate:
    """Return the mean of what is there, with its interval over all trials."""
    return bootstrapped(lambda drawn: _known_mean(values[drawn]), len(values), seed=seed)


def _known_mean(values: Floats) -> float:
    known = values[~np.isnan(values)]
    return float(known.mean()) if known.size else float("nan")


def _spread(values: Floats) -> float | None:
    known = values[~np.isnan(values)]
    return float(known.std(ddof=1)) if known.size > 1 else None


def _middle(values: Floats) -> float | None:
    known = values[~np.isnan(values)]
    return float(np.median(known)) if known.size else None
