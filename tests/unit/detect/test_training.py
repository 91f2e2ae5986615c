from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fingerslip.detect.features import motion_of
from fingerslip.detect.labels import Onsets
from fingerslip.detect.samples import Samples
from fingerslip.detect.training import (
    calibration_count,
    candidate_of_name,
    detect,
    forward_filter,
    frame_scores,
    largest_before,
    train,
)
from fingerslip.detect.trials import TrialSet
from fingerslip.errors import InputError
from unit.detect.conftest import MOTION, SAMPLING


def test_a_detector_finds_slip_in_trials_that_it_has_not_seen(trials: TrialSet) -> None:
    onsets, unseen = trials.onsets(), trials.names[-4:]
    made = train(trials, onsets, "logistic", motion=MOTION, sampling=SAMPLING, names=trials.names[:-4])
    assert made.calibration.trials == 0
    assert made.thresholds.slip == 0.0
    for name in unseen:
        time, scores, found = detect(made, trials.tracks(name))
        assert scores.shape == (len(time), 2)
        assert found.incipient is not None
        assert onsets[name].gross is not None
        assert abs(found.incipient - onsets[name].incipient) < 1.0  # type: ignore[operator]


def test_a_threshold_is_set_by_trials_that_were_kept(trials: TrialSet) -> None:
    made = train(trials, trials.onsets(), "time_threshold", motion=MOTION, sampling=SAMPLING, share=0.2)
    assert made.calibration.trials == 5
    assert made.provenance["trials"] == 19
    assert made.data == trials.digest


def test_how_many_trials_are_kept() -> None:
    assert [calibration_count(count, 0.05) for count in (24, 37, 38, 95, 256)] == [0, 0, 19, 19, 51]


def test_the_smoother_has_the_times_of_the_training_trials(samples: Samples, trials: TrialSet) -> None:
    onsets = trials.onsets()
    made = forward_filter(samples, onsets, 5)
    partial = [one.gross - one.incipient for one in onsets.values()]  # type: ignore[operator]
    assert made.dwell[1] == pytest.approx(np.mean(partial))
    assert sum(made.prior) == pytest.approx(1.0)
    assert made.weight == 0.2
    one = forward_filter(samples, onsets, 5, np.flatnonzero(samples.trial == 0))
    assert one.dwell[1] == pytest.approx(partial[0])


def test_the_largest_score_before_slip() -> None:
    time, scores = np.arange(4.0), np.array([[0.0, 9.0], [3.0, 9.0], [1.0, 9.0], [8.0, 9.0]])
    assert largest_before(time, scores, Onsets(2.5, 3.0)) == 3.0
    assert largest_before(time, scores, Onsets(None, None)) == 8.0
    assert largest_before(time, scores, Onsets(0.0, 1.0)) == -np.inf


def test_scores_of_frames_start_anew(samples: Samples, trials: TrialSet) -> None:
    made = forward_filter(samples, trials.onsets(), 5)
    chances, motion = (
        np.tile([0.8, 0.1, 0.1], (5, 1)),
        motion_of(trials.tracks(trials.names[0]), MOTION).at(slice(0, 5)),
    )
    later = dataclasses.replace(motion, time=motion.time + 7)
    assert frame_scores(made, motion, chances) == pytest.approx(frame_scores(made, later, chances), abs=1e-12)


def test_unknown_classifiers_and_other_markers_are_refused(trials: TrialSet) -> None:
    with pytest.raises(InputError, match=r"classifier: got 'magic', needs one of forest, svm_linear"):
        candidate_of_name("magic")
    made = train(trials, trials.onsets(), "time_threshold", motion=MOTION, sampling=SAMPLING)
    fewer = trials.tracks(trials.names[0]).isel(marker=slice(0, 60))
    with pytest.raises(InputError, match="tracks: have 41 internal markers in px, needs the markers that the detector"):
        detect(made, fewer)


def test_a_classifier_takes_other_features_than_its_own() -> None:
    one = candidate_of_name("logistic:displacement+strain")
    assert (one.name, one.sets) == ("logistic:displacement+strain", ("displacement", "strain"))
    assert one.make is candidate_of_name("logistic").make
    with pytest.raises(InputError, match="features: got touch, needs some of displacement"):
        candidate_of_name("forest:touch")
    with pytest.raises(InputError, match="features: got none"):
        candidate_of_name("forest:")
