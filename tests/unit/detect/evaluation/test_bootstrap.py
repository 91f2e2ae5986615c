from __future__ import annotations

import numpy as np
import pytest

from fingerslip.detect.evaluation.scores import Estimate, bootstrap_estimate


def test_the_interval_of_a_mean_is_that_of_theory() -> None:
    values = np.random.default_rng(0).normal(size=400)
    found = bootstrap_estimate(lambda drawn: float(values[drawn].mean()), 400)
    assert found.value == pytest.approx(values.mean())
    assert found.low == pytest.approx(values.mean() - 1.96 * values.std() / 20, abs=0.01)
    assert found.high == pytest.approx(values.mean() + 1.96 * values.std() / 20, abs=0.01)


def test_without_trials_or_values_there_is_no_interval() -> None:
    assert bootstrap_estimate(lambda _: 1.0, 0) == Estimate(None)
    assert bootstrap_estimate(lambda _: 1.0, 1) == Estimate(1.0)
    assert bootstrap_estimate(lambda _: float("nan"), 5) == Estimate(None)
    assert bootstrap_estimate(lambda drawn: 1.0 if len(set(drawn.tolist())) == 5 else float("nan"), 5) == Estimate(1.0)
