from __future__ import annotations

import numpy as np
import pytest
from sklearn.metrics import brier_score_loss

from fingerslip.detect.evaluation.scores import reliability_of

DRAW = np.random.default_rng(0)


def test_probabilities_that_mean_what_they_say_have_little_error() -> None:
    slip = DRAW.random(20_000)
    classes = (DRAW.random(20_000) < slip).astype(np.int8)
    chances = np.stack([1 - slip, slip, 0 * slip], axis=1)
    found = reliability_of(chances, classes)
    assert found.error < 0.015
    assert found.said == pytest.approx(found.seen, abs=0.04)
    assert found.count.sum() == 20_000
    assert found.brier == pytest.approx(2 * brier_score_loss(classes, slip), rel=1e-9)


def test_overconfidence_is_seen() -> None:
    chances = np.tile([0.0, 1.0, 0.0], (10, 1))
    found = reliability_of(chances, np.array([0, 1] * 5, dtype=np.int8))
    assert found.error == pytest.approx(0.5)
    assert found.brier == pytest.approx(1.0)
    assert np.isnan(found.said[0])
