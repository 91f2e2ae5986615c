"""A detector that learns, and what it finds in trials and data sets that it did not learn from."""

import dataclasses

import numpy as np
import pytest

from fingerslip.detect import training
from fingerslip.detect.evaluation.crossval import on_unseen
from fingerslip.detect.features import motion_of
from fingerslip.detect.labels import Onsets
from fingerslip.detect.model_file import write_detector
from fingerslip.detect.samples import held_out
from fingerslip.detect.session import judge_detector, unseen_tables
from fingerslip.detect.synthetic import synthetic_slides
from fingerslip.detect.trials import write_trials
from fingerslip.errors import InputError
from unit.detect.conftest import MOTION, SAMPLING


@pytest.mark.slow
def test_a_detector_finds_slip_in_trials_that_it_has_not_seen(trials):
    onsets = trials.onsets()
    made = training.train(trials, onsets, "logistic", motion=MOTION, sampling=SAMPLING, names=trials.names[:-4])
    assert (made.calibration.trials, made.thresholds.slip) == (0, 0.0)
    for name in trials.names[-4:]:
        time, scores, found = training.detect(made, trials.tracks(name))
        assert scores.shape == (len(time), 2)
        assert abs(found.incipient - onsets[name].incipient) < 1.0


@pytest.mark.slow
def test_thresholds_are_set_by_the_largest_score_before_slip_of_trials_that_were_kept(trials):
    made = training.train(trials, trials.onsets(), "time_threshold", motion=MOTION, sampling=SAMPLING, share=0.2)
    assert made.calibration.trials == 5
    assert [training.calibration_count(count, 0.05) for count in (24, 37, 38, 95, 256)] == [0, 0, 19, 19, 51]
    assert made.provenance["trials"] == 19
    assert made.data == trials.digest
    onsets = trials.onsets()
    labels = {name: onsets[name].incipient for name in held_out(trials.names, 5, 0)}
    begins = {name: training.detect(made, trials.tracks(name))[2].incipient for name in labels}
    assert training.time_error(labels, begins) == {training.TIME_ERROR: made.provenance[training.TIME_ERROR]}
    between = training.time_error(dict.fromkeys("abc", 1.0), {"a": 1.1, "b": 0.8, "c": 1.3})[training.TIME_ERROR]
    assert between == pytest.approx([0.2, 0.11, 0.29])
    assert training.time_error({"a": 1.0, "b": 2.0, "c": None}, {"a": 1.5, "b": None, "c": 1.0}) == {
        training.TIME_ERROR: [0.5, 0.5, 0.5]
    }
    assert training.time_error({"a": 1.0}, {"a": None}) == {}
    time, scores = np.arange(4.0), np.array([[0.0, 9.0], [3.0, 9.0], [1.0, 9.0], [8.0, 9.0]])
    largest = [training.largest_before(time, scores, Onsets(*at)) for at in ((2.5, 3.0), (None, None), (0.0, 1.0))]
    assert largest == [3.0, 8.0, -np.inf]


def test_trials_at_two_rates_make_a_detector_that_refuses_neither(samples, trials, monkeypatch):
    onsets, rates = trials.onsets(), np.where(np.arange(len(samples.interval)) % 2, 1 / 30, 1 / 60)
    monkeypatch.setattr(training, "samples_of", lambda *_, **__: dataclasses.replace(samples, interval=rates))
    assert training.train(trials, onsets, "time_threshold", motion=MOTION, sampling=SAMPLING).frame_rate is None


@pytest.mark.parametrize(("rate", "differs"), [(27.5, False), (32.5, False), (26.5, True), (33.5, True)])
def test_a_frame_rate_fits_within_a_tenth(samples, trials, rate, differs):
    detector = training.train(trials, trials.onsets(), "time_threshold", motion=MOTION, sampling=SAMPLING)
    fault = training.rate_fault(dataclasses.replace(detector, frame_rate=30.0), rate)
    assert bool(fault) == differs


def test_the_smoother_has_the_times_of_the_training_trials_and_starts_anew(samples, trials):
    onsets = trials.onsets()
    made = training.forward_filter(samples, onsets, 5)
    partial = [one.gross - one.incipient for one in onsets.values()]
    assert made.dwell[1] == pytest.approx(np.mean(partial))
    assert sum(made.prior) == pytest.approx(1.0)
    assert made.weight == 0.2
    one = training.forward_filter(samples, onsets, 5, np.flatnonzero(samples.trial == 0))
    assert one.dwell[1] == pytest.approx(partial[0])
    made = training.forward_filter(samples, trials.onsets(), 5)
    chances = np.tile([0.8, 0.1, 0.1], (5, 1))
    motion = motion_of(trials.tracks(trials.names[0]), MOTION).at(slice(0, 5))
    later = dataclasses.replace(motion, time=motion.time + 7)
    assert training.frame_scores(made, motion, chances) == pytest.approx(
        training.frame_scores(made, later, chances), abs=1e-12
    )


def test_a_classifier_takes_other_features_than_its_own_and_a_detector_no_other_markers(detector, trials):
    one = training.candidate_of_name("logistic:displacement+strain")
    assert (one.name, one.sets) == ("logistic:displacement+strain", ("displacement", "strain"))
    assert one.make is training.candidate_of_name("logistic").make
    for name, message in (
        ("magic", "classifier: got 'magic', needs one of forest, svm,"),
        ("forest:touch", "features: got touch, needs some of displacement"),
        ("forest:", "features: got none"),
    ):
        with pytest.raises(InputError, match=message):
            training.candidate_of_name(name)
    fewer = trials.tracks(trials.names[0]).isel(marker=slice(0, 60))
    with pytest.raises(InputError, match="tracks: have 41 internal markers in px, needs the markers that the detector"):
        training.detect(detector, fewer)


@pytest.fixture(scope="module")
def others(tmp_path_factory):
    slides = synthetic_slides((3.5e-3,), directions=3, repeats=1, seed=9, travel=8e-3)
    return write_trials(slides, tmp_path_factory.mktemp("others") / "slides", "Other slides")


@pytest.mark.slow
def test_onsets_are_read_with_and_without_smoothing_and_slip_that_never_comes_is_no_mistake(detector, others):
    found = on_unseen(detector, others, others.onsets())
    assert list(found.onsets) == list(found.scores) == ["detector", "single frames"]
    assert found.matrices.shape == (3, 3, 3)
    assert found.matrices.sum() == sum(others.tracks(name).sizes["time"] for name in others.names)
    assert found.scores["detector"].missed == 0
    assert found.scores["single frames"].error.value <= found.scores["detector"].error.value + 1e-9
    titles = [table.title for table in unseen_tables(found)]
    assert titles == ["Onset of slip", "Classes, on trials that were not seen", "Confusion, frames"]
    found = on_unseen(detector, others, dict.fromkeys(others.names, Onsets(None, None)))
    assert found.scores["detector"].trials == 0
    assert found.scores["detector"].at_rest.value == 1.0
    assert found.matrices[:, 1:].sum() == 0


@pytest.mark.slow
def test_transfer_tells_the_onsets_of_each_indentation(detector, others, tmp_path):
    write_detector(detector, tmp_path / "detector")
    slides = synthetic_slides((3e-3, 4e-3), directions=1, repeats=1, seed=9, travel=8e-3)
    two = write_trials(slides, tmp_path / "slides", "Two indentations")
    judged = judge_detector(str(tmp_path / "detector"), two.folder, "external_markers")
    whole, *_, by_depth = judged
    assert by_depth.title == "Onset of slip by indentation"
    assert [column.name for column in by_depth.columns] == ["event", "indentation: 3 mm", "indentation: 4 mm"]
    errors = {row[0]: row[1:] for row in by_depth.rows}["onset error [s]"]
    both = {row[0]: row[1] for row in whole.rows}["onset error [s]"]
    assert np.mean([error.value for error in errors]) == pytest.approx(both.value, abs=2e-3)
    assert len(judge_detector(str(tmp_path / "detector"), others.folder, "external_markers")) == len(judged) - 1


def test_what_a_detector_learned_from_is_not_unseen_and_other_markers_are_refused(detector, trials, others, tmp_path):
    with pytest.raises(InputError, match="is what the detector learned from, needs another data set"):
        on_unseen(detector, trials, trials.onsets())
    with pytest.raises(InputError, match=r"labels: have no trial slide-0000, needs every trial"):
        on_unseen(detector, others, {})
    fewer = (
        dataclasses.replace(others.trial(name), tracks=others.tracks(name).isel(marker=slice(0, 40)))
        for name in others.names
    )
    small = write_trials(fewer, tmp_path / "small", "Fewer markers")
    with pytest.raises(InputError, match="needs the markers that the detector learned from"):
        on_unseen(detector, small, others.onsets())
