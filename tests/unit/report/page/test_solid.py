"""What a report shows of a run in 3D."""

from __future__ import annotations

import pytest
import xarray as xr

from fingerslip.report.page.assemble import study_report
from fingerslip.report.page.pictures import RunToDraw
from fingerslip.report.page.solid import SOLID
from fingerslip.results import result_of
from fingerslip.slip import Events
from fingerslip.verification.meshes import box
from unit.report.page.contents import content_of
from unit.report.scenes import block_history


@pytest.fixture(scope="module")
def history() -> xr.Dataset:
    return block_history()


def names(history: xr.Dataset) -> list[str]:
    return [picture.name for picture in SOLID.run(RunToDraw("r", "a title", history, Events()))]


def test_pictures_that_need_more_are_left_out_without_it(history: xr.Dataset) -> None:
    assert names(history) == ["r-slip-frames", "r-stick-ratio", "r-surface-strain", "r-cut"]
    plain = history.drop_dims("snapshot_time").assign_coords(site_kind=("site", ["skin surface"]))
    assert names(plain) == ["r-slip-frames", "r-stick-ratio", "r-surface-strain", "r-reference-nodes"]
    mesh = box("T4", *([0.0, 1.0],) * 3)
    assert SOLID.model(RunToDraw("r", "", plain, Events()), mesh) == []


@pytest.mark.slow
def test_a_study_in_space_has_a_report(history: xr.Dataset) -> None:
    runs = tuple(
        result_of(history, name, {"fingertip.solid.angle": angle})
        for name, angle in (("a", "-30 deg"), ("b", "30 deg"))
    )
    mesh = box("T4", *([0.0, 1.0],) * 3)
    report = study_report(content_of(runs, {"a": history, "b": history}, meshes={"a": mesh}))
    pictures = {picture.name for picture in report.pictures}
    assert {"stick-ratio", "slip-onset", "scene-a", "a-slip-frames", "b-cut", "a-forces"} <= pictures
    assert not {"slip-maps", "section-a", "a-slip-map"} & pictures
    assert [section.title for section in report.sections[-3:-1]] == ["angle -30 deg", "angle 30 deg"]
