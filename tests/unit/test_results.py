"""Results of runs: what a history gives, and the numbers whose convergence is studied."""

from __future__ import annotations

import dataclasses

import pytest

from fingerslip import results
from fingerslip.results import quantities, result_of
from fingerslip.slip import Events, SlipEvents, acceleration_peaks, find_events, measures, read_measures
from fingerslip.slip.measures import Measure
from fingerslip.units import Unit
from unit.whole_result import MADE, SWEPT, WHOLE


def test_a_history_gives_events_peaks_numbers_and_edges() -> None:
    found = result_of(MADE, "run", SWEPT)
    assert found.events == find_events(MADE)
    assert found.peaks == acceleration_peaks(MADE).peaks
    assert found.numbers == read_measures(MADE)
    assert found.edge is None
    assert (found.name, found.swept) == ("run", SWEPT)


def test_quantities_are_the_times_of_all_readings_and_the_measures_of_mechanics() -> None:
    found = quantities(WHOLE)
    assert found["slip.latency"].label == "latency (accumulated slip)"
    assert found["displacement.three_quarter"].label == "three-quarter slip (displacement)"
    assert (found["slip.overall"].unit, found["slip.overall"].value) == ("s", WHOLE.events.overall)
    assert "acceleration.noticed" not in found, "no peak belongs to it"
    area = found["contact_area_max_m2"]
    assert (area.label, area.unit, area.value) == ("largest contact area", "m^2", WHOLE.numbers["contact_area_max_m2"])
    assert found["peaks_before_overall"].value == 2.0
    assert not {"records", "contact_iterations_max", "penetration_max_m"} & set(found)


def test_readings_that_were_not_recorded_have_no_quantities() -> None:
    silent = dataclasses.replace(WHOLE, events=Events(acceleration=SlipEvents(recorded=False)))
    assert not [key for key in quantities(silent) if key.startswith(("acceleration", "overall_peak", "peaks"))]
    assert quantities(silent)["slip.overall"].value is None


def test_an_added_measure_is_among_the_numbers_and_the_quantities(monkeypatch: pytest.MonkeyPatch) -> None:
    added = Measure("rebound", "largest rebound", lambda _: 2e-3, Unit("m", "mm"))
    monkeypatch.setattr(measures, "MEASURES", (*measures.MEASURES, added))
    found = result_of(MADE, "run", {})
    assert found.numbers["rebound_m"] == 2e-3
    assert quantities(found)["rebound_m"] == results.Quantity("largest rebound", "m", 2e-3)
    assert quantities(WHOLE)["rebound_m"].value is None, "of a run that is older than the measure"
