"""Detectors of Cordova Bulens et al. (2023) beside ours."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.detect.evaluation.confusion import frame_scores_of
from fingerslip.detect.synthetic import synthetic_slides
from fingerslip.detect.trial_set import write_trials
from fingerslip.errors import DamagedError, ResultError
from fingerslip.files import write_json
from fingerslip.published import published
from fingerslip.validation import detection
from fingerslip.validation.detection import Detection, detection_rows, rows_of_detection, stored_detection
from fingerslip.validation.rows import rows_mapping

MATRICES = np.tile([[90, 10, 0], [0, 95, 5], [0, 5, 45]], (20, 1, 1))


def scores(matrices=MATRICES):
    return dict.fromkeys(("forest", "svm_linear", "svm_rbf"), frame_scores_of(matrices))


def test_every_published_number_and_statement_has_rows_in_both_splits():
    rows = rows_of_detection(Detection(scores(), scores()))
    numbers = published("bulens2023_detection-numbers").values
    assert len(rows) == 2 * (len(numbers) + 1 + 1)
    accuracy = rows[0]
    assert accuracy.quantity == "accuracy, forest, simulated slides, frames split 90 to 10"
    assert accuracy.ours == pytest.approx(230 / 250)
    assert accuracy.verdict == "misses"
    recall = next(row for row in rows if row.quantity.startswith("recall of no-slip"))
    assert recall.ours == pytest.approx(0.9)
    assert recall.published == 1.0


def test_slip_that_is_taken_for_rest_breaks_the_statement():
    statement = [row for row in rows_of_detection(Detection(scores(), scores())) if row.statement]
    assert [row.verdict for row in statement] == ["holds", "holds"]
    wrong = MATRICES.copy()
    wrong[0, 2, 0] = 1
    statement = [row for row in rows_of_detection(Detection(scores(wrong), scores())) if row.statement]
    assert [row.verdict for row in statement] == ["fails", "holds"]


def test_rows_are_computed_stored_and_read_back(tmp_path, monkeypatch):
    slides = synthetic_slides((3e-3, 4e-3), directions=2, repeats=5, travel=8e-3)
    trials = write_trials(slides, tmp_path / "slides", "Analytic")
    monkeypatch.setattr(detection, "simulate_trials", lambda *_, **__: trials)
    monkeypatch.setattr(detection, "detection_of", lambda *_: Detection(scores(), scores()))
    assert detection_rows(tmp_path, tmp_path) == ()
    rows = detection_rows(tmp_path, tmp_path, compute=True)
    assert detection_rows(tmp_path, tmp_path) == rows


def test_shipped_rows_are_read_where_none_are_stored(tmp_path):
    rows = rows_of_detection(Detection(scores(), scores()))
    (tmp_path / "reference").mkdir()
    write_json(tmp_path / "reference" / "detection.json", {"rows": rows_mapping(rows)})
    assert stored_detection(tmp_path) == rows


def test_damaged_files_say_what_makes_them_again(tmp_path):
    (tmp_path / "detection.json").write_text("{}")
    with pytest.raises(DamagedError, match="run fingerslip validate --detection"):
        stored_detection(tmp_path)
    write_json(tmp_path / "detection.json", {"rows": [{"quantity": "alone"}]})
    with pytest.raises(ResultError, match="holds no rows; run fingerslip validate --detection"):
        stored_detection(tmp_path)
