"""The summary for other programs: events, what was recorded, measures and uncertainties."""

from __future__ import annotations

import csv
import dataclasses
import io

import pytest

from fingerslip.report.tables.runs import summary_table
from fingerslip.results import RunResult
from fingerslip.slip import measures
from fingerslip.slip.measures import Measure
from fingerslip.tables.table import to_csv
from unit.report.tables.runs import EVENTS, RUNS, UNRECORDED

TIMES = [
    f"{event}_s{suffix}"
    for suffix in ("", "_displacement", "_acceleration")
    for event in ("incipient", "noticed", "three_quarter", "overall", "latency")
    if (event, suffix) != ("noticed", "_acceleration")
]


def rows_of(runs: tuple[RunResult, ...]) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(to_csv(summary_table(runs)))))


def test_columns_are_swept_paths_all_times_what_was_recorded_and_all_measures() -> None:
    first, second = rows_of(RUNS)
    keys = [measure.key for measure in measures.MEASURES]
    swept = ["contact.friction_coefficient", "fingertip.phalanx.variant"]
    assert list(first) == ["run", *swept, *TIMES, "readings_recorded", *keys]
    assert (first["incipient_s"], first["latency_s"], first["overall_s_acceleration"]) == ("1.5", "0.25", "1.71")
    assert (first["overall_s_displacement"], first["latency_s_acceleration"]) == ("", "")
    assert {second[name] for name in TIMES} == {""}


def test_an_empty_time_that_was_recorded_is_told_from_one_that_was_not() -> None:
    lacking, whole = rows_of((RunResult("a", {}, UNRECORDED), RunResult("b", {}, EVENTS)))
    assert (lacking["overall_s_acceleration"], lacking["readings_recorded"]) == ("", "slip displacement")
    assert whole["readings_recorded"] == "slip displacement acceleration"


def test_uncertainties_of_times_and_measures_have_columns_with_their_units() -> None:
    known = dataclasses.replace(
        RUNS[0],
        numbers={"normal_force_max_N": 0.4, "records": 3},
        uncertainty={"slip.overall": 0.0123, "normal_force_max_N": 0.01, "friction_force_ratio_end_of_slide": 0.2},
    )
    (row,) = rows_of((known,))
    assert (row["overall_s"], row["slip_overall_uncertainty_s"]) == ("1.75", "0.0123")
    assert (row["normal_force_max_N"], row["normal_force_max_uncertainty_N"]) == ("0.4", "0.01")
    assert row["friction_force_ratio_end_of_slide_uncertainty"] == "0.2"
    assert (row["records"], row["contact_area_max_m2"]) == ("3", "")


def test_an_added_measure_has_a_column(monkeypatch: pytest.MonkeyPatch) -> None:
    added = Measure("slides", "number of slides", lambda _: 1)
    monkeypatch.setattr(measures, "MEASURES", (*measures.MEASURES, added))
    (row,) = rows_of((dataclasses.replace(RUNS[0], numbers={"slides": 1}),))
    assert row["slides"] == "1"
