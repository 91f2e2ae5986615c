"""Whether probabilities mean what they say: reliability, expected calibration error and Brier score."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Reliability", "reliability_of"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Reliability:
    """How often frames slip that are said to slip with some probability.

    Parameters
    ----------
    said, seen : (n_bins,) array
        Mean probability of slip in each bin, and the share of its frames that do slip; NaN in empty ones.
    count : (n_bins,) array of int
        Frames in each bin.
    error : float
        Expected calibration error: mean of the difference, weighted by frames (Guo et al. 2017).
    brier : float
        Brier score over all classes (Brier 1950): 0 is perfect, 2 the worst.
    """

    said: Floats
    seen: Floats
    count: NDArray[np.intp]
    error: float
    brier: float


def reliability_of(chances: Floats, classes: NDArray[np.int8], bins: int = 10) -> Reliability:
    """Return the reliability of probabilities of slip, incipient or gross.

    Parameters
    ----------
    chances : (n_samples, 3) array
        Probability of each class.
    classes : (n_samples,) array of int
        True class of each.
    bins : int, optional
        Equal parts of 0 to 1.
    """
    slip, slips = 1.0 - chances[:, 0], classes > 0
    place = np.clip((slip * bins).astype(np.intp), 0, bins - 1)
    count = np.bincount(place, minlength=bins)
    sums = [np.bincount(place, weights=one, minlength=bins) for one in (slip, slips.astype(float))]
    said, seen = (np.divide(one, count, out=np.full(bins, np.nan), where=count > 0) for one in sums)
    gap = np.abs(np.nan_to_num(said - seen))
    truth = classes[:, None] == np.arange(chances.shape[1])
    brier = float(((chances - truth) ** 2).sum(axis=1).mean())
    return Reliability(said, seen, count, float((gap * count).sum() / max(count.sum(), 1)), brier)
