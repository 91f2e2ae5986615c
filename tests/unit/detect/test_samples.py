from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.detect.labels import Onsets
from fingerslip.detect.samples import (
    PUBLISHED_SAMPLING,
    Samples,
    Sampling,
    benchmark_test_trials,
    chosen_frames,
    grouped_folds,
    held_out,
    left_out,
    sample_split,
    samples_of,
)
from fingerslip.detect.trials import TrialSet
from fingerslip.errors import InputError

CLASSES = np.repeat([0, 1, 2], [200, 300, 100]).astype(np.int8)
USABLE = np.ones(600, dtype=bool)


def test_the_published_sampling_takes_200_frames_a_trial() -> None:
    frames = chosen_frames(CLASSES, USABLE, PUBLISHED_SAMPLING, "a")
    assert len(set(frames.tolist())) == 200
    assert np.bincount(CLASSES[frames]).tolist() == [50, 100, 50]
    assert set(range(200, 250)) <= set(frames.tolist())
    assert (np.diff(frames) > 0).all()


def test_of_a_trial_without_slip_only_frames_without_slip_are_taken() -> None:
    frames = chosen_frames(np.zeros(600, dtype=np.int8), USABLE, PUBLISHED_SAMPLING, "a")
    assert len(frames) == 50


def test_groups_are_in_one_fold() -> None:
    groups = {f"{letter}{number}": letter for letter in "abcd" for number in range(3)}
    folds = grouped_folds(list(groups), 2, 0, groups)
    assert sorted(name for fold in folds for name in fold) == sorted(groups)
    assert all(len(fold) == 6 and len({groups[name] for name in fold}) == 2 for fold in folds)
    with pytest.raises(InputError, match="folds: got 5, needs 2 to 4, the number of groups"):
        grouped_folds(list(groups), 5, 0, groups)


def test_the_seed_and_the_name_of_the_trial_decide() -> None:
    one = chosen_frames(CLASSES, USABLE, PUBLISHED_SAMPLING, "a")
    assert np.array_equal(one, chosen_frames(CLASSES, USABLE, PUBLISHED_SAMPLING, "a"))
    assert not np.array_equal(one, chosen_frames(CLASSES, USABLE, PUBLISHED_SAMPLING, "b"))
    assert not np.array_equal(one, chosen_frames(CLASSES, USABLE, Sampling(seed=1), "a"))


def test_frames_that_are_not_usable_are_not_taken() -> None:
    usable = np.arange(600) % 2 == 0
    assert usable[chosen_frames(CLASSES, usable, PUBLISHED_SAMPLING, "a")].all()


def test_too_few_frames_are_an_error_unless_fewer_will_do() -> None:
    few = CLASSES.copy()
    few[30:200] = 1
    with pytest.raises(InputError, match="trial a: has 30 frames of no_slip where 50 are sampled"):
        chosen_frames(few, USABLE, PUBLISHED_SAMPLING, "a")
    assert (few[chosen_frames(few, USABLE, Sampling(least=0.5), "a")] == 0).sum() == 30


def test_samples_know_their_trials(samples: Samples, trials: TrialSet) -> None:
    assert samples.values.shape == (len(samples.classes), len(samples.names))
    assert samples.trials == trials.names
    assert set(samples.trial.tolist()) == set(range(24))
    assert samples.filled == samples.unusable == 0
    assert samples.rest_end == pytest.approx(19 / 30)
    label = trials.onsets()[samples.trials[3]]
    own = samples.trial == 3
    assert (samples.time[own & (samples.classes == 2)] >= label.gross).all()


def test_a_label_that_never_comes_stops_sampling(trials: TrialSet) -> None:
    onsets = trials.onsets() | {"slide-0007": Onsets(1.0, None)}
    with pytest.raises(InputError, match="trial slide-0007: has no gross slip"):
        samples_of(trials, onsets)


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


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: grouped_folds(NAMES, 24, 0), "folds: got 24, needs 2 to 23"),
        (lambda: held_out(NAMES, 30, 0), "trials: got 23, needs at least 30"),
        (lambda: benchmark_test_trials(NAMES, share=1.0), r"share: got 1\.0"),
        (lambda: left_out({"a": {"s": 1}, "b": {}}, "s"), "trial b: has no condition 's'"),
        (lambda: left_out({"a": {"s": 1}, "b": {"s": 1}}, "s"), "condition 's': is 1 in all trials"),
    ],
)
def test_bad_splits_are_refused(call: Callable[[], object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        call()
