"""Detectors of Cordova Bulens et al. (2023) beside ours."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from fingerslip.detect.evaluation.scores import frame_scores_of
from fingerslip.detect.features import MotionSettings
from fingerslip.detect.samples import Sampling
from fingerslip.detect.synthetic import SyntheticSensor, synthetic_slides
from fingerslip.detect.trials import write_trials
from fingerslip.published import published_set
from fingerslip.validation import sensor as detection
from fingerslip.validation.evidence import Work
from fingerslip.validation.sensor import Detection, detection_rows, rows_of_detection
from places import ROOT

NAMES = ("forest", "svm_linear", "svm_rbf", "boosting", "logistic")
# A row for each number, with two support vector machines for one; a statement; two classifiers that are not judged.
SPLIT = len(published_set("bulens2023_detection-numbers").values) + 1 + 1 + 2
MATRICES = np.tile([[90, 10, 0], [0, 95, 5], [0, 5, 45]], (20, 1, 1))


@functools.cache
def right():
    return scores(MATRICES)


def scores(matrices):
    return dict.fromkeys(NAMES, frame_scores_of(matrices))


def test_every_published_number_and_statement_has_rows_in_both_splits():
    rows = rows_of_detection(Detection(right(), right()))
    assert len(rows) == 2 * SPLIT
    accuracy = rows[0]
    assert accuracy.quantity == "accuracy, forest, simulated slides, frames split 90 to 10"
    assert accuracy.ours == pytest.approx(230 / 250)
    assert accuracy.verdict == "misses"
    recall = next(row for row in rows if row.quantity.startswith("recall of no-slip"))
    assert recall.ours == pytest.approx(0.9)
    assert recall.published == 1.0


def test_slip_that_is_taken_for_rest_breaks_the_statement():
    statement = [row for row in rows_of_detection(Detection(right(), right())) if row.statement]
    assert [row.verdict for row in statement] == ["holds", "holds"]
    wrong = MATRICES.copy()
    wrong[0, 2, 0] = 1
    statement = [row for row in rows_of_detection(Detection(scores(wrong), right())) if row.statement]
    assert [row.verdict for row in statement] == ["fails", "holds"]


def test_rows_are_computed_stored_and_read_back(tmp_path, monkeypatch):
    slides = synthetic_slides((3e-3, 4e-3), directions=2, repeats=5, travel=8e-3)
    trials = write_trials(slides, tmp_path / "slides", "Analytic")
    monkeypatch.setattr("fingerslip.study.trials.simulate.simulate_trials", lambda *_, **__: trials)
    monkeypatch.setattr("fingerslip.detect.samples.Sampling", lambda: Sampling(least=0.0))
    monkeypatch.setattr("fingerslip.detect.features.MotionSettings", lambda: MotionSettings(20, 5))

    def found(begun):
        begun.parts.write("forest", 1, {"rows": np.arange(3)})
        return Detection(right(), right())

    monkeypatch.setattr(detection, "detection_of", found)
    work = Work(ROOT / "studies", tmp_path)
    assert detection_rows(work).rows == ()
    made = detection_rows(work, compute=True)
    assert detection_rows(work).rows == made.rows
    assert {path.name for path in tmp_path.iterdir()} == {"slides", "detection.json"}


def test_every_classifier_has_a_row_for_each_condition_that_is_left_out():
    rows = rows_of_detection(Detection(right(), right(), {"a direction not seen": right()}))
    own = [row for row in rows if row.quantity.endswith("a direction not seen")]
    assert [row.quantity.split(",")[1].split()[0] for row in own] == ["forest", "boosting", "logistic", *NAMES[1:3]]
    assert [row.published for row in own] == [0.9746] * 3 + [0.843] * 2
    # The paper has neither boosting nor logistic regression: they are not judged by its forest.
    assert [row.verdict for row in own] == ["misses", "not comparable", "not comparable", "misses", "misses"]


@pytest.mark.slow
def test_every_condition_of_the_paper_is_left_out_once(tmp_path, monkeypatch):
    sensor = SyntheticSensor(frame_rate=67.0, rest_frames=100)
    slides = synthetic_slides((3e-3, 4e-3), directions=2, repeats=5, sensor=sensor, travel=14e-3)
    monkeypatch.setattr("fingerslip.detect.samples.Sampling", lambda: Sampling(least=0.0))
    trials = write_trials(slides, tmp_path / "slides", "Analytic")
    found = detection.detection_of(detection.begun_detection(trials, 1))
    assert len(found.left_out) == 3
    for by_name in found.left_out.values():
        assert {name: one.matrix.sum() for name, one in by_name.items()} == dict.fromkeys(
            NAMES, found.by_trial["forest"].matrix.sum()
        )


def test_shipped_rows_are_those_of_the_study_and_have_every_split():
    stored = detection_rows(Work(ROOT / "studies", ROOT / "results"))
    assert "the studies are the same" in stored.origin
    assert len(stored.rows) == 3 * len(NAMES) + 2 * SPLIT
