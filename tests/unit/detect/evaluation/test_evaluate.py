"""An evaluation that is interrupted goes on, and comes to what it would have come to."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fingerslip.detect.classifiers import CLASSIFIERS
from fingerslip.detect.evaluation import evaluate
from fingerslip.detect.evaluation.crossval import events_by_trial, frames_by_sample, frames_by_trial, parts_beside
from fingerslip.detect.evaluation.evaluate import Evaluation, begun_evaluation
from fingerslip.detect.labels import Onsets
from fingerslip.detect.samples import Samples, grouped_folds
from fingerslip.detect.trial_set import TrialSet
from fingerslip.errors import InputError
from unit.detect.conftest import MOTION, SAMPLING

Begun = Callable[..., Evaluation]
CANDIDATES = [CLASSIFIERS[name] for name in ("time_threshold", "displacement_threshold")]


@pytest.fixture
def begun(trials: TrialSet, samples: Samples) -> Callable[..., Evaluation]:
    """Return a function that begins an evaluation, with parts beside an output."""
    onsets = trials.onsets()
    return lambda output=None: Evaluation(trials, onsets, samples, MOTION, parts=parts_beside(output, "data"))


@pytest.fixture
def fits(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return a list that gets the name of the classifier of every fit; the third fit is interrupted."""
    names: list[str] = []

    def counted(*given: Any, **more: Any) -> Any:
        names.append(given[2].name)
        if len(names) == 3:
            raise KeyboardInterrupt
        return fit(*given, **more)

    fit = evaluate.fitted_fold
    monkeypatch.setattr(evaluate, "fitted_fold", counted)
    return names


@pytest.mark.slow
def test_folds_give_what_all_folds_at_once_give(trials: TrialSet, begun: Begun) -> None:
    made, tests = begun(), grouped_folds(trials.names, 3, 0)
    made.check(tests)
    frames, events = made.by_fold(CANDIDATES, tests)
    same = [frames_by_trial(made.samples, made.onsets, one, tests, window=MOTION.window) for one in CANDIDATES]
    found = events_by_trial(trials, made.onsets, same, MOTION)
    for number, (name, one) in enumerate(frames.items()):
        assert np.array_equal(one.matrices, same[number].matrices)
        assert np.array_equal(one.chances, same[number].chances)
        assert events[name] == found[number]
        assert list(events[name]) == list(trials.names)


def test_an_interrupted_evaluation_goes_on(trials: TrialSet, begun: Begun, tmp_path: Path, fits: list[str]) -> None:
    tests = grouped_folds(trials.names, 3, 0)
    with pytest.raises(KeyboardInterrupt):
        begun(tmp_path / "tables").by_fold(CANDIDATES, tests)
    assert len(list((tmp_path / "tables.unfinished").iterdir())) == 4  # frames and events of the first fold
    again = begun(tmp_path / "tables")
    frames, events = again.by_fold(CANDIDATES, tests)
    assert len(fits) == 3 + 4  # the first fold is not fitted again
    whole_frames, whole_events = begun().by_fold(CANDIDATES, tests)
    assert events == whole_events
    for name, one in whole_frames.items():
        assert np.array_equal(frames[name].matrices, one.matrices)
    count = len(fits)
    assert begun(tmp_path / "tables").by_group(CANDIDATES[0], tests)[0].rows.size
    assert len(fits) == count  # frames of a fold are those of a group


@pytest.mark.slow
def test_other_labels_are_not_taken_for_the_same(trials: TrialSet, tmp_path: Path) -> None:
    later = {name: Onsets(one.incipient, (one.gross or 0.0) + 0.05) for name, one in trials.onsets().items()}
    output = tmp_path / "tables"
    first, second, third = (
        begun_evaluation(trials, onsets, CANDIDATES[:1], MOTION, SAMPLING, output=output).parts.inputs
        for onsets in (trials.onsets(), trials.onsets(), later)
    )
    assert first == second != third


def test_a_split_by_sample_is_kept_too(begun: Begun, tmp_path: Path) -> None:
    one = begun(tmp_path / "tables")
    first, second = (one.by_sample(CANDIDATES[0]) for _ in range(2))
    assert np.array_equal(first, second)
    assert np.array_equal(first, frames_by_sample(one.samples, CANDIDATES[0]))


def test_a_fold_that_lacks_a_class_is_told_before_anything_is_fitted(trials: TrialSet, begun: Begun) -> None:
    with pytest.raises(InputError, match="folds: leave no trial to learn from"):
        begun().check([trials.names])
