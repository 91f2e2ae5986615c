"""From probabilities of single frames to alarms: smoothing, thresholds, and bounds for the next trial.

Thresholds and bounds that hold for the next trial whatever the classifier, from trials that it did not learn from.

Split conformal prediction (Vovk et al. 2005, Angelopoulos & Bates 2023): among n + 1 trials that could have come in any
order, the new one is as likely to have any rank as any other.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.labels import Onsets
from fingerslip.errors import InputError

Floats = NDArray[np.float64]

#: Probabilities of a frame count as at least this: a forest of 50 trees cannot tell less from nothing.
_LEAST = 1e-3


@dataclass(frozen=True)
class ForwardFilter:
    """The forward recursion of a hidden Markov model: no slip, then incipient, then gross slip (Rabiner 1989)."""

    dwell: tuple[float, float]  # mean time without slip, and of incipient slip [s]
    prior: tuple[float, float, float]  # shares of the classes among the training frames
    weight: float  # how much a frame counts: 1 for independent frames, 1 / window for velocities that share frames

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not np.all(np.isfinite(value)) or np.min(value) <= 0:
                raise InputError(f"smoothing: {name}", f"got {value}", "needs finite numbers > 0")

    def start(self) -> Floats:
        """Return the state before the first frame: log probabilities, almost surely no slip."""
        state: Floats = np.log(np.array([1.0 - 2.0 * _LEAST, _LEAST, _LEAST]))
        return state

    def scores(self, state: Floats, interval: Floats, probabilities: Floats) -> tuple[Floats, Floats]:
        """Return the log odds (n_times, 2) that there is slip, and that it is gross, and the state after the frames.

        The intervals (n_times,) are times since the frame before each [s], and the probabilities (n_times, 3) those of
        the classes, NaN where a frame could not be classified.
        """
        likelihood = self.weight * (np.log(np.maximum(probabilities, _LEAST)) - np.log(self.prior))
        likelihood[np.isnan(probabilities).any(axis=1)] = 0.0
        leave = -np.expm1(-np.asarray(interval)[:, None] / np.array(self.dwell))
        beliefs: Floats = _forward()(state, leave, likelihood)
        # A chain of no frames leaves the state as it was.
        return _log_odds(beliefs), (beliefs[-1] if len(beliefs) else state)


@functools.cache
def _forward() -> Callable[..., Any]:
    """Return the recursion, compiled: a trial has thousands of frames."""
    import numba

    compiled: Callable[..., Any] = numba.njit(cache=True)(_recursion)
    return compiled


def _recursion(state: Floats, leave: Floats, likelihood: Floats) -> Floats:  # pragma: no cover  it is compiled
    """Return the log probabilities after each frame, (n_times, 3), of a chain that only goes on."""
    beliefs = np.empty_like(likelihood)
    before = state.copy()
    for frame in range(len(likelihood)):
        chance = np.exp(before)
        gone, further = chance[0] * leave[frame, 0], chance[1] * leave[frame, 1]
        # In the log domain, so that what is very unlikely now may still become true.
        before[0] += np.log1p(-leave[frame, 0])
        before[1] = np.log(max(chance[1] - further + gone, 1e-300))
        before[2] = np.log(max(chance[2] + further, 1e-300))
        before += likelihood[frame]
        before -= before.max() + np.log(np.exp(before - before.max()).sum())
        beliefs[frame] = before
    return beliefs


def single_frame_scores(probabilities: Floats) -> Floats:
    """Return the scores (n_times, 2) of frames on their own, of probabilities (n_times, 3); -inf where they are NaN."""
    classified, scores = ~np.isnan(probabilities).any(axis=1), np.full((len(probabilities), 2), -np.inf)
    scores[classified] = _log_odds(np.log(np.maximum(probabilities[classified], _LEAST)))
    return scores


def _log_odds(beliefs: Floats) -> Floats:
    """Return log odds of slip and of gross slip, from log probabilities that need not sum to one."""
    slip = np.logaddexp(beliefs[:, 1], beliefs[:, 2]) - beliefs[:, 0]
    gross = beliefs[:, 2] - np.logaddexp(beliefs[:, 0], beliefs[:, 1])
    return np.stack([slip, gross], axis=1)


@dataclass(frozen=True)
class Thresholds:
    """Log odds beyond which slip, and gross slip, has begun; 0 is as likely as not."""

    slip: float = 0.0
    gross: float = 0.0


def onsets_from(time: Floats, scores: Floats, thresholds: Thresholds | None = None) -> Onsets:
    """Return the first times at which scores are above their thresholds.

    Gross slip is slip: it counts only once slip was found, so the guarantee of that threshold holds for both.
    """
    limits = thresholds or Thresholds()
    slip = np.maximum.accumulate(scores[:, 0] > limits.slip)
    above = (slip, slip & (scores[:, 1] > limits.gross))
    return Onsets(*(float(time[np.argmax(flags)]) if flags.any() else None for flags in above))


def least_trials(share: float = 0.05) -> int:
    """Return how many trials a guarantee needs: 19 for 5 %."""
    if not 0.0 < share < 1.0:
        raise InputError("share", f"got {share}", "needs a number between 0 and 1")
    return math.ceil(1.0 / share - 1e-9) - 1


def false_alarm_threshold(maxima: Sequence[float], share: float = 0.05) -> float:
    """Return the threshold that the largest score of a new no-slip trial exceeds in at most a share of them."""
    _check_count(len(maxima), share)
    rank = math.ceil((len(maxima) + 1) * (1.0 - share) - 1e-9)
    return float(sorted(maxima)[rank - 1])


def lead_bound(leads: Sequence[float | None], share: float = 0.05) -> float | None:
    """Return the lead before gross slip that a new trial has in at least 1 - share of them [s]."""
    _check_count(len(leads), share)
    rank = math.floor((len(leads) + 1) * share + 1e-9)
    bound = sorted(-math.inf if lead is None else lead for lead in leads)[rank - 1]
    return bound if math.isfinite(bound) else None


def _check_count(count: int, share: float) -> None:
    needed = least_trials(share)
    if count < needed:
        fault = f"got {count} trials for a guarantee of {1.0 - share:.4g}"
        raise InputError("calibration", fault, f"needs at least {needed}", "keep more trials out of the training")
