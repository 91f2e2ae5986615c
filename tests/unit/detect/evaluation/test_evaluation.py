"""Folds of trials, an evaluation that goes on where it was interrupted, scores, whole trials and the page."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sklearn.calibration import calibration_curve
from sklearn.metrics import brier_score_loss, confusion_matrix, precision_recall_fscore_support

from fingerslip.detect.classifiers import CLASSIFIERS
from fingerslip.detect.evaluation.crossval import Evaluation, Parts, begin_evaluation, parts_beside
from fingerslip.detect.evaluation.figures import (
    FIGURES,
    Judged,
    leads_figure,
    read_judged,
    write_evaluation,
    write_judged,
)
from fingerslip.detect.evaluation.scores import (
    Estimate,
    bootstrap_estimates,
    check_submission,
    confusion_by_trial,
    event_scores_of,
    event_table,
    frame_scores_of,
    reliability_of,
    rest_ends,
    score_submission,
)
from fingerslip.detect.evaluation.whole import SHIPS, evaluate_whole, slips_of
from fingerslip.detect.labels import Onsets, write_onsets
from fingerslip.detect.page import draw
from fingerslip.detect.samples import Samples, benchmark_test_trials, grouped_folds
from fingerslip.detect.session import Choices
from fingerslip.detect.synthetic import SyntheticSensor, SyntheticSlide, synthetic_trial
from fingerslip.detect.trials import TrialSet, write_trials
from fingerslip.errors import DamagedError, InputError
from fingerslip.study.inspection.views import FigureChoice, kinds_text, write_figure
from fingerslip.tables.table import Column, Missing, Table
from unit.detect.conftest import MOTION, SAMPLING

CANDIDATES = [CLASSIFIERS[name] for name in ("time_threshold", "displacement_threshold")]
ARRAYS = {"rows": np.arange(5), "chances": np.linspace(0.0, 1.0, 6).reshape(2, 3)}


def test_no_trial_is_on_both_sides_and_events_are_found_in_all(samples, trials):
    onsets = trials.onsets()
    run = Evaluation(trials, onsets, samples, MOTION, share=0.25)
    folds = [run.fit(CLASSIFIERS["logistic"], test) for test in grouped_folds(trials.names, 3, 0)]
    for fold in folds:
        assert len(fold.calibration) == 3
        assert not set(fold.calibration) & set(fold.tested)
    matrices = run.matrices([fold.frames for fold in folds])
    assert len(matrices) == 24
    assert matrices.sum() == len(samples.classes)
    events = [pair for event in run.events(folds) for pair in event.items()]
    assert {name for name, _ in events} == set(trials.names)
    # The calibration trials allow a quarter of the trials an alarm before slip; twelve of 24 would be far beyond that.
    early = sum(event.first is not None and event.first < (onsets[name].first or 0.0) for name, event in events)
    assert early < 12


@pytest.mark.slow
def test_frames_of_known_trials_are_easier_for_a_classifier_that_learns_them_by_heart(trials):
    """Trials whose frames differ by an offset of the trial alone leak through a split by sample."""
    draw = np.random.default_rng(0)
    classes = np.tile(np.repeat([0, 1, 2], 20), 20).astype(np.int8)
    trial = np.repeat(np.arange(20), 60)
    key = draw.normal(size=(20, 3, 4))
    values = (key[trial, classes] + 0.05 * draw.normal(size=(1200, 4))).astype(np.float32)
    names = tuple(f"{name}/x/{number}" for name in ("displacement", "speed") for number in (0, 1))
    known = tuple(f"t{number}" for number in range(20))
    samples = Samples(values, classes, trial, names, known, np.zeros(2, dtype=np.intp), *np.zeros((3, 20)))
    run, forest = Evaluation(trials, dict.fromkeys(known, Onsets(1.0, 2.0)), samples, MOTION), CLASSIFIERS["forest"]
    grouped = run.matrices([run.fit(forest, test).frames for test in grouped_folds(known, 5, 0)])
    accuracy = [np.trace(matrices.sum(axis=0)) / matrices.sum() for matrices in (grouped, run.by_sample(forest))]
    assert accuracy[0] < 0.5
    assert accuracy[1] > 0.95


def test_folds_that_leave_nothing_to_learn_from_and_a_file_for_a_folder_are_refused(begin, trials, tmp_path):
    run = begin()
    with pytest.raises(InputError, match="folds: leave no trial to learn from"):
        run.rows_to_learn(trials.names)
    classes = np.where(run.samples.trial > 0, np.minimum(run.samples.classes, 1), run.samples.classes)
    few = dataclasses.replace(run.samples, classes=classes)
    with pytest.raises(InputError, match="leaves out trial slide-0000: has no frame of gross to learn from"):
        dataclasses.replace(run, samples=few).rows_to_learn(trials.names[:1])
    (tmp_path / "tables").write_text("mine")
    with pytest.raises(InputError, match="is a file, needs a folder"):
        parts_beside(tmp_path / "tables")


@pytest.fixture
def begin(trials, samples):
    """Return a function that begins an evaluation, with parts beside an output."""
    some, onsets = dataclasses.replace(trials, names=trials.names[::2]), trials.onsets()
    return lambda output=None: Evaluation(some, onsets, samples, MOTION, parts=parts_beside(output, "data"))


@pytest.fixture
def fits(monkeypatch):
    """Return a list that gets the name of the classifier of every fit; the third fit is interrupted."""
    names = []

    def counted(run, candidate, test, *, fit=Evaluation.fit):
        names.append(candidate.name)
        if len(names) == 3:
            raise KeyboardInterrupt
        return fit(run, candidate, test)

    monkeypatch.setattr(Evaluation, "fit", counted)
    return names


@pytest.mark.slow
def test_an_interrupted_evaluation_goes_on(begin, tmp_path, fits):
    names = begin().trials.names
    tests = grouped_folds(names, 3, 0)
    with pytest.raises(KeyboardInterrupt):
        begin(tmp_path / "tables").by_fold(CANDIDATES, tests)
    assert len(list((tmp_path / "tables.unfinished").iterdir())) == 2  # both classifiers of the first fold
    run = begin(tmp_path / "tables")
    frames, events = run.by_fold(CANDIDATES, tests)
    assert len(fits) == 3 + 4  # the first fold is not fitted again
    whole_frames, whole_events = begin().by_fold(CANDIDATES, tests)
    assert events == whole_events
    assert all(list(onsets) == list(names) for onsets in events.values())
    for name, pieces in whole_frames.items():
        assert np.array_equal(run.matrices(frames[name]), run.matrices(pieces))
    groups = run.by_group(CANDIDATES[0], tests[:1])
    count = len(fits)
    assert np.array_equal(run.by_group(CANDIDATES[0], tests[:1])[0].chances, groups[0].chances)
    first, second = (begin(tmp_path / "tables").by_sample(CANDIDATES[0]) for _ in range(2))
    assert np.array_equal(first, second)
    assert len(fits) == count


@pytest.mark.slow
def test_other_labels_are_not_taken_for_the_same(trials, tmp_path):
    later = {name: Onsets(one.incipient, (one.gross or 0.0) + 0.05) for name, one in trials.onsets().items()}
    output = tmp_path / "tables"
    first, second, third = (
        begin_evaluation(trials, onsets, CANDIDATES[:1], MOTION, SAMPLING, output=output).parts.inputs
        for onsets in (trials.onsets(), trials.onsets(), later)
    )
    assert first == second != third


@pytest.mark.parametrize("folder", ["tables", None])
def test_a_part_is_made_once_where_there_is_a_folder_and_other_inputs_are_another(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    calls = []
    store = parts_beside(tmp_path / folder if folder else None, "data")
    for _ in range(2):
        arrays = store.part("forest:mean", [1, "a"], lambda: calls.append(1) or ARRAYS)
        assert arrays.keys() == ARRAYS.keys()
        assert all(np.array_equal(arrays[name], ARRAYS[name]) for name in ARRAYS)
    assert len(calls) == (1 if folder else 2)
    assert store.folder == (tmp_path / "tables.unfinished" if folder else None)
    store.remove()
    assert list(tmp_path.iterdir()) == []
    parts_beside(tmp_path / "tables", "data").write("forest", [1], ARRAYS)
    for key in (("data", "forest", 1), ("other", "forest", 1), ("data", "logistic", 1), ("data", "forest", 2)):
        stored = parts_beside(tmp_path / "tables", key[0]).read(key[1], [key[2]])
        assert (stored is not None) == (key == ("data", "forest", 1)), key


@pytest.mark.parametrize(
    "damage",
    [
        lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
        lambda path: path.write_bytes(b""),
        lambda path: path.write_bytes(b"no arrays"),
        lambda path: path.write_bytes(path.read_bytes().replace(np.arange(5).tobytes(), np.arange(1, 6).tobytes())),
        lambda path: np.savez(path, rows=np.array([print], dtype=object)),
    ],
    ids=["cut", "empty", "foreign", "changed", "what would run"],
)
def test_a_damaged_part_is_made_again(tmp_path, damage):
    store = Parts(tmp_path, "data")
    store.write("forest", [1], ARRAYS)
    damage(next(tmp_path.iterdir()))
    assert store.read("forest", [1]) is None


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
    scores = frame_scores_of(matrices)
    ours = [[entry.value for entry in entries] for entries in (scores.precision, scores.recall)]
    assert np.array(ours, dtype=float) == pytest.approx(np.array(theirs[:2]), nan_ok=True)
    assert scores.two_class.value == pytest.approx(np.mean((true == 2) == (predicted == 2)))


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
    error, brier = reliability_of(np.stack([1 - slip, slip, 0 * slip], axis=1), classes)
    seen, said = calibration_curve(classes, slip, n_bins=10)
    count = np.histogram(slip, bins=10, range=(0, 1))[0]
    assert error == pytest.approx((np.abs(seen - said) * count).sum() / 20_000, abs=1e-9)
    assert brier == pytest.approx(2 * brier_score_loss(classes, slip), rel=1e-9)
    sure = reliability_of(np.tile([0.0, 1.0, 0.0], (10, 1)), np.array([0, 1] * 5, dtype=np.int8))
    assert sure == pytest.approx((0.5, 1.0))


def test_events_are_scored_and_the_bound_needs_19_trials():
    onsets = {"a": Onsets(2.5, 4.5), "b": Onsets(1.7, 3.0), "c": Onsets(None, None), "held": Onsets(None, None)}
    scores = event_scores_of(onsets, LABELS, REST, frame=0.1)
    assert (scores.trials, scores.missed) == (3, 1)
    values = {name: value.value for name, value in vars(scores).items() if isinstance(value, Estimate)}
    wanted = {
        "error": 0.1,
        "absolute_error": 0.4,
        "early": 1 / 3,
        "before_gross": 2 / 3,
        "lead": 1.5,
        "lead_of_all": 1.9,
    }
    assert values == pytest.approx(wanted | {"at_rest": 0.0, "gross_error": -0.25, "gross_found": 2 / 3})
    assert scores.error_spread == pytest.approx(0.8 / 2**0.5)
    assert (scores.delay_frames, scores.later_delay_frames) == pytest.approx((1.0, 5.0))
    assert (scores.bound, scores.lead_spread) == (None, None)
    assert scores.lead_of_all_spread == pytest.approx(0.8 / 2**0.5)
    onsets = {"a": Onsets(0.5, None), "b": Onsets(2.0, None), "c": Onsets(2.0, None), "held": Onsets(3.0, None)}
    assert event_scores_of(onsets, LABELS, REST).at_rest.value == 0.5
    gross = event_scores_of({"a": Onsets(None, 2.2)}, LABELS, REST)
    assert (gross.error.value, gross.missed) == (pytest.approx(0.2), 0)
    labels = {f"t{number}": Onsets(1.0, 3.0) for number in range(19)}
    onsets = {name: Onsets(1.0 + 0.1 * number, None) for number, name in enumerate(labels)}
    assert event_scores_of(onsets, labels, dict.fromkeys(labels, 0.5)).bound == pytest.approx(0.2)


def test_an_alarm_before_the_label_is_early_and_has_no_lead():
    labels = {f"t{number}": Onsets(5.0, 6.0) for number in range(19)}
    always = {name: Onsets(1.5, None) for name in labels}  # which would have a lead of 4.5 s in a window of 1 s
    scores = event_scores_of(always, labels, dict.fromkeys(labels, 1.0))
    assert (scores.early.value, scores.lead.value, scores.bound) == (1.0, None, None)
    rows = {row[0]: row[1] for row in event_table({"always": scores}).rows}
    assert (rows["early alarm"].value, rows["lead before gross slip [s]"]) == (1.0, Missing.NOT_DEFINED)
    judged = {"always": Judged(np.eye(3, dtype=int), np.zeros(1), np.zeros(1, dtype=bool), always)}
    assert not leads_figure(judged, labels).axes[0].lines[:-1]
    some = {name: Onsets((1.5, None, 5.5)[number % 3], None) for number, name in enumerate(labels)}
    judged = {"some": Judged(np.eye(3, dtype=int), np.zeros(1), np.zeros(1, dtype=bool), some)}
    shares = leads_figure(judged, labels).axes[0].lines[0].get_ydata()
    assert shares.max() == pytest.approx(6 / 19), "neither early alarms nor missed trials had a lead"
    unlabelled = event_scores_of({"t": Onsets(1.5, None)}, {"t": Onsets(None, 6.0)}, {"t": 1.0})
    assert unlabelled.lead.value == 4.5  # where slip begins is not labelled there


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
    table, each = evaluate_whole(mixed.folder, CHOICES, folds=2, group="object", output=tmp_path)
    accuracies = {str(row[0]): float(str(row[1]).split()[0]) for row in table.rows}
    assert accuracies.pop("length of the clip alone") <= 0.5
    assert accuracies.keys() == {"forest", "logistic", SHIPS}
    assert accuracies["logistic"] > 0.9
    assert accuracies[SHIPS] == 1.0
    assert "12 trials, 6 with slip; to say the commoner always is right in 0.500" in table.note
    assert [(row[1], row[-1]) for row in each.rows] == [("yes", 1.0), ("no", 0.0)] * 6
    assert len(list(tmp_path.glob("*.csv"))) == 2
    page = (tmp_path / "evaluation.html").read_text()
    assert [f'id="{kind}"' in page for kind in FIGURES] == [True] * 3 + [False] * 2
    assert draw(tmp_path, "confusion").axes[0].get_yticklabels()[1].get_text() == "slip"
    with pytest.raises(InputError, match="has no figure leads: trials were judged whole, needs confusion, roc, calib"):
        draw(tmp_path, "leads")


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
    write_evaluation([table], judged, labels, tmp_path, "Evaluation")
    page = (tmp_path / "evaluation.html").read_text()
    for name in ("confusion", "roc", "calibration", "leads", "trials"):
        assert f'id="{name}"' in page
    (tmp_path / "judged.npz").unlink()
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
