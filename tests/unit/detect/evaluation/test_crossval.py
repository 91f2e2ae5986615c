from __future__ import annotations

import numpy as np
import pytest

from fingerslip.detect.classifiers import CLASSIFIERS
from fingerslip.detect.evaluation.crossval import events_by_trial, frames_by_sample, frames_by_trial
from fingerslip.detect.samples import Samples, grouped_folds
from fingerslip.detect.trial_set import TrialSet
from fingerslip.errors import InputError
from unit.detect.conftest import MOTION


def test_no_trial_is_on_both_sides(samples: Samples, trials: TrialSet) -> None:
    tests = grouped_folds(trials.names, 3, 0)
    found = frames_by_trial(samples, trials.onsets(), CLASSIFIERS["time_threshold"], tests, window=5, share=0.25)
    assert len(found.folds) == 3
    for fold in found.folds:
        assert len(fold.kept) == 3
        assert not set(fold.kept) & set(fold.tested)
    assert found.matrices.sum() == len(samples.classes) == len(found.classes)
    assert len(found.matrices) == 24


def test_events_of_every_trial_are_found_by_a_classifier_that_has_not_seen_it(
    samples: Samples, trials: TrialSet
) -> None:
    tests = grouped_folds(trials.names, 3, 0)
    names = ("logistic", "displacement_threshold")
    results = [
        frames_by_trial(samples, trials.onsets(), CLASSIFIERS[one], tests, window=5, share=0.25) for one in names
    ]
    events = events_by_trial(trials, trials.onsets(), results, MOTION, share=0.25)
    assert [set(one) for one in events] == [set(trials.names)] * 2
    # The kept trials allow a quarter of the trials an alarm before slip; twelve of 24 would be far beyond that.
    labels = {name: one.first or 0.0 for name, one in trials.onsets().items()}
    early = sum(one.first is not None and one.first < labels[name] for name, one in events[0].items())
    assert early < 12


def test_frames_of_known_trials_are_easier_for_a_classifier_that_learns_them_by_heart() -> None:
    """Trials whose frames differ by an offset of the trial alone leak through a split by sample."""
    draw = np.random.default_rng(0)
    classes = np.tile(np.repeat([0, 1, 2], 20), 20).astype(np.int8)
    trial = np.repeat(np.arange(20), 60)
    key = draw.normal(size=(20, 3, 4))
    values = (key[trial, classes] + 0.05 * draw.normal(size=(1200, 4))).astype(np.float32)
    names = tuple(f"{one}/x/{number}" for one in ("displacement", "speed") for number in (0, 1))
    trials = tuple(f"t{number}" for number in range(20))
    made = Samples(values, classes, trial, 0.0 * trial, names, trials, np.zeros(2, dtype=np.intp), np.zeros(20))
    from fingerslip.detect.labels import Onsets

    tests = grouped_folds(trials, 5, 0)
    grouped = frames_by_trial(made, dict.fromkeys(trials, Onsets(1.0, 2.0)), CLASSIFIERS["forest"], tests, window=5)
    mixed = frames_by_sample(made, CLASSIFIERS["forest"])
    accuracy = [np.trace(one.sum(axis=0)) / one.sum() for one in (grouped.matrices, mixed)]
    assert accuracy[0] < 0.5
    assert accuracy[1] > 0.95


def test_a_fold_without_trials_to_learn_from_is_refused(samples: Samples, trials: TrialSet) -> None:
    with pytest.raises(InputError, match="folds: leave no trial to learn from"):
        frames_by_trial(samples, trials.onsets(), CLASSIFIERS["forest"], [trials.names], window=5)


def test_a_class_that_is_missing_in_a_fold_is_named(samples: Samples, trials: TrialSet) -> None:
    import dataclasses

    few = dataclasses.replace(
        samples, classes=np.where(samples.trial > 0, np.minimum(samples.classes, 1), samples.classes)
    )
    with pytest.raises(InputError, match="leaves out trial slide-0000: has no frame of gross to learn from"):
        frames_by_trial(few, trials.onsets(), CLASSIFIERS["forest"], [trials.names[:1]], window=5)
