from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.detect.alarms import false_alarm_threshold, lead_bound, least_trials
from fingerslip.errors import InputError


@given(st.lists(st.floats(-10, 10), min_size=20, max_size=80, unique=True))
def test_each_trial_in_turn_raises_an_alarm_in_at_most_5_percent(values: list[float]) -> None:
    """With every order equally likely, leaving each out in turn is the whole distribution: the bound is exact."""
    alarms = [values[i] > false_alarm_threshold(values[:i] + values[i + 1 :]) for i in range(len(values))]
    assert np.mean(alarms) <= 0.05 + 1e-12


@given(st.lists(st.floats(-1, 3), min_size=20, max_size=80, unique=True))
def test_each_trial_in_turn_has_the_lead_in_at_least_95_percent(values: list[float]) -> None:
    bounds = [lead_bound(values[:i] + values[i + 1 :]) for i in range(len(values))]
    kept = [bound is not None and lead >= bound for lead, bound in zip(values, bounds, strict=True)]
    assert np.mean(kept) >= 0.95 - 1e-12


def test_the_ranks() -> None:
    assert false_alarm_threshold(list(range(19))) == 18
    assert false_alarm_threshold(list(range(39))) == 37
    assert lead_bound([float(one) for one in range(39)]) == 1.0
    assert lead_bound([None, *map(float, range(1, 39))]) == 1.0
    assert lead_bound([None, None, *map(float, range(37))]) is None


def test_guarantees_need_trials() -> None:
    assert [least_trials(share) for share in (0.5, 0.1, 0.05, 0.01)] == [1, 9, 19, 99]
    with pytest.raises(InputError, match=r"got 18 trials for a guarantee of 0.95, needs at least 19"):
        false_alarm_threshold([0.0] * 18)
    with pytest.raises(InputError, match="needs at least 19"):
        lead_bound([1.0])
    with pytest.raises(InputError, match="share: got 0"):
        least_trials(0.0)
