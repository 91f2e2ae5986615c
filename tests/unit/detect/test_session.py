"""What the command line asks for: evaluations as tables, learning curves, disturbed tracks, what is assumed."""

from __future__ import annotations

import dataclasses
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fingerslip.detect import page
from fingerslip.detect.classifiers import CLASSIFIERS
from fingerslip.detect.evaluation import inquiries
from fingerslip.detect.evaluation.crossval import Evaluation, parts_beside
from fingerslip.detect.evaluation.inquiries import inquire, levels_of, vary, write_inquiry
from fingerslip.detect.evaluation.scores import (
    Estimate,
    accuracy_table,
    frame_scores_of,
    frame_tables,
    output_tables,
)
from fingerslip.detect.features import FeatureSettings
from fingerslip.detect.labels import CLASSES, LabelSettings, Onsets, write_onsets
from fingerslip.detect.live import Finding
from fingerslip.detect.model_file import read_detector
from fingerslip.detect.residual import findings_table
from fingerslip.detect.samples import benchmark_test_trials, grouped_folds, samples_of
from fingerslip.detect.session import (
    Choices,
    evaluate_classifiers,
    run_detector,
    score_onsets,
    train_detector,
)
from fingerslip.detect.trials import TrialSet
from fingerslip.errors import InputError
from fingerslip.tables.table import Missing, Table, texts, to_csv, to_mapping
from fingerslip.vision.tracks import check_tracks, write_tracks_csv
from unit.detect.conftest import MOTION, SAMPLING

CHOICES = Choices(rest_frames=20, window=5, samples="20,6,2,20")


@pytest.fixture(scope="module")
def stored(trials_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("session") / "detector"
    text = train_detector(trials_folder, folder, "logistic:speed+rings", CHOICES)
    assert "logistic:speed+rings, 19 trials, 912 samples, no guarantee" in text
    assert "arning" not in text
    return folder


@pytest.mark.slow
def test_a_detector_keeps_its_features_and_runs_on_both_files(stored, trials, tmp_path, monkeypatch) -> None:
    name, table = benchmark_test_trials(trials.names)[0], tmp_path / "tracks.csv"
    write_tracks_csv(trials.tracks(name), table)

    def run(detector: str, path: Path) -> list[Table]:
        return run_detector(path, detector, {}, tmp_path / "page")[0]

    monkeypatch.setattr(page, "write_slip_page", lambda *_: None)
    (slides, first), (others, second) = (run(str(stored), path) for path in (trials.folder / name / "tracks.nc", table))
    assert slides.rows == others.rows
    assert first.rows[:3] == second.rows[:3]
    assert first.rows[0][1] is not Missing.NO_EVENT
    assert first.rows[2] == ("frames", "260")
    made = read_detector(stored)
    assert (made.classifier, made.features.sets) == ("logistic:speed+rings", ("speed", "rings"))
    assert made.names[0].startswith("speed/")


@pytest.mark.slow
def test_a_recording_at_another_rate_is_refused_and_one_that_moves_at_rest_is_warned_of(
    stored: Path, trials: TrialSet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page, "write_slip_page", lambda *_: None)
    tracks = trials.tracks(trials.names[0])

    def lines(recording: xr.Dataset) -> str:
        write_tracks_csv(recording, tmp_path / "tracks.csv")
        return "\n".join(run_detector(tmp_path / "tracks.csv", str(stored), {}, tmp_path / "page")[1])

    for factor in (2.0, 0.5):
        other = tracks.assign_coords(time=tracks["time"].values * factor)
        with pytest.raises(InputError, match=rf"has {30 / factor:g} frames/s, the detector learned from 30 frames/s"):
            lines(other)
    assert "warning" not in lines(tracks.assign_coords(time=tracks["time"].values * 1.05))
    assert "and the detector takes 20 frames for rest: its times" in lines(tracks.isel(time=slice(12, None)))


@pytest.mark.slow
def test_motion_in_frames_that_are_taken_for_rest_is_told(trials, trials_folder, tmp_path):
    write_onsets(dict.fromkeys(trials.names, Onsets(2.5, 3.0)), tmp_path / "labels.csv")
    late = replace(CHOICES, rest_frames=60, least=0.0, labels=str(tmp_path / "labels.csv"))
    said = train_detector(trials_folder, tmp_path / "detector", "logistic", late)
    assert said.startswith("Warning: in a trial markers move within the 60 frames taken for rest; the shortest rest is")


def test_times_that_count_from_a_date_are_counted_from_the_first_frame(trials, tmp_path, monkeypatch):
    monkeypatch.setattr(page, "write_slip_page", lambda *_: None)
    tracks, tables = trials.tracks(trials.names[0]), []
    for number, first in enumerate((0.0, 1.7e9)):
        table = tmp_path / f"{number}.csv"
        write_tracks_csv(tracks.assign_coords(time=tracks["time"].values + first), table)
        (slides, _), lines = run_detector(table, "residual", {}, tmp_path / "page")
        tables.append(texts(slides))
        assert ("its first frame is at 1700000000.000 s; all times" in "\n".join(lines)) == (first > 0)
    assert tables[0] == tables[1]


@pytest.mark.slow
def test_an_evaluation_has_its_tables(trials_folder: Path, tmp_path: Path) -> None:
    names = ("time_threshold", "displacement_threshold")
    tables = evaluate_classifiers(trials_folder, names, CHOICES, folds=3, leave_out=("indentation",))
    assert [table.title for table in tables] == [
        "Accuracy on frames",
        "Classes, on trials that were not seen",
        "Confusion, frames",
        "Calibration",
        "Onset of slip",
        "Accuracy where indentation was not seen",
    ]
    assert "Too few trials for a guaranteed threshold" in tables[4].note
    assert [row[1] for row in tables[5].rows] == ["0.003", "0.004", "all"] * 2
    text = output_tables(tables, tmp_path / "tables")
    assert text.count("## ") == 6
    assert len(list((tmp_path / "tables").glob("*.csv"))) == 6


def test_labels_of_a_users_own_are_read(trials_folder: Path, trials: TrialSet, tmp_path: Path) -> None:
    later = {name: Onsets((one.incipient or 0.0) + 0.1, one.gross) for name, one in trials.onsets().items()}
    write_onsets(later, tmp_path / "mine.csv")
    mine = Choices(labels=str(tmp_path / "mine.csv"), rest_frames=20)
    assert mine.onsets(trials) == later
    assert Choices(labels="contact").onsets(trials) == trials.onsets("contact")
    for text in ("1,2,3", "a,b,c,d", "1,2,3,-4", ""):
        with pytest.raises(InputError, match=r"--samples: got .* needs four numbers"):
            _ = Choices(samples=text).sampling
    tests = benchmark_test_trials(trials.names)
    write_onsets({name: later[name] for name in tests}, tmp_path / "submission.csv")
    table = score_onsets(trials_folder, tmp_path / "submission.csv", Choices(rest_frames=20))
    assert table.columns[1].name == "submission.csv, 5 trials"
    rows = dict(table.rows)  # type: ignore[arg-type]
    assert str(rows["onset error [s]"]).startswith("0.100")


def test_scores_are_tables() -> None:
    scores = {"a": frame_scores_of(np.array([[[8, 2, 0], [0, 9, 1], [0, 0, 10]]] * 3))}
    table = accuracy_table(scores, {"a": Estimate(1.0)}, "3 trials.")
    shown = ["a", "0.900 [0.900, 0.900]", "1.000", "0.100", "0.967 [0.967, 0.967]"]
    assert texts(table) == [shown]
    head, row = to_csv(table).splitlines()
    assert head.startswith("classifier,by trial,by trial low,by trial high,by sample,by sample low,")
    assert all(0.0 <= float(cell) <= 1.0 for cell in row.split(",")[1:] if cell)
    assert to_mapping(table)["rows"][0][1] == pytest.approx({"value": 0.9, "low": 0.9, "high": 0.9})
    assert table.note.startswith("3 trials.")
    classes, confusion = frame_tables(scores)
    assert [row[:2] for row in classes.rows] == [("a", name) for name in CLASSES]
    assert confusion.rows[0] == ("a", "no_slip", 24, 6, 0)
    findings = findings_table([Finding(1.0, 0.0, 0.0, Onsets(0.5, None), 2e-3)], "live", "Latency without the tracker.")
    assert [row[1] for row in findings.rows] == ["0.5", Missing.NO_EVENT, "1", "2", "2", "2", "500"]


FEW = levels_of(lost="0,0.6", noise="", slower="2")


@pytest.mark.slow
def test_an_inquiry_has_a_table_and_a_figure_of_each(trials_folder, tmp_path):
    found = inquire(trials_folder, "displacement_threshold:rings", CHOICES, FEW)
    assert list(found.tables) == list(found.figures) == ["learning-curve", "importance", "robustness"]
    assert [row[0] for row in found.tables["learning-curve"].rows] == [4, 9, 19]
    assert [row[0] for row in found.tables["importance"].rows] == [0, 1, 2, 3, 4]
    assert [row[:2] for row in found.tables["robustness"].rows] == [("lost", 0.0), ("lost", 0.6), ("slower", 2.0)]
    write_inquiry(found, tmp_path)
    names = {"learning-curve", "importance", "robustness"}
    assert {path.name for path in tmp_path.iterdir()} == {f"{name}.{end}" for name in names for end in ("csv", "png")}
    with pytest.raises(InputError, match=r"--noise: got '0;1', needs numbers with commas; write --noise 0,0\.1,0\.2"):
        levels_of(noise="0;1")


@pytest.mark.slow
def test_what_is_assumed_has_tables_and_a_figure_and_rings_of_no_markers_have_none(trials_folder, tmp_path):
    more = {"conditions": ["indentation"], "each": ["indentation"], "output": tmp_path / "tables"}
    found = vary(trials_folder, ["time_threshold"], CHOICES, folds=2, **more)
    assert list(found.tables) == ["assumptions", "by-indentation"]
    rows = found.tables["assumptions"].rows
    assert len(rows) >= 11
    assert rows[0][0] == "as in the data set"
    assert [row[1] for row in rows[-2:]] == ["indentation: 3 mm", "indentation: 4 mm"]
    assert [path.name for path in tmp_path.iterdir()] == ["tables"]
    tmp_path = tmp_path / "tables"
    assert {path.name for path in tmp_path.iterdir()} == {"assumptions.csv", "assumptions.png", "by-indentation.csv"}
    assert "importance" not in inquire(trials_folder, "time_threshold", CHOICES, FEW).tables


def test_a_label_that_never_comes_leaves_nothing(trials_folder, tmp_path, monkeypatch):
    def told(*_given, output, **_more):
        parts_beside(output).write("fold", 1, {"rows": np.zeros(2)})
        raise InputError("trial slide-0000", "has no gross slip", "needs both onsets here")

    monkeypatch.setattr(inquiries, "sensitivity_of", told)
    with pytest.raises(InputError, match="has no gross slip"):
        vary(trials_folder, ["time_threshold"], CHOICES, output=tmp_path / "tables")
    assert list(tmp_path.iterdir()) == []


def test_labels_that_do_not_come_in_every_trial_are_no_assumption(trials, monkeypatch):
    asked = []

    def noted(_trials, assumptions, *_, **__):
        asked.extend(one.labels for one in assumptions)
        raise InputError("trials", "are not asked here", "needs nothing")

    monkeypatch.setattr(inquiries, "sensitivity_of", noted)
    for labels in (trials.labels(trials.names[0]), {"contact": Onsets(1.0, None)}):
        monkeypatch.setattr(TrialSet, "labels", lambda *_, found=labels: found)
        with pytest.raises(InputError, match="are not asked here"):
            vary(trials.folder, ["time_threshold"], CHOICES)
    assert asked.count("contact") == 1


CLOCK = CLASSIFIERS["time_threshold"]
AS_IT_IS = inquiries.Assumption("as it is", "", LabelSettings(rest_frames=20), MOTION)


def test_the_ring_that_tells_is_the_one_that_counts(samples, trials):
    draw = np.random.default_rng(0)
    inner = [name.count("/") == 2 and int(name.split("/")[-1]) in (1, 2, 3) for name in samples.names]
    values = np.where(inner, samples.classes[:, None], 0) + 0.1 * draw.normal(size=samples.values.shape)
    changed = dataclasses.replace(samples, values=values.astype(np.float32))
    run = Evaluation(trials, trials.onsets(), changed, MOTION)
    drops = inquiries.importance_by_ring(run, CLASSIFIERS["logistic"], trials.names[:4])
    assert list(drops) == [0, 1, 2, 3, 4]
    assert drops[1].value > drops[1].low > 0.3
    assert max(abs(drop.value) for ring, drop in drops.items() if ring != 1) < 0.05
    assert inquiries.importance_by_ring(run, CLOCK, trials.names[:4]) == {}


@pytest.mark.parametrize(("name", "amount"), [("lost", 0.2), ("noise", 0.5), ("slower", 3)])
def test_disturbed_tracks_are_tracks(name, amount, trials):
    tracks = trials.tracks(trials.names[0])
    before = tracks.copy(deep=True)
    disturbed = check_tracks(inquiries.disturb(tracks, name, amount))
    assert tracks.equals(before)
    assert not disturbed.equals(tracks)
    assert disturbed.equals(inquiries.disturb(tracks, name, amount))
    if name == "lost":
        assert np.isnan(disturbed["position"].values).mean() == pytest.approx(amount, abs=0.01)
    elif name == "noise":
        assert (disturbed - tracks)["position"].values.std() == pytest.approx(amount, rel=0.02)
    else:
        assert disturbed.sizes["time"] == 87


@pytest.mark.slow
def test_more_is_lost_with_more_disturbance(detector, trials):
    levels = [("lost", 0.0), ("lost", 0.6), ("noise", 20.0), ("slower", 2)]
    plain, lost, noisy, slower = inquiries.robustness_of(detector, trials, trials.onsets(), trials.names[8:12], levels)
    (accuracy, unusable), low = plain[2:], noisy[2].value
    assert unusable == 0.0
    assert lost[3] > 0.9
    assert low < accuracy.low <= accuracy.value <= accuracy.high
    assert slower[2].value == pytest.approx(accuracy.value, abs=0.1)
    for level in (("slower", 0.0), ("slower", 0.5), ("lost", 1.0), ("noise", -1.0)):
        with pytest.raises(InputError, match=f"{level[0]}: got"):
            inquiries.robustness_of(detector, trials, trials.onsets(), trials.names[:1], [level])


def ask(trials, *assumptions):
    return list(inquiries.sensitivity_of(trials, assumptions, [CLOCK], replace(SAMPLING, least=0.0), folds=3))


@pytest.fixture(scope="module")
def few(trials):
    """Return every second trial."""
    return replace(trials, names=trials.names[::2])


@pytest.mark.slow
def test_what_is_left_as_it_is_gives_the_evaluation_by_condition_and_higher_thresholds_make_labels_late(few):
    # Markers of analytic trials jump by tens of pixels.
    higher = replace(AS_IT_IS, labels=LabelSettings(30.0, 1.0, rest_frames=20))
    gross = replace(AS_IT_IS, labels=LabelSettings(2.0, 30.0, rest_frames=20))
    base, first, second = ask(few, AS_IT_IS, higher, gross)
    assert (first.incipient > base.incipient, first.gross) == (True, base.gross)
    assert (second.incipient, second.gross > base.gross) == (base.incipient, True)
    samples = samples_of(few, few.onsets(), FeatureSettings(CLOCK.sets, MOTION), SAMPLING)
    run = Evaluation(few, few.onsets(), samples, MOTION)
    folds = [run.fit(CLOCK, test).frames for test in grouped_folds(few.names, 3, 0)]
    assert np.array_equal(base.matrices["time_threshold"], run.matrices(folds))
    by_depth = base.of_condition(few, "indentation")
    assert list(by_depth) == ["0.003", "0.004"]
    values = [accuracies["time_threshold"].value for accuracies in by_depth.values()]
    assert min(values) <= base.accuracies["time_threshold"].value <= max(values)


@pytest.mark.parametrize(
    ("labels", "message"),
    [("nails", "has no labels 'nails'"), (LabelSettings(2.0, 1e5, rest_frames=20), "has no gross slip")],
)
def test_labels_that_are_not_there_are_told(few, labels, message):
    with pytest.raises(InputError, match=message):
        ask(few, replace(AS_IT_IS, labels=labels))


def test_each_likely_assumption_changes_one_thing():
    base, *others = inquiries.likely_assumptions(0.07e-3, motion=MOTION, stored=("contact",))
    assert base.labels == LabelSettings(rest_frames=20)
    assert len({entry.quantity for entry in others}) == 6
    for entry in others:
        changes = [entry.labels != base.labels, entry.motion != base.motion, entry.noise != base.noise]
        assert sum(changes) == 1, entry
    finer = others[0].labels
    assert finer.incipient / finer.gross == pytest.approx(2.0)
    assert finer.incipient == pytest.approx(2.0 * 0.045 / 0.07)


def test_trials_of_each_value_are_taken_alone(few):
    alone = inquiries.each_alone(few, ["indentation", "direction"], AS_IT_IS)
    assert len(alone) == 2 * 4
    assert alone[0].value == "indentation: 3 mm, direction: 0 rad"
    assert sorted(name for entry in alone for name in entry.trials) == list(few.names)
    assert inquiries.each_alone(few, [], AS_IT_IS) == ()
    with pytest.raises(InputError, match="has no condition 'stiffness'"):
        inquiries.each_alone(few, ["stiffness"], AS_IT_IS)
    (result,) = ask(few, inquiries.each_alone(few, ["indentation"], AS_IT_IS)[1])
    assert len(result.matrices["time_threshold"]) == 6


def test_what_is_stored_is_not_asked_again(few, tmp_path, monkeypatch):
    options = {"folds": 3, "output": tmp_path / "tables"}
    stored = partial(inquiries.sensitivity_of, few, [AS_IT_IS], [CLOCK], replace(SAMPLING, least=0.0), **options)
    (first,) = stored()
    monkeypatch.setattr(Evaluation, "fit", None)
    monkeypatch.setattr(inquiries, "_label", None)  # no trial is read again
    (second,) = stored()
    assert (first.incipient, first.gross) == (second.incipient, second.gross)
    assert np.array_equal(first.matrices["time_threshold"], second.matrices["time_threshold"])
