from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sklearn.metrics import confusion_matrix, precision_recall_fscore_support

from fingerslip.detect.evaluation.scores import confusion_by_trial, frame_scores_of, precision_recall_f1

CLASSES = st.lists(st.tuples(st.integers(0, 2), st.integers(0, 2), st.integers(0, 4)), min_size=1, max_size=60)


@given(CLASSES)
def test_scores_are_those_of_scikit_learn(rows: list[tuple[int, int, int]]) -> None:
    true, found, trial = (np.array(column) for column in zip(*rows, strict=True))
    matrices = confusion_by_trial(true.astype(np.int8), found.astype(np.int8), trial)
    assert len(matrices) == len(set(trial.tolist()))
    whole = matrices.sum(axis=0)
    assert np.array_equal(whole, confusion_matrix(true, found, labels=[0, 1, 2]))
    theirs = precision_recall_fscore_support(true, found, labels=[0, 1, 2], zero_division=np.nan)[:3]
    ours = precision_recall_f1(whole)
    assert ours[:2] == pytest.approx(np.array(theirs[:2]), nan_ok=True)


def test_intervals_are_over_trials() -> None:
    good, bad = np.diag([10, 10, 10]), np.array([[0, 10, 0], [0, 10, 0], [0, 0, 10]])
    found = frame_scores_of(np.array([good] * 9 + [bad]))
    assert found.accuracy.value == pytest.approx(290 / 300)
    assert found.accuracy.low is not None
    assert found.accuracy.low < 0.95
    assert found.recall[0].value == pytest.approx(0.9)
    assert found.recall[2].value == found.recall[2].low == 1.0
    never = frame_scores_of(np.array([[[5, 0, 0], [0, 5, 0], [0, 0, 0]]] * 3))
    assert never.precision[2].value is None
