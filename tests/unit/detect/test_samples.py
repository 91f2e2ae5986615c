from __future__ import annotations

import numpy as np
import pytest

from fingerslip.detect.labels import Onsets
from fingerslip.detect.samples import PUBLISHED_SAMPLING, Samples, Sampling, chosen_frames, samples_of
from fingerslip.detect.trial_set import TrialSet
from fingerslip.errors import InputError

CLASSES = np.repeat([0, 1, 2], [200, 300, 100]).astype(np.int8)
USABLE = np.ones(600, dtype=bool)


def test_the_published_sampling_takes_200_frames_a_trial() -> None:
    frames = chosen_frames(CLASSES, USABLE, PUBLISHED_SAMPLING, "a")
    assert len(set(frames.tolist())) == 200
    assert np.bincount(CLASSES[frames]).tolist() == [50, 100, 50]
    assert set(range(200, 250)) <= set(frames.tolist())
    assert (np.diff(frames) > 0).all()


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
