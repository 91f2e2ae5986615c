from __future__ import annotations

import numpy as np

from fingerslip.detect.evaluation.inquiries import Robustness
from fingerslip.detect.evaluation.scores import Estimate, event_scores_of, frame_scores_of, reliability_of
from fingerslip.detect.labels import Onsets
from fingerslip.detect.live import Finding, findings_table
from fingerslip.detect.session import (
    accuracy_table,
    calibration_table,
    confusion_table,
    curve_table,
    event_table,
    frame_table,
    importance_table,
    left_out_table,
    robustness_table,
    score_table,
)
from fingerslip.tables.table import Missing, to_csv, to_markdown

SCORES = frame_scores_of(np.array([[[8, 2, 0], [0, 9, 1], [0, 0, 10]]] * 3))


def test_accuracy_shows_what_leaks() -> None:
    table = accuracy_table({"a": SCORES}, {"a": Estimate(1.0)}, "3 trials.")
    assert table.rows[0] == ("a", "0.900 [0.900, 0.900]", "1.000", 1.0 - 0.9)
    assert table.note.startswith("3 trials.")


def test_every_class_has_a_row() -> None:
    assert [row[:2] for row in frame_table({"a": SCORES}).rows] == [
        ("a", "no_slip"),
        ("a", "incipient"),
        ("a", "gross"),
    ]
    assert confusion_table({"a": SCORES}).rows[0] == ("a", "no_slip", 24, 6, 0)


def test_events_have_a_column_for_each_classifier() -> None:
    scores = event_scores_of({"t": Onsets(1.2, None)}, {"t": Onsets(1.0, 2.0)}, {"t": 0.5}, frame=0.1)
    table = event_table({"a": scores, "b": scores}, "Note.")
    rows = {row[0]: row[1] for row in table.rows}
    assert rows["missed"] == "0"
    assert rows["onset error [s]"] == "0.200"
    assert rows["median delay [frames]"] == "2.000"
    assert rows["lead of 95 % of trials [s]"] is Missing.NOT_DEFINED
    assert rows["gross onset error [s]"] is Missing.NOT_DEFINED
    assert score_table(scores, "mine.csv").columns[1].name == "mine.csv, 1 trials"
    assert "n/a" in to_markdown(table)


def test_the_other_tables_have_what_they_are_given() -> None:
    reliability = reliability_of(np.array([[1.0, 0.0, 0.0]]), np.array([0], dtype=np.int8))
    assert calibration_table({"a": reliability}).rows == (("a", 0.0, 0.0),)
    assert curve_table({4: SCORES}).rows == ((4, "0.900 [0.900, 0.900]", "0.899 [0.899, 0.899]"),)
    drops = {0: Estimate(0.1, 0.0, 0.2), 1: Estimate(None)}
    assert importance_table(drops).rows == ((0, "0.100 [0.000, 0.200]"), (1, Missing.NOT_DEFINED))
    assert robustness_table([Robustness("lost", 0.1, Estimate(0.9), 0.0)]).rows == (("lost", 0.1, "0.900", 0.0),)
    assert to_csv(left_out_table("depth", [("a", "1", 4, Estimate(0.5))])).splitlines()[1] == "a,1,4,0.500"
    found = findings_table([Finding(1.0, 0.0, 0.0, Onsets(0.5, None), 2e-3)], "live", "Latency without the tracker.")
    assert [row[1] for row in found.rows] == ["0.5", Missing.NO_EVENT, "1", "2", "2", "500"]
