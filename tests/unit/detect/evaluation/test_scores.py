"""Scores of frames, events, submissions and whole trials, and the page of an evaluation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sklearn.calibration import calibration_curve
from sklearn.metrics import brier_score_loss, confusion_matrix, precision_recall_fscore_support

from fingerslip.detect.evaluation.page import FIGURES, Judged, read_judged, write_evaluation, write_judged
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
from fingerslip.detect.evaluation.whole import SHIPS, evaluate_whole, slips_of
from fingerslip.detect.labels import Onsets, write_onsets
from fingerslip.detect.page import draw
from fingerslip.detect.samples import benchmark_test_trials
from fingerslip.detect.session import Choices
from fingerslip.detect.synthetic import SyntheticSensor, SyntheticSlide, synthetic_trial
from fingerslip.detect.trials import TrialSet, write_trials
from fingerslip.errors import DamagedError, InputError
from fingerslip.study.inspection.views import FigureChoice, kinds_text, write_figure
from fingerslip.tables.table import Column, Table

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


CHOICES = Choices("contact", rest_frames=20, window=5)


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> TrialSet:
    """Return twelve trials, every second one without slip, on two objects each."""
    sensor, cases = SyntheticSensor(metres_per_pixel=120e-6), []
    for number in range(12):
        slide = SyntheticSlide(3e-3, 0.7 * number, 40.0 if number % 2 else 0.8, seed=number, travel=4e-3)
        case = synthetic_trial(f"t{number:02d}", slide, sensor)
        cases.append(type(case)(case.name, case.tracks, case.labels, {"object": str(number // 3)}))
    return write_trials(cases, tmp_path_factory.mktemp("mixed") / "set", "Mixed")


@pytest.mark.slow
def test_slip_is_told_from_none_and_the_length_tells_nothing(mixed, tmp_path):
    (table,) = evaluate_whole(mixed.folder, CHOICES, folds=2, group="object", output=tmp_path)
    accuracies = {str(row[0]): float(str(row[1]).split()[0]) for row in table.rows}
    assert accuracies.pop("length of the clip alone") <= 0.5
    assert accuracies.keys() == {"forest", "logistic", SHIPS}
    assert accuracies["logistic"] > 0.9
    assert accuracies[SHIPS] == 1.0
    assert "12 trials, 6 with slip; to say the commoner always is right in 0.500" in table.note
    assert len(list(tmp_path.glob("*.csv"))) == 1


def test_what_cannot_be_asked_is_refused(mixed):
    with pytest.raises(InputError, match="has no condition 'surface', needs it to be grouped by"):
        evaluate_whole(mixed.folder, CHOICES, group="surface")
    with pytest.raises(InputError, match="has slip in all trials, needs trials with and without"):
        slips_of(mixed, dict.fromkeys(mixed.names, Onsets(1.0, None)))
    with pytest.raises(InputError, match="trial t00: has no label, needs a condition 'slip' or onsets"):
        slips_of(mixed, {})


@pytest.mark.slow
def test_an_evaluation_has_a_page(tmp_path):
    labels = {"a": Onsets(1.0, 2.0), "b": Onsets(None, None)}
    slips, chances = np.array([False, True, True, False]), np.array([0.1, 0.9, 0.6, 0.4])
    late = {"a": Onsets(None, None), "b": Onsets(3.0, None)}
    judged = {
        "forest": Judged(np.diag([2, 1, 1]), chances, slips, {"a": Onsets(1.2, None), "b": Onsets(None, None)}),
        "time_threshold": Judged(np.ones((3, 3), dtype=int), chances, slips, late),
    }
    table = Table("Accuracy", (Column("classifier"),), (("forest",),))
    write_evaluation([table], judged, labels, tmp_path / "page.html", "Evaluation")
    page = (tmp_path / "page.html").read_text()
    for name in ("confusion", "roc", "calibration", "leads", "trials"):
        assert f'id="{name}"' in page
    (tmp_path / "page.html").rename(tmp_path / "evaluation.html")
    with pytest.raises(InputError, match=r"has a page, but no judged.npz: an older version wrote it"):
        kinds_text(tmp_path)
    write_judged(judged, labels, tmp_path)
    read, read_labels = read_judged(tmp_path)
    assert read_labels == labels
    assert [(name, entry.events) for name, entry in read.items()] == [
        (name, entry.events) for name, entry in judged.items()
    ]
    assert read["forest"].matrix.tolist() == judged["forest"].matrix.tolist()
    assert [line.partition(":")[0] for line in kinds_text(tmp_path).splitlines()] == list(FIGURES)
    confusion, trials = (draw(tmp_path, kind) for kind in ("confusion", "trials"))
    assert confusion.axes[1].get_title("left") == "time threshold"
    assert trials.axes[0].get_xlim()[0] < 1.0, "a bar does not begin on the axis"
    for kind in FIGURES:
        assert write_figure(tmp_path, FigureChoice(kind, form="svg")).stat().st_size > 5_000
    with pytest.raises(InputError, match="figure: --run: does not fit --kind roc"):
        write_figure(tmp_path, FigureChoice("roc", run="a"))
    (tmp_path / "judged.npz").write_bytes(b"no archive")
    with pytest.raises(DamagedError, match="run fingerslip detect evaluate again"):
        read_judged(tmp_path)
