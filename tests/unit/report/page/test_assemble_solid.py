"""What a report shows of a run in space."""

from __future__ import annotations

import pytest
import xarray as xr

from fingerslip.report.page.assemble import StudyResults, study_report
from fingerslip.report.page.assemble_solid import is_solid, solid_pictures
from fingerslip.report.tables.events import RunEvents
from fingerslip.slip import Events, find_events
from fingerslip.verification.meshes import box
from unit.report.scenes import block_history


@pytest.fixture(scope="module")
def history() -> xr.Dataset:
    return block_history()


def test_a_section_is_not_solid(history: xr.Dataset) -> None:
    assert is_solid(history)
    assert not is_solid(block_history("Q4"))


def test_pictures_that_need_more_are_left_out_without_it(history: xr.Dataset) -> None:
    names = [picture.name for picture in solid_pictures(history, Events(), "r")]
    assert names == ["r-slip-frames", "r-stick-ratio", "r-surface-strain", "r-cut"]
    plain = history.drop_dims("snapshot_time").assign_coords(site_kind=("site", ["skin surface"]))
    names = [picture.name for picture in solid_pictures(plain, Events(), "r")]
    assert names == ["r-slip-frames", "r-stick-ratio", "r-surface-strain", "r-reference-nodes"]


def test_a_study_in_space_has_a_report(history: xr.Dataset) -> None:
    runs = tuple(RunEvents(name, {"mu": name}, find_events(history)) for name in ("a", "b"))
    mesh = box("T4", *([0.0, 1.0],) * 3)
    report = study_report(StudyResults("r", runs, {"a": history, "b": history}, {"a": mesh}))
    pictures = {picture.name for section in report.sections for picture in section.pictures}
    assert {"stick-ratio", "scene-a", "a-slip-frames", "b-cut", "a-forces"} <= pictures
    assert not {"slip-maps", "section-a", "a-slip-map"} & pictures
