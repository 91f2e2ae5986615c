from __future__ import annotations

import numpy as np
import pytest

from fingerslip.detect.evaluation.robustness import disturb, robustness_of
from fingerslip.detect.training import train
from fingerslip.detect.trial_set import TrialSet
from fingerslip.errors import InputError
from fingerslip.vision.tracks import check_tracks
from unit.detect.conftest import MOTION, SAMPLING


@pytest.mark.parametrize(("name", "amount"), [("lost", 0.2), ("noise", 0.5), ("slower", 3)])
def test_disturbed_tracks_are_tracks(name: str, amount: float, trials: TrialSet) -> None:
    tracks = trials.tracks(trials.names[0])
    before = tracks.copy(deep=True)
    found = check_tracks(disturb(tracks, name, amount))
    assert tracks.equals(before)
    assert not found.equals(tracks)
    again = disturb(tracks, name, amount)
    assert found.equals(again)


def test_the_amount_is_that_asked_for(trials: TrialSet) -> None:
    tracks = trials.tracks(trials.names[0])
    assert np.isnan(disturb(tracks, "lost", 0.2)["position"].values).mean() == pytest.approx(0.2, abs=0.01)
    change = disturb(tracks, "noise", 0.5)["position"].values - tracks["position"].values
    assert change.std() == pytest.approx(0.5, rel=0.02)
    assert disturb(tracks, "slower", 3).sizes["time"] == 87


def test_more_is_lost_with_more_disturbance(trials: TrialSet) -> None:
    names = trials.names[8:12]
    made = train(trials, trials.onsets(), "logistic", motion=MOTION, sampling=SAMPLING, names=trials.names[:8])
    levels = [("lost", 0.0), ("lost", 0.6), ("noise", 20.0), ("slower", 2)]
    plain, lost, noisy, slower = robustness_of(made, trials, trials.onsets(), names, levels)
    assert plain.unusable == 0.0
    assert lost.unusable > 0.9
    assert noisy.accuracy.value < plain.accuracy.low <= plain.accuracy.value <= plain.accuracy.high
    assert slower.accuracy.value == pytest.approx(plain.accuracy.value, abs=0.1)


@pytest.mark.parametrize(("name", "amount"), [("fog", 1.0), ("lost", 1.0), ("noise", -1.0), ("slower", 0.5)])
def test_what_cannot_be_is_refused(name: str, amount: float, trials: TrialSet) -> None:
    with pytest.raises(InputError, match="got"):
        disturb(trials.tracks(trials.names[0]), name, amount)
