"""Whether probabilities mean what they say: reliability, expected calibration error and Brier score."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Reliability", "reliability_of"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Reliability:
    """How often frames slip that are said to slip with some probability."""

    said: Floats  # (n_bins,), mean probability of slip in each bin, and the share of its frames that do slip
    seen: Floats  # (n_bins,), mean probability of slip in each bin, and the share of its frames that do slip
    count: NDArray[np.intp]  # (n_bins,), frames in each bin
    error: float  # expected calibration error: mean of the difference, weighted by frames (Guo et al
    brier: float  # brier score over all classes (Brier 1950): 0 is perfect, 2 the worst


def reliability_of(chances: Floats, classes: NDArray[np.int8], bins: int = 10) -> Reliability:
    """Return the reliability of probabilities of slip, incipient or gross.

    Arrays: chances (n_samples, 3); classes (n_samples,).
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
