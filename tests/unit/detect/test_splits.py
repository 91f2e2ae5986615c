from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.detect.samples import benchmark_test_trials, grouped_folds, held_out, left_out, sample_split
from fingerslip.errors import InputError

NAMES = tuple(f"t{number:02d}" for number in range(23))


@given(st.integers(2, 23), st.integers(0, 100))
def test_every_trial_is_tested_once(folds: int, seed: int) -> None:
    found = grouped_folds(NAMES, folds, seed)
    assert len(found) == folds
    assert sorted(name for fold in found for name in fold) == sorted(NAMES)
    assert max(map(len, found)) - min(map(len, found)) <= 1


def test_the_benchmark_split_is_fixed_for_ever() -> None:
    found = benchmark_test_trials(NAMES)
    assert found == ("t01", "t05", "t06", "t08", "t17")
    assert benchmark_test_trials(NAMES[::-1]) == found
    assert benchmark_test_trials(NAMES, seed=1) != found


def test_samples_are_split_90_to_10() -> None:
    assert sample_split(640, 0).sum() == 64
    assert (sample_split(640, 0) != sample_split(640, 1)).any()


def test_conditions_are_left_out_one_by_one_or_in_ranges() -> None:
    depths = {name: {"depth": 1e-3 * (number % 3), "mu": 0.01 * number} for number, name in enumerate(NAMES)}
    assert list(left_out(depths, "depth")) == ["0", "0.001", "0.002"]
    ranges = left_out(depths, "mu")
    assert len(ranges) == 4
    assert sorted(name for names in ranges.values() for name in names) == sorted(NAMES)
    assert left_out({"a": {"s": "wet"}, "b": {"s": "dry"}}, "s") == {"dry": ("b",), "wet": ("a",)}


def test_bad_splits_are_refused() -> None:
    with pytest.raises(InputError, match="folds: got 24, needs 2 to 23"):
        grouped_folds(NAMES, 24, 0)
    with pytest.raises(InputError, match="trials: got 23, needs at least 30"):
        held_out(NAMES, 30, 0)
    with pytest.raises(InputError, match=r"share: got 1\.0"):
        benchmark_test_trials(NAMES, share=1.0)
    with pytest.raises(InputError, match="trial b: has no condition 's'"):
        left_out({"a": {"s": 1}, "b": {}}, "s")
    with pytest.raises(InputError, match="condition 's': is 1 in all trials"):
        left_out({"a": {"s": 1}, "b": {"s": 1}}, "s")
