"""Scores of frames: confusion matrix, accuracy, precision, recall and F1, with intervals over trials."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.evaluation.bootstrap import Estimate, bootstrapped
from fingerslip.detect.onsets import CLASSES

__all__ = ["FrameScores", "confusion_by_trial", "frame_scores_of", "precision_recall_f1"]

_COUNT = len(CLASSES)


@dataclass(frozen=True)
class FrameScores:
    """How well frames are classified."""

    matrix: NDArray[np.intp]  # (3, 3), frames by true class (rows) and found class (columns)
    accuracy: Estimate  # share of the frames that are right
    precision: tuple[Estimate, ...]  # for each class
    recall: tuple[Estimate, ...]  # for each class
    f1: tuple[Estimate, ...]  # for each class


def confusion_by_trial(true: NDArray[np.int8], found: NDArray[np.int8], trial: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return a confusion matrix for each trial, shape (n_trials, 3, 3), rows the true class.

    Arrays: true, found (n_samples,); trial (n_samples,).
    """
    _, number = np.unique(trial, return_inverse=True)
    trials = int(number.max()) + 1 if number.size else 0
    place = (number * _COUNT + true) * _COUNT + found
    counts = np.bincount(place, minlength=trials * _COUNT**2)
    return counts.reshape(trials, _COUNT, _COUNT)


def precision_recall_f1(matrix: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return precision, recall and F1 of each class, shape (3, n_classes); NaN where not defined.

    Examples
    --------
    >>> precision_recall_f1(np.array([[8, 2, 0], [0, 10, 0], [0, 0, 10]])).round(3).tolist()
    [[1.0, 0.833, 1.0], [0.8, 1.0, 1.0], [0.889, 0.909, 1.0]]
    """
    right = np.diagonal(matrix).astype(float)
    columns, rows = matrix.sum(axis=0), matrix.sum(axis=1)
    parts = ((right, columns), (right, rows), (2.0 * right, columns + rows))
    return np.array([_ratio(part, whole) for part, whole in parts])


def _ratio(part: NDArray[np.float64], whole: NDArray[np.intp]) -> NDArray[np.float64]:
    ratio: NDArray[np.float64] = np.divide(part, whole, out=np.full(part.shape, np.nan), where=whole > 0)
    return ratio


def frame_scores_of(matrices: NDArray[np.intp], *, seed: int = 0) -> FrameScores:
    """Return the scores of confusion matrices, with intervals from trials that are drawn anew.

    Arrays: matrices (n_trials, 3, 3).
    """

    def estimate(score: int, one: int) -> Estimate:
        def value(drawn: NDArray[np.intp]) -> float:
            return float(precision_recall_f1(matrices[drawn].sum(axis=0))[score, one])

        return bootstrapped(value, len(matrices), seed=seed)

    precision, recall, f1 = (tuple(estimate(score, one) for one in range(_COUNT)) for score in range(3))
    accuracy = bootstrapped(lambda drawn: _accuracy(matrices[drawn].sum(axis=0)), len(matrices), seed=seed)
    return FrameScores(matrices.sum(axis=0), accuracy, precision, recall, f1)


def _accuracy(matrix: NDArray[np.intp]) -> float:
    return float(np.trace(matrix) / matrix.sum())
