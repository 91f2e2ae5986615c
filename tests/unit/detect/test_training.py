"""A detector that learns, and what it finds in trials and data sets that it did not learn from."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerslip.detect import training
from fingerslip.detect.classifiers import CLASSIFIERS, fit, optional, probabilities
from fingerslip.detect.evaluation.crossval import on_unseen
from fingerslip.detect.evaluation.inquiries import disturb
from fingerslip.detect.features import motion_of
from fingerslip.detect.labels import Onsets
from fingerslip.detect.live import LiveDetector, frames_of, latency_of, run_live, run_on_tracks
from fingerslip.detect.model_file import write_detector
from fingerslip.detect.samples import held_out
from fingerslip.detect.session import judge_detector, unseen_tables
from fingerslip.detect.synthetic import synthetic_slides
from fingerslip.detect.training import (
    Detector,
    ForwardFilter,
    Thresholds,
    detect,
    false_alarm_threshold,
    lead_bound,
    least_trials,
    onsets_from,
    single_frame_scores,
)
from fingerslip.detect.trials import TrialSet, write_trials
from fingerslip.errors import InputError
from fingerslip.vision.tracking.tracker import SeenMarkers
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
    onsets, others = trials.onsets(), held_out(trials.names, 5, 0)
    begins = [detect(made, trials.tracks(name))[2] for name in others]
    known = training.time_error([onsets[name] for name in others], begins)
    results = training.with_test_results(made, trials, onsets, others)
    assert results.provenance == {**made.provenance, training.TESTED: [5, 0], **known}

    def error(labels, begins):
        return training.time_error(*([Onsets(time, None) for time in times] for times in (labels, begins)))

    assert error([1.0] * 3, [1.1, 0.8, 1.3])[training.TIME_ERROR] == pytest.approx([0.2, 0.11, 0.29, 0.0667, 3])
    assert error([1.0, 2.0, None], [1.5, None, 1.0]) == {training.TIME_ERROR: [0.5] * 4 + [1]}
    assert error([1.0], [None]) == {}
    time, scores = np.arange(4.0), np.array([[0.0, 9.0], [3.0, 9.0], [1.0, 9.0], [8.0, 9.0]])
    largest = [training.largest_before(time, scores, Onsets(*at)) for at in ((2.5, 3.0), (None, None), (0.0, 1.0))]
    assert largest == [3.0, 8.0, -np.inf]


def test_clip_of_another_sensor_is_known_by_how_its_rest_looks(detector, trials):
    tracks, deeper = (trials.tracks(trials.names[number]) for number in (8, -1))
    alike, noisy = (training.strange_shares(detector, disturb(tracks, "noise", amount)) for amount in (0.0, 1.0))
    assert alike.max() < training.UNLIKE < 0.5 < noisy[0]
    assert training.strange_shares(detector, deeper)[1] > training.UNLIKE, "no such indentation was learned"
    live = LiveDetector(detector)
    assert list(run_live(live, frames_of(deeper)))
    assert live.strange_shares == pytest.approx(training.strange_shares(detector, deeper))
    assert training.strange_shares(dataclasses.replace(detector, ranges=None), tracks).tolist() == [0.0, 0.0]


def test_markers_that_are_only_numbered_otherwise_are_told_so(detector, trials):
    tracks = trials.tracks(trials.names[0])
    with pytest.raises(InputError, match=r"in px, numbered otherwise, needs the markers .*: 81 internal markers"):
        training.check_tracks_fit(detector, tracks.assign_coords(marker=tracks["marker"] + 1))
    with pytest.raises(InputError, match=r"have \d+ internal markers \([^)]*\) in px, needs"):
        training.check_tracks_fit(detector, tracks.isel(marker=slice(None, None, 2)))


def test_trials_at_two_rates_make_a_detector_that_refuses_neither(samples, trials, monkeypatch):
    onsets, rates = trials.onsets(), np.where(np.arange(len(samples.interval)) % 2, 1 / 30, 1 / 60)
    monkeypatch.setattr(training, "samples_of", lambda *_, **__: dataclasses.replace(samples, interval=rates))
    assert training.train(trials, onsets, "time_threshold", motion=MOTION, sampling=SAMPLING).frame_rate is None


def test_a_frame_rate_fits_within_a_tenth(detector):
    assert detector.frame_rate == 30.0
    rates = {26.5: True, 27.5: False, 32.5: False, 33.5: True}
    assert {rate: bool(training.rate_fault(detector, rate)) for rate in rates} == rates


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
    assert one.steps is training.candidate_of_name("logistic").steps
    for name, message in (
        ("magic", "classifier: got 'magic', needs one of forest, svm,"),
        ("forest:touch", "features: got touch, needs some of displacement"),
        ("forest:", "features: got none"),
    ):
        with pytest.raises(InputError, match=message):
            training.candidate_of_name(name)
    fewer = trials.tracks(trials.names[0]).isel(marker=slice(0, 60))
    with pytest.raises(InputError, match=r"have 41 internal markers \(rings of 1, 8, 16 and 16\) in px, needs"):
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


@pytest.mark.parametrize("lost", [0.0, 0.3])
def test_frame_by_frame_finds_what_whole_tracks_give(detector: Detector, trials: TrialSet, lost: float) -> None:
    tracks = disturb(trials.tracks(trials.names[-1]), "lost", lost, seed=3)
    tracks["position"].values[100] = np.nan
    tracks["quality"].values[100] = 0.0
    time, scores, onsets = detect(detector, tracks)
    found = list(run_on_tracks(detector, tracks))
    assert [one.time for one in found] == time.tolist()
    assert np.array([[one.slip, one.gross] for one in found]) == pytest.approx(scores, abs=1e-4)
    assert found[-1].onsets == onsets
    assert latency_of(found).frames == len(time)
    latency = latency_of(found)
    assert 0 < latency.median <= latency.late <= latency.largest


def test_nothing_is_found_before_rest_is_over(detector: Detector, trials: TrialSet) -> None:
    live, frames = LiveDetector(detector), list(frames_of(trials.tracks(trials.names[-1])))
    assert [len(live.take(frame)) for frame in frames[:22]] == [*[0] * 19, 20, 1, 1]
    with pytest.raises(InputError, match="fewer than the frames at rest"):
        latency_of(list(run_live(LiveDetector(detector), frames[:5])))


def test_what_does_not_fit_the_detector_is_refused(detector: Detector, trials: TrialSet) -> None:
    frames = list(frames_of(trials.tracks(trials.names[-1])))
    for start in (3, 25):
        live = LiveDetector(detector)
        for frame in frames[:start]:
            live.take(frame)
        with pytest.raises(InputError, match="frame: is a list, needs the markers of one frame; write: for seen in"):
            live.take([])  # type: ignore[arg-type]
        with pytest.raises(InputError, match="needs rising times"):
            live.take(frames[start - 1])
        with pytest.raises(InputError, match=r"frame: has positions of shape \(4, 2\)"):
            live.take(SeenMarkers(1e3, np.zeros((4, 2))))
        with pytest.raises(InputError, match=r"frame: has a marker at 1e\+300, needs at most 1e\+09"):
            live.take(SeenMarkers(1e3, np.full_like(frames[0].position, 1e300)))
    tracks = trials.tracks(trials.names[-1])
    tracks["position"].values[:20, 30] = np.nan
    tracks["quality"].values[:20, 30] = 0.0
    with pytest.raises(InputError, match="marker 11: is seen in none of the frames at rest"):
        list(run_on_tracks(detector, tracks))
    tracks["position"].values[:] = 1e300
    with pytest.raises(InputError, match=r"tracks: has a marker at 1e\+300, needs at most"):
        motion_of(tracks)
    with pytest.raises(InputError, match="needs the markers that the detector learned from"):
        list(run_on_tracks(detector, trials.tracks(trials.names[0]).isel(marker=slice(0, 50))))


DRAW = np.random.default_rng(0)
CLASSES = np.tile([0, 1, 2], 80).astype(np.int8)
VALUES = (CLASSES[:, None] * 2.0 + DRAW.normal(size=(240, 6))).astype(np.float32)


@functools.cache
def fitted(name):
    return fit(CLASSIFIERS[name], VALUES[:, :1] if name.endswith("threshold") else VALUES, CLASSES)


@pytest.mark.parametrize("name", CLASSIFIERS)
def test_every_classifier_learns_what_is_plain(name):
    values = VALUES[:, :1] if name.endswith("threshold") else VALUES
    found = probabilities(fitted(name), values)
    assert found.shape == (240, 3)
    assert found.sum(axis=1) == pytest.approx(1.0)
    assert (found.argmax(axis=1) == CLASSES).mean() > 0.7
    assert found[:5] == pytest.approx(probabilities(fitted(name), values[:5]), abs=1e-6)


def test_classifiers_are_those_published():
    forest = fitted("forest")
    assert (forest.max_depth, forest.min_samples_leaf, forest.n_estimators) == (20, 5, 50)
    assert CLASSIFIERS["forest"].sets == ("displacement", "speed")
    assert probabilities(forest, VALUES) == pytest.approx(forest.predict_proba(VALUES), abs=1e-12)
    machine = fitted("svm").get_params()
    assert (machine["linearsvc__C"], machine["nystroem__kernel"], machine["nystroem__gamma"]) == (10.0, "rbf", None)
    assert fitted("time_threshold").get_n_leaves() == 3


FILTER = ForwardFilter((3.0, 1.0), (0.25, 0.5, 0.25), 0.2)
TIME = np.arange(100) / 30.0
STEP = np.diff(TIME, prepend=0.0)


def phases(flicker=False):
    chances = np.tile([0.9, 0.08, 0.02], (100, 1))
    chances[50:] = [0.1, 0.8, 0.1]
    chances[80:] = [0.02, 0.08, 0.9]
    if flicker:
        chances[20] = [0.1, 0.8, 0.1]
    return chances


def test_one_odd_frame_is_no_event_but_where_frames_stand_alone():
    scores, _ = FILTER.scores(FILTER.start(), STEP, phases(flicker=True))
    found = onsets_from(TIME, scores)
    assert TIME[50] <= found.incipient < TIME[65]
    assert TIME[80] <= found.gross < TIME[90]
    assert onsets_from(TIME, single_frame_scores(phases(flicker=True))) == Onsets(TIME[20], TIME[80])
    assert (single_frame_scores(np.full((2, 3), np.nan)) == -np.inf).all()


@given(seed=st.integers(0, 1000), cut=st.integers(0, 60))
@settings(max_examples=20)
def test_frame_by_frame_is_the_same_as_all_at_once(seed, cut):
    draw = np.random.default_rng(seed)
    chances = draw.dirichlet(np.ones(3), 60)
    chances[draw.random(60) < 0.2] = np.nan
    whole, _ = FILTER.scores(FILTER.start(), STEP[:60], chances)
    first, state = FILTER.scores(FILTER.start(), STEP[:cut], chances[:cut])
    rest, _ = FILTER.scores(state, STEP[cut:60], chances[cut:])
    assert np.array_equal(np.concatenate([first, rest]), whole)
    assert not np.isnan(whole).any()


def test_the_filter_is_that_of_the_textbook():
    chances = np.random.default_rng(0).dirichlet(np.ones(3), 30)
    one = ForwardFilter((2.0, 1.5), (0.3, 0.4, 0.3), 1.0)
    scores, _ = one.scores(one.start(), STEP[:30], chances)
    belief, found = np.array([0.998, 0.001, 0.001]), []
    for interval, chance in zip(STEP[:30], np.maximum(chances, 1e-3), strict=True):
        first, second = -np.expm1(-interval / np.array([2.0, 1.5]))
        belief = np.array([[1 - first, first, 0], [0, 1 - second, second], [0, 0, 1]]).T @ belief
        belief *= chance / np.array([0.3, 0.4, 0.3])
        belief /= belief.sum()
        found.append([np.log((1 - belief[0]) / belief[0]), np.log(belief[2] / (1 - belief[2]))])
    assert scores == pytest.approx(np.array(found), rel=1e-6, abs=1e-6)


def test_frames_that_could_not_be_classified_change_little_and_thresholds_delay_events_or_prevent_them():
    chances = phases()
    chances[60:64] = np.nan
    scores, _ = FILTER.scores(FILTER.start(), STEP, chances)
    assert abs(scores[63, 0] - scores[59, 0]) < 0.6
    scores, _ = FILTER.scores(FILTER.start(), STEP, phases())
    early, late = onsets_from(TIME, scores), onsets_from(TIME, scores, Thresholds(slip=5.0, gross=1e9))
    assert early.incipient < late.incipient
    assert late.gross is None
    assert onsets_from(TIME[:10], scores[:10]) == Onsets(None, None)
    # Else an alarm of gross slip would go round the threshold that bounds false alarms.
    scores = np.array([[1.0, 0.5], [2.0, -1.0], [5.0, -1.0], [4.0, 2.0]])
    assert onsets_from(np.arange(4.0), scores, Thresholds(slip=3.0)) == Onsets(2.0, 3.0)


FOREST, SCALED = CLASSIFIERS["forest"], CLASSIFIERS["logistic"]
HURRIED = dataclasses.replace(SCALED, steps=(SCALED.steps[0], ("linear_model.LogisticRegression", {"max_iter": 1})))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fit(FOREST, VALUES, np.minimum(CLASSES, 1)), r"has the classes \[0, 1\], needs 0, 1 and 2"),
        (lambda: fit(HURRIED, VALUES, CLASSES), "classifier logistic: does not converge"),
        (lambda: optional("no_such_module"), r'no_such_module is missing .*pip install "fingerslip\[detect\]"'),
        (lambda: ForwardFilter((0.0, 1.0), (0.25, 0.5, 0.25), 0.2), "ForwardFilter.dwell.*: got 0.0, needs a number >"),
        (lambda: ForwardFilter((1.0, 1.0), (0.0, 0.5, 0.5), 0.2), "ForwardFilter.prior.*: got 0.0, needs a number > 0"),
        (lambda: ForwardFilter((1.0, 1.0), (0.2, 0.4, 0.4), float("nan")), "ForwardFilter.weight: got nan"),
        (lambda: false_alarm_threshold([0.0] * 18), "got 18 trials for a guarantee of 0.95, needs at least 19"),
        (lambda: lead_bound([1.0]), "needs at least 19"),
        (lambda: least_trials(0.0), "share: got 0"),
    ],
)
def test_what_cannot_be_is_refused(call, message):
    with pytest.raises(InputError, match=message):
        call()


@given(st.lists(st.floats(-10, 10), min_size=20, max_size=80, unique=True))
def test_each_trial_in_turn_raises_an_alarm_in_at_most_5_percent_and_has_the_lead_in_at_least_95(values):
    """With every order equally likely, leaving each out in turn is the whole distribution: the bounds are exact."""
    others = [values[:i] + values[i + 1 :] for i in range(len(values))]
    pairs = list(zip(values, others, strict=True))
    assert np.mean([value > false_alarm_threshold(rest) for value, rest in pairs]) <= 0.05 + 1e-12
    bounds = [(value, lead_bound(rest)) for value, rest in pairs]
    assert np.mean([bound is not None and lead >= bound for lead, bound in bounds]) >= 0.95 - 1e-12


def test_the_ranks_and_how_many_trials_they_need():
    assert [least_trials(share) for share in (0.5, 0.1, 0.05, 0.01)] == [1, 9, 19, 99]
    assert false_alarm_threshold(list(range(19))) == 18
    assert false_alarm_threshold(list(range(39))) == 37
    assert lead_bound([float(one) for one in range(39)]) == 1.0
    assert lead_bound([None, *map(float, range(1, 39))]) == 1.0
    assert lead_bound([None, None, *map(float, range(37))]) is None
