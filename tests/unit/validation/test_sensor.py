"""Statements on the ridged sensor: each from numbers that are known."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import pytest

from fingerslip.errors import InputError
from fingerslip.slip import find_events
from fingerslip.validation.sensor import SensorMeasures, measure_sensor, rows_of_sensor, sensor_rows
from unit.filmed import filmed_history

GOOD = (
    SensorMeasures(True, "2 mm", 1.0, 5, 1.2, 1e-3),
    SensorMeasures(True, "3 mm", 1.0, 3, 1.1, 2e-3),
    SensorMeasures(False, "2 mm", 0.5, 9, 1.0, 0.1e-3),
    SensorMeasures(False, "3 mm", 0.5, 9, 1.0, 0.4e-3),
)


def test_all_statements_hold_where_the_numbers_are_those_of_the_paper():
    rows = rows_of_sensor(GOOD)
    assert [row.verdict for row in rows] == ["holds"] * 4 + ["agrees"]
    assert [row.ours for row in rows] == pytest.approx([1.0, 3.0, 1.1, 0.2, 5.0])
    assert all(row.source.startswith("bulens2023") for row in rows)


@pytest.mark.parametrize(
    ("change", "row"), [({"before_centre": 0.9}, 0), ({"cycles": 1}, 1), ({"ahead": 0.9}, 2), ({"spread": 0.5e-3}, 3)]
)
def test_one_indentation_that_differs_makes_a_statement_fail(change, row):
    worse = (dataclasses.replace(GOOD[0], **change), *GOOD[1:])
    assert rows_of_sensor(worse)[row].verdict == ("fails" if row != 3 else "holds")
    if row == 3:
        hidden = (*GOOD[:3], dataclasses.replace(GOOD[3], spread=1.5e-3))
        assert rows_of_sensor(hidden)[row].verdict == "fails"


def test_an_event_that_did_not_happen_leaves_no_verdict():
    none = tuple(dataclasses.replace(one, spread=None, ahead=None, before_centre=None, cycles=None) for one in GOOD)
    rows = rows_of_sensor(none, "large strain")
    assert {row.verdict for row in rows} == {"not found"}
    assert {row.basis for row in rows} == {"large strain"}


def test_a_run_is_measured_from_its_history():
    history = filmed_history()
    swept = {"tactip.skin.ridges.enabled": True, "programme.0.press.depth": "2 mm"}
    measured = measure_sensor(SimpleNamespace(events=find_events(history), swept=swept), history)
    assert (measured.ridged, measured.depth, measured.before_centre) == (True, "2 mm", 1.0)
    assert measured.ahead == pytest.approx(1.0)
    assert measured.spread == pytest.approx(0.0)


def test_without_the_study_the_error_names_it(tmp_path):
    with pytest.raises(InputError, match=r"ridged_vs_smooth.yaml: is not there, validate needs the study"):
        sensor_rows(tmp_path, tmp_path)
