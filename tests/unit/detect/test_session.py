"""What the command line asks for, and evaluations as tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fingerslip.detect import page
from fingerslip.detect.evaluation.scores import (
    Estimate,
    accuracy_table,
    event_scores_of,
    event_table,
    frame_scores_of,
    frame_tables,
    output_tables,
)
from fingerslip.detect.labels import CLASSES, Onsets, write_onsets
from fingerslip.detect.live import Finding
from fingerslip.detect.model_file import read_detector
from fingerslip.detect.residual import findings_table
from fingerslip.detect.samples import benchmark_test_trials
from fingerslip.detect.session import Choices, evaluate_classifiers, run_detector, score_onsets, train_detector
from fingerslip.detect.trials import TrialSet
from fingerslip.errors import InputError
from fingerslip.tables.table import Missing, Table, texts, to_csv, to_mapping, to_markdown
from fingerslip.vision.tracks import write_tracks_csv

CHOICES = Choices(rest_frames=20, window=5, samples="20,6,2,20")


@pytest.fixture(scope="module")
def stored(trials_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("session") / "detector"
    text = train_detector(trials_folder, folder, "logistic:speed+rings", CHOICES)
    assert "logistic:speed+rings, 19 trials, 912 samples, no guarantee" in text
    return folder


@pytest.mark.slow
def test_a_detector_keeps_its_features_and_runs_on_both_files(stored, trials, tmp_path, monkeypatch) -> None:
    name, table = benchmark_test_trials(trials.names)[0], tmp_path / "tracks.csv"
    write_tracks_csv(trials.tracks(name), table)

    def run(detector: str, path: Path) -> list[Table]:
        return run_detector(path, detector, {}, None, tmp_path / "page")[0]

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
        return "\n".join(run_detector(tmp_path / "tracks.csv", str(stored), {}, None, tmp_path / "page")[1])

    for factor in (2.0, 0.5):
        other = tracks.assign_coords(time=tracks["time"].values * factor)
        with pytest.raises(InputError, match=rf"has {30 / factor:g} frames/s, the detector learned from 30 frames/s"):
            lines(other)
    assert "warning" not in lines(tracks.assign_coords(time=tracks["time"].values * 1.05))
    assert "and the detector takes 20 frames for rest: its times" in lines(tracks.isel(time=slice(12, None)))


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


def test_events_have_a_column_for_each_classifier() -> None:
    scores = event_scores_of({"t": Onsets(1.2, None)}, {"t": Onsets(1.0, 2.0)}, {"t": 0.5}, frame=0.1)
    table = event_table({"a": scores, "b": scores}, "Note.")
    rows = {row[0]: row[1] for row in table.rows}
    assert rows["missed"] == "0"
    assert str(rows["onset error [s]"]) == "0.200"
    assert rows["median delay [frames]"] == "2.000"
    assert rows["lead of 95 % of trials [s]"] is Missing.NOT_DEFINED
    assert rows["gross onset error [s]"] is Missing.NOT_DEFINED
    assert "n/a" in to_markdown(table)
