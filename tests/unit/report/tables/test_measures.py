"""Tables of measures."""

from __future__ import annotations

import dataclasses

import pytest

from fingerslip.report.tables.runs import measures_table
from fingerslip.slip import measures
from fingerslip.slip.measures import Measure
from fingerslip.tables.table import texts
from fingerslip.units import Unit
from unit.report.tables.runs import RUNS, UNRECORDED

NUMBERS = {"normal_force_max_N": 0.159664, "contact_area_max_m2": 1.351e-5, "records": 601, "edge_distance_min_m": None}


def shown(run: object) -> dict[str, list[str]]:
    return {row[0]: row[1:] for row in texts(measures_table([run], ["value"]))}  # type: ignore[list-item]


def test_measures_are_shown_in_readable_units_with_four_digits() -> None:
    rows = shown(dataclasses.replace(RUNS[0], numbers=NUMBERS))
    assert rows["largest normal force"] == ["N", "0.1597"]
    assert rows["largest contact area"] == ["mm²", "13.51"]
    assert rows["records"] == ["", "601"]
    assert set(rows) == {measure.label for measure in measures.MEASURES}


def test_uncertainty_stands_beside_its_measure_in_the_same_unit() -> None:
    known = dataclasses.replace(RUNS[0], numbers=NUMBERS, uncertainty={"contact_area_max_m2": 1.18e-7})
    assert shown(known)["largest contact area"] == ["mm²", "13.51 ± 0.12"]


def test_pure_numbers_show_their_uncertainty_too() -> None:
    numbers = {"friction_force_ratio_end_of_slide": 0.6, "records": 601}
    known = dataclasses.replace(RUNS[0], numbers=numbers, uncertainty={"friction_force_ratio_end_of_slide": 0.0123})
    assert shown(known)["friction over normal force at the end of the slide"] == ["", "0.6 ± 0.012"]
    assert shown(known)["records"] == ["", "601"]


def test_a_missing_number_says_why() -> None:
    numbers = {**NUMBERS, "overall_peak_height_m_per_s2": None}
    recorded, lacking = (
        dataclasses.replace(RUNS[0], numbers=numbers, events=one) for one in (RUNS[0].events, UNRECORDED)
    )
    name = "height of the acceleration peak of overall slip"
    assert (shown(recorded)[name][1], shown(lacking)[name][1]) == ("none", "n/r")
    assert shown(recorded)["smallest distance from the contact to a free edge"][1] == "n/a"
    assert shown(recorded)["largest penetration"][1] == "n/r", "of a run that is older than the measure"


def test_an_added_measure_has_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    added = Measure("rebound", "largest rebound", lambda _: 2e-3, Unit("m", "mm"))
    monkeypatch.setattr(measures, "MEASURES", (*measures.MEASURES, added))
    assert shown(dataclasses.replace(RUNS[0], numbers={"rebound_m": 2e-3}))["largest rebound"] == ["mm", "2"]
