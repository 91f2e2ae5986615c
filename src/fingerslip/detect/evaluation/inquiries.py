"""What a classifier needs and uses: its learning curve, and how much it relies on each ring of markers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.classifiers import Candidate, columns_of, probabilities
from fingerslip.detect.evaluation.scores import (
    Estimate,
    bootstrap_estimate,
    confusion_by_trial,
    frame_scores_of,
    precision_recall_f1,
)
from fingerslip.detect.features import ring_of_features
from fingerslip.detect.samples import Samples, held_out
from fingerslip.detect.training import fit_detector
from fingerslip.errors import InputError

__all__ = ["CurvePoint", "importance_by_ring", "learning_curve"]


@dataclass(frozen=True)
class CurvePoint:
    """A point of a learning curve."""

    trials: int  # trials that were learned from
    # share of right frames, and mean F1 of the classes, on the test trials, with intervals over these
    accuracy: Estimate
    f1: Estimate  # share of right frames, and mean F1 of the classes, on the test trials, with intervals over these


def learning_curve(
    samples: Samples,
    candidate: Candidate,
    tests: Sequence[str],
    sizes: Sequence[int],
    *,
    seed: int = 0,
    workers: int = 1,
) -> list[CurvePoint]:
    """Return how well a classifier does on test trials after it learned from more and more others."""
    rest = [name for name in samples.trials if name not in set(tests)]
    order = held_out(rest, len(rest), seed)
    points = []
    for size in sizes:
        if not 1 <= size <= len(rest):
            raise InputError("sizes", f"got {size}", f"needs 1 to {len(rest)}, the trials that are no test trials")
        estimator = fit_detector(candidate, samples, _rows(samples, order[:size]), seed, workers)
        matrices = _matrices(samples, candidate, estimator, _rows(samples, tests))
        points.append(CurvePoint(size, frame_scores_of(matrices, seed=seed).accuracy, _mean_f1(matrices, seed)))
    return points


def importance_by_ring(
    samples: Samples, candidate: Candidate, tests: Sequence[str], *, draws: int = 5, seed: int = 0, workers: int = 1
) -> Mapping[int, Estimate]:
    """Return by how much accuracy falls when all features of a ring are shuffled among the test samples.

    Permutation importance (Breiman 2001), for a ring at a time: its markers say nearly the same, and one of them alone
    would not be missed. Intervals are over the test trials; shuffles are averaged.
    """
    columns = columns_of(samples.names, candidate.sets)
    rings = ring_of_features([samples.names[column] for column in columns], samples.ring)
    if not any(ring is not None for ring in rings):
        raise InputError(f"classifier {candidate.name}", "sees no single markers", "needs features of rings")
    rest = [name for name in samples.trials if name not in set(tests)]
    estimator = fit_detector(candidate, samples, _rows(samples, rest), seed, workers)
    rows = _rows(samples, tests)
    values, classes, draw = samples.values[np.ix_(rows, columns)], samples.classes[rows], np.random.default_rng(seed)
    _, trial = np.unique(samples.trial[rows], return_inverse=True)
    frames, whole = np.bincount(trial), _right(estimator, values, classes, trial)
    importance = {}
    for ring in sorted({entry for entry in rings if entry is not None}):
        element = np.array([entry == ring for entry in rings])
        left = np.zeros(len(frames))
        for _ in range(draws):
            mixed = values.copy()
            mixed[:, element] = values[draw.permutation(len(values))][:, element]
            left += _right(estimator, mixed, classes, trial) / draws
        importance[ring] = _share(whole - left, frames, seed)
    return importance


def _share(part: NDArray[np.float64], frames: NDArray[np.intp], seed: int) -> Estimate:
    """Return a sum over trials as a share of their frames, with its interval."""
    return bootstrap_estimate(lambda drawn: float(part[drawn].sum() / frames[drawn].sum()), len(frames), seed=seed)


def _mean_f1(matrices: NDArray[np.intp], seed: int) -> Estimate:
    def value(drawn: NDArray[np.intp]) -> float:
        return float(np.nanmean(precision_recall_f1(matrices[drawn].sum(axis=0))[2]))

    return bootstrap_estimate(value, len(matrices), seed=seed)


def _rows(samples: Samples, names: Sequence[str]) -> NDArray[np.intp]:
    return np.flatnonzero(np.isin(np.array(samples.trials)[samples.trial], list(names)))


def _matrices(samples: Samples, candidate: Candidate, estimator: object, rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return a confusion matrix for each trial of some samples."""
    values = samples.values[np.ix_(rows, columns_of(samples.names, candidate.sets))]
    classes = probabilities(estimator, values).argmax(axis=1)
    return confusion_by_trial(samples.classes[rows], classes, samples.trial[rows])


def _right(
    estimator: object, values: NDArray[np.float32], classes: NDArray[np.int8], trial: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Return how many samples of each trial are right."""
    right = probabilities(estimator, values).argmax(axis=1) == classes
    return np.bincount(trial, weights=right).astype(float)
