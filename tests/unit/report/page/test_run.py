"""The section of one run."""

from __future__ import annotations

import pytest

from fingerslip.report.page.plane import PLANE
from fingerslip.report.page.run import has_receptors, picture_set, run_section
from fingerslip.report.page.solid import SOLID
from fingerslip.results import result_of
from fingerslip.slip import PeakSettings, measures
from fingerslip.slip.measures import Measure
from unit.report.scenes import block_history
from unit.synthetic import Process, make

HISTORY = make(Process())


def test_pictures_are_those_of_the_dimension() -> None:
    assert picture_set(HISTORY) is PLANE
    assert picture_set(block_history()) is SOLID


def test_receptors_are_looked_for_by_kind() -> None:
    assert has_receptors(HISTORY)
    assert not has_receptors(HISTORY.drop_dims("site"))
    others = HISTORY.assign_coords(site_kind=("site", ["marker"] * HISTORY.sizes["site"]))
    assert not has_receptors(others)


def test_section_has_events_measures_and_pictures_under_the_name_of_the_run() -> None:
    section = run_section(result_of(HISTORY, "a", {}), HISTORY, "A title", PeakSettings())
    assert (section.title, section.folded) == ("A title", True)
    assert [table.title for table in section.tables] == ["Slip events", "Measures", "Acceleration peaks"]
    assert [picture.name for picture in section.pictures] == [
        "a-slip-map", "a-displacement", "a-forces", "a-acceleration", "a-strain-energy-density", "a-energy",
    ]  # fmt: skip
    titles = [picture.figure.get_suptitle() for picture in section.pictures]
    assert all(title.endswith(": A title") for title in titles[1:])


def test_an_added_measure_is_in_the_section(monkeypatch: pytest.MonkeyPatch) -> None:
    added = Measure("slides", "number of slides", lambda _: 1)
    monkeypatch.setattr(measures, "MEASURES", (*measures.MEASURES, added))
    table = run_section(result_of(HISTORY, "a", {}), HISTORY, "t", PeakSettings()).tables[1]
    assert ("number of slides", "", 1) in table.rows
