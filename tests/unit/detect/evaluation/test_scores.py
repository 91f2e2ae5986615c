import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sklearn.calibration import calibration_curve
from sklearn.metrics import brier_score_loss, confusion_matrix, precision_recall_fscore_support

from fingerslip.detect.evaluation.scores import (
    Estimate,
    bootstrap_estimates,
    check_submission,
    confusion_by_trial,
    event_scores_of,
    frame_scores_of,
    precision_recall_f1,
    reliability_of,
    rest_ends,
    score_submission,
)
from fingerslip.detect.labels import Onsets, write_onsets
from fingerslip.detect.samples import benchmark_test_trials
from fingerslip.errors import InputError

CLASSES = st.lists(st.tuples(st.integers(0, 2), st.integers(0, 2), st.integers(0, 4)), min_size=1, max_size=60)
LABELS = {"a": Onsets(2.0, 4.0), "b": Onsets(2.0, 4.0), "c": Onsets(2.0, 4.0), "held": Onsets(None, None)}
REST = dict.fromkeys(LABELS, 1.0)


def test_the_interval_of_a_mean_is_that_of_theory_and_of_nothing_none():
    values = np.random.default_rng(0).normal(size=400)
    (mean,) = bootstrap_estimates(lambda drawn: values[drawn].mean(axis=1)[:, None], 400)
    half = 1.96 * values.std() / 20
    assert mean.value == pytest.approx(values.mean())
    assert (mean.low, mean.high) == pytest.approx(values.mean() + np.array([-half, half]), abs=0.01)

    def whole(drawn):
        """Return 1 where all trials are drawn, else nothing."""
        return np.array([[1.0 if len(set(row.tolist())) == drawn.shape[1] > 0 else np.nan] for row in drawn])

    estimates = [bootstrap_estimates(whole, count)[0] for count in (0, 1, 5)]
    assert estimates == [Estimate(None), Estimate(1.0), Estimate(1.0)]


@given(CLASSES)
def test_scores_are_those_of_scikit_learn(rows):
    true, predicted, trial = (np.array(column) for column in zip(*rows, strict=True))
    matrices = confusion_by_trial(true.astype(np.int8), predicted.astype(np.int8), trial)
    assert len(matrices) == len(set(trial.tolist()))
    whole = matrices.sum(axis=0)
    assert np.array_equal(whole, confusion_matrix(true, predicted, labels=[0, 1, 2]))
    theirs = precision_recall_fscore_support(true, predicted, labels=[0, 1, 2], zero_division=np.nan)[:3]
    assert precision_recall_f1(whole)[:2] == pytest.approx(np.array(theirs[:2]), nan_ok=True)
    assert frame_scores_of(matrices).two_class.value == pytest.approx(np.mean((true == 2) == (predicted == 2)))


def test_intervals_are_over_trials():
    good, bad = np.diag([10, 10, 10]), np.array([[0, 10, 0], [0, 10, 0], [0, 0, 10]])
    scores = frame_scores_of(np.array([good] * 9 + [bad]))
    assert scores.accuracy.value == pytest.approx(290 / 300)
    assert scores.accuracy.low < 0.95
    assert scores.recall[0].value == pytest.approx(0.9)
    assert scores.recall[2].value == scores.recall[2].low == 1.0
    assert scores.f1_mean.value == pytest.approx(np.mean([score.value for score in scores.f1]))
    never = frame_scores_of(np.array([[[5, 0, 0], [0, 5, 0], [0, 0, 0]]] * 3))
    assert never.precision[2].value is None
    assert never.f1_mean.value == 1.0


def test_calibration_error_is_the_mean_gap_of_the_bins():
    draw = np.random.default_rng(0)
    slip = draw.random(20_000)
    classes = (draw.random(20_000) < slip**2).astype(np.int8)
    reliability = reliability_of(np.stack([1 - slip, slip, 0 * slip], axis=1), classes)
    seen, said = calibration_curve(classes, slip, n_bins=10)
    count = np.histogram(slip, bins=10, range=(0, 1))[0]
    assert reliability.error == pytest.approx((np.abs(seen - said) * count).sum() / 20_000, abs=1e-9)
    assert reliability.brier == pytest.approx(2 * brier_score_loss(classes, slip), rel=1e-9)
    sure = reliability_of(np.tile([0.0, 1.0, 0.0], (10, 1)), np.array([0, 1] * 5, dtype=np.int8))
    assert (sure.error, sure.brier) == pytest.approx((0.5, 1.0))


def test_events_are_scored_and_the_bound_needs_19_trials():
    onsets = {"a": Onsets(2.5, 4.5), "b": Onsets(1.7, 3.0), "c": Onsets(None, None), "held": Onsets(None, None)}
    scores = event_scores_of(onsets, LABELS, REST, frame=0.1)
    assert (scores.trials, scores.missed) == (3, 1)
    values = {name: value.value for name, value in vars(scores).items() if isinstance(value, Estimate)}
    wanted = {"error": 0.1, "absolute_error": 0.4, "early": 1 / 3, "before_gross": 2 / 3, "lead": (1.5 + 2.3) / 2}
    assert values == pytest.approx(wanted | {"at_rest": 0.0, "gross_error": -0.25, "gross_found": 2 / 3})
    assert scores.error_spread == pytest.approx(0.8 / 2**0.5)
    assert scores.delay_frames == pytest.approx(1.0)
    assert scores.bound is None
    onsets = {"a": Onsets(0.5, None), "b": Onsets(2.0, None), "c": Onsets(2.0, None), "held": Onsets(3.0, None)}
    assert event_scores_of(onsets, LABELS, REST).at_rest.value == 0.5
    gross = event_scores_of({"a": Onsets(None, 2.2)}, LABELS, REST)
    assert (gross.error.value, gross.missed) == (pytest.approx(0.2), 0)
    labels = {f"t{number}": Onsets(1.0, 3.0) for number in range(19)}
    onsets = {name: Onsets(1.0 + 0.1 * number, None) for number, name in enumerate(labels)}
    assert event_scores_of(onsets, labels, dict.fromkeys(labels, 0.5)).bound == pytest.approx(0.2)


def test_the_labels_are_a_perfect_submission_rest_ends_with_its_last_frame_and_others_have_to_fit(trials, tmp_path):
    tests, onsets = benchmark_test_trials(trials.names), trials.onsets()
    write_onsets({name: onsets[name] for name in tests}, tmp_path / "mine.csv")
    scores = score_submission(trials, tmp_path / "mine.csv", rest_frames=20)
    assert scores.trials == len(tests) == 5
    assert (scores.error.value, scores.missed, scores.before_gross.value) == (0.0, 0, 1.0)
    few = {name: onsets[name] for name in tests[1:]}
    with pytest.raises(InputError, match=f"labels: have no trial {tests[0]}"):
        score_submission(trials, tmp_path / "mine.csv", labels=few, rest_frames=20)
    with pytest.raises(InputError) as caught:
        check_submission({"a": Onsets(1.0, None), "c": Onsets(1.0, None)}, ("a", "b"), "mine.csv")
    mistakes = [mistake.found for mistake in caught.value.all]
    assert mistakes == ["has no row for the test trial b", "has a row for c, no test trial"]
    with pytest.raises(InputError, match=r"has gross slip of a at 2 s, incipient slip at 3 s, needs gross slip last"):
        check_submission({"a": Onsets(3.0, 2.0)}, ("a",), "mine.csv")
    both = {"a": Onsets(2.0, 2.0), "b": Onsets(None, 2.0)}
    assert check_submission(both, ("a", "b"), "mine.csv") == both
    ends, frame = rest_ends(trials, trials.names[:2], 20)
    assert ends[trials.names[0]] == pytest.approx(19 / 30)
    assert frame == pytest.approx(1 / 30)
    with pytest.raises(InputError, match="has 260 frames, needs more than the 300 at rest"):
        rest_ends(trials, trials.names[:1], 300)
