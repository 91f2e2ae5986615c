"""A detector on a data set that it did not learn from."""

from __future__ import annotations

from pathlib import Path

import pytest

from fingerslip.detect.evaluation.crossval import on_unseen
from fingerslip.detect.labels import Onsets
from fingerslip.detect.session import unseen_tables
from fingerslip.detect.synthetic import synthetic_slides
from fingerslip.detect.training import Detector, train
from fingerslip.detect.trials import TrialSet, write_trials
from fingerslip.errors import InputError
from unit.detect.conftest import MOTION, SAMPLING


@pytest.fixture(scope="module")
def made(trials: TrialSet) -> Detector:
    return train(trials, trials.onsets(), "logistic", motion=MOTION, sampling=SAMPLING, names=trials.names[:8])


@pytest.fixture(scope="module")
def others(tmp_path_factory: pytest.TempPathFactory) -> TrialSet:
    slides = synthetic_slides((3.5e-3,), directions=3, repeats=1, seed=9, travel=8e-3)
    return write_trials(slides, tmp_path_factory.mktemp("others") / "slides", "Other slides")


def test_onsets_are_read_with_and_without_smoothing(made: Detector, others: TrialSet) -> None:
    found = on_unseen(made, others, others.onsets())
    assert list(found.onsets) == list(found.scores) == ["detector", "single frames"]
    assert found.matrices.shape == (3, 3, 3)
    assert found.matrices.sum() == sum(others.tracks(name).sizes["time"] for name in others.names)
    assert found.scores["detector"].missed == 0
    assert found.scores["single frames"].error.value <= found.scores["detector"].error.value + 1e-9
    titles = [table.title for table in unseen_tables(found)]
    assert titles == ["Onset of slip", "Classes, on trials that were not seen", "Confusion, frames"]


def test_slip_that_never_comes_is_no_mistake(made: Detector, others: TrialSet) -> None:
    never = dict.fromkeys(others.names, Onsets(None, None))
    found = on_unseen(made, others, never)
    assert found.scores["detector"].trials == 0
    assert found.scores["detector"].at_rest.value == 1.0
    assert found.matrices[:, 1:].sum() == 0


def test_what_a_detector_learned_from_is_not_unseen(made: Detector, trials: TrialSet, others: TrialSet) -> None:
    with pytest.raises(InputError, match="is what the detector learned from, needs another data set"):
        on_unseen(made, trials, trials.onsets())
    with pytest.raises(InputError, match=r"labels: have no trial slide-0000, needs every trial"):
        on_unseen(made, others, {})


def test_other_markers_are_refused(made: Detector, others: TrialSet, tmp_path: Path) -> None:
    def fewer():
        for name in others.names:
            trial = others.trial(name)
            yield type(trial)(name, trial.tracks.isel(marker=slice(0, 40)), trial.labels)

    small = write_trials(fewer(), tmp_path / "small", "Fewer markers")
    with pytest.raises(InputError, match="needs the markers that the detector learned from"):
        on_unseen(made, small, others.onsets())
