"""Thresholds and bounds that hold for the next trial whatever the classifier, from trials that it did not learn from.

Split conformal prediction (Vovk et al. 2005, Angelopoulos & Bates 2023): among n + 1 trials that could have come in any
order, the new one is as likely to have any rank as any other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from fingerslip.errors import InputError

__all__ = ["false_alarm_threshold", "lead_bound", "least_trials"]


def least_trials(share: float) -> int:
    """Return how many trials a guarantee needs: 19 for 5 %.

    Examples
    --------
    >>> least_trials(0.05)
    19
    """
    _check_share(share)
    return math.ceil(1.0 / share - 1e-9) - 1


def false_alarm_threshold(maxima: Sequence[float], share: float = 0.05) -> float:
    """Return the threshold that the largest score of a new no-slip trial exceeds in at most a share of them."""
    _check_count(len(maxima), share)
    rank = math.ceil((len(maxima) + 1) * (1.0 - share) - 1e-9)
    return float(sorted(maxima)[rank - 1])


def lead_bound(leads: Sequence[float | None], share: float = 0.05) -> float | None:
    """Return the lead before gross slip that a new trial has in at least 1 - share of them [s].

    Units: leads [s].
    """
    _check_count(len(leads), share)
    rank = math.floor((len(leads) + 1) * share + 1e-9)
    bound = sorted(-math.inf if lead is None else lead for lead in leads)[rank - 1]
    return bound if math.isfinite(bound) else None


def _check_share(share: float) -> None:
    if not 0.0 < share < 1.0:
        raise InputError("share", f"got {share}", "needs a number between 0 and 1")


def _check_count(count: int, share: float) -> None:
    needed = least_trials(share)
    if count < needed:
        found = f"got {count} trials for a guarantee of {1.0 - share:.4g}"
        raise InputError("calibration", found, f"needs at least {needed}", "keep more trials out of the training")
