"""Accuracies of the same trials with other assumptions."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from fingerslip.detect.classifiers import CLASSIFIERS
from fingerslip.detect.evaluation.crossval import frames_by_trial, parts_beside
from fingerslip.detect.evaluation.robustness import (
    Assumption,
    Sensitivity,
    each_alone,
    likely_assumptions,
    sensitivity_of,
)
from fingerslip.detect.features import FeatureSettings
from fingerslip.detect.labels import LabelSettings
from fingerslip.detect.samples import grouped_folds, samples_of
from fingerslip.detect.trial_set import TrialSet
from fingerslip.errors import InputError
from unit.detect.conftest import MOTION, SAMPLING

CLOCK = CLASSIFIERS["time_threshold"]
AS_IT_IS = Assumption("as it is", "", LabelSettings(rest_frames=20), MOTION)


def found(trials: TrialSet, *assumptions: Assumption):
    return list(sensitivity_of(trials, assumptions, [CLOCK], sampling=replace(SAMPLING, least=0.0), folds=3))


@pytest.fixture(scope="module")
def base(trials: TrialSet) -> Sensitivity:
    """Return what comes out where nothing is changed."""
    (one,) = found(trials, AS_IT_IS)
    return one


def test_what_is_left_as_it_is_gives_the_evaluation(trials: TrialSet, base: Sensitivity) -> None:
    samples = samples_of(trials, trials.onsets(), FeatureSettings(CLOCK.sets, MOTION), SAMPLING)
    tests = grouped_folds(trials.names, 3, 0)
    same = frames_by_trial(samples, trials.onsets(), CLOCK, tests, window=MOTION.window)
    assert np.array_equal(base.matrices["time_threshold"], same.matrices)


def test_higher_thresholds_make_labels_late(trials: TrialSet, base: Sensitivity) -> None:
    # Markers of analytic trials jump by tens of pixels.
    higher = replace(AS_IT_IS, labels=LabelSettings(30.0, 1.0, rest_frames=20))
    gross = replace(AS_IT_IS, labels=LabelSettings(2.0, 30.0, rest_frames=20))
    first, second = found(trials, higher, gross)
    assert first.incipient > base.incipient
    assert first.gross == base.gross
    assert second.incipient == base.incipient
    assert second.gross > base.gross


def test_accuracies_are_listed_by_condition(trials: TrialSet, base: Sensitivity) -> None:
    by_depth = base.of_condition(trials, "indentation")
    assert list(by_depth) == ["0.003", "0.004"]
    parts = [part["time_threshold"].value for part in by_depth.values()]
    assert min(parts) <= base.accuracies["time_threshold"].value <= max(parts)


def test_labels_that_are_not_there_are_told(trials: TrialSet) -> None:
    with pytest.raises(InputError, match="has no labels 'nails'"):
        found(trials, replace(AS_IT_IS, labels="nails"))
    with pytest.raises(InputError, match="has no gross slip"):
        found(trials, replace(AS_IT_IS, labels=LabelSettings(2.0, 1e5, rest_frames=20)))


def test_each_likely_assumption_changes_one_thing() -> None:
    base, *others = likely_assumptions(0.07e-3, motion=MOTION, stored=("contact",))
    assert base.labels == LabelSettings(rest_frames=20)
    assert len({one.quantity for one in others}) == 6
    for one in others:
        changed = [one.labels != base.labels, one.motion != base.motion, one.noise != base.noise]
        assert sum(changed) == 1, one
    finer = others[0].labels
    assert finer.incipient / finer.gross == pytest.approx(2.0)
    assert finer.incipient == pytest.approx(2.0 * 0.045 / 0.07)


def test_trials_of_each_value_are_taken_alone(trials: TrialSet) -> None:
    alone = each_alone(trials, ["indentation", "direction"], AS_IT_IS)
    assert len(alone) == 2 * 4
    assert alone[0].value == "indentation: 3 mm, direction: 0 rad"
    assert sorted(name for one in alone for name in one.trials) == list(trials.names)
    assert each_alone(trials, [], AS_IT_IS) == ()
    with pytest.raises(InputError, match="has no condition 'stiffness'"):
        each_alone(trials, ["stiffness"], AS_IT_IS)
    (one,) = found(trials, each_alone(trials, ["indentation"], AS_IT_IS)[1])
    assert len(one.matrices["time_threshold"]) == 12


def test_what_is_kept_is_not_asked_again(trials: TrialSet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    parts = parts_beside(tmp_path / "tables", trials.digest)
    ask = partial(sensitivity_of, trials, [AS_IT_IS], [CLOCK], sampling=replace(SAMPLING, least=0.0), folds=3)
    (first,) = ask(stored_parts=parts)
    monkeypatch.setattr(TrialSet, "tracks", None)
    (second,) = ask(stored_parts=parts)
    assert (first.incipient, first.gross) == (second.incipient, second.gross)
    assert np.array_equal(first.matrices["time_threshold"], second.matrices["time_threshold"])
