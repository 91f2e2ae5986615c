"""The figure of the reference nodes."""

from __future__ import annotations

import pytest
import xarray as xr

from fingerslip.report.figures.reference_nodes import reference_kinds, reference_nodes_figure
from fingerslip.slip import Events, SlipEvents
from unit.report.scenes import block_history


@pytest.fixture(scope="module")
def history() -> xr.Dataset:
    return block_history()


def shown(figure: object) -> list[object]:
    return [axes for axes in figure.axes if axes.get_visible()]  # type: ignore[attr-defined]


def test_reference_nodes_have_a_row_for_each_kind(history: xr.Dataset) -> None:
    named = history.assign_coords(site_kind=("site", ["skin surface"]))
    figure = reference_nodes_figure(named, Events(SlipEvents(overall=0.09)))
    left, right = shown(figure)
    assert left.get_title("left") == "skin surface"
    assert right.get_ylabel() == "acceleration [m/s²]"
    plate = next(line for line in left.lines if line.get_linestyle() == ":" and line.get_color() == "#000000")
    assert plate.get_ydata()[-1] == pytest.approx(1.0)


def test_nodes_of_a_line_share_its_style_and_nodes_of_a_number_their_colour(history: xr.Dataset) -> None:
    nodes = history.isel(site=[0, 0, 0, 0]).assign_coords(
        site=["skin-h1", "skin-h2", "skin-v1", "skin-v2"], site_kind=("site", ["skin surface"] * 4)
    )
    figure = reference_nodes_figure(nodes)
    lines = shown(figure)[0].lines[:4]
    assert lines[0].get_linestyle() == lines[1].get_linestyle() != lines[2].get_linestyle()
    assert lines[0].get_color() == lines[2].get_color() != lines[1].get_color()
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names[:5] == ["h1", "h2", "v1", "v2", "plate"]


def test_the_jerk_at_the_start_of_the_slide_is_cut_and_said(history: xr.Dataset) -> None:
    slow = {name: 5.0 * history[name] for name in ("time", "phase_start", "phase_end")}
    longer = history.assign_coords({**slow, "site_kind": ("site", ["skin surface"])})
    size = xr.where((longer["time"] > 0.24) & (longer["time"] < 0.3), 100.0, 0.1)
    signals = (size * xr.ones_like(longer["acceleration"])).transpose(*longer["acceleration"].dims)
    _, axes = shown(reference_nodes_figure(longer.assign(acceleration=signals)))
    assert axes.get_title("right") == "start of the slide cut off: up to 100.0 m/s²"
    assert axes.get_ylim()[1] == pytest.approx(0.13)


def test_kinds_are_those_of_surfaces_each_once(history: xr.Dataset) -> None:
    kinds = ["tissue surface", "FA-I", "skin surface", "skin surface"]
    named = history.isel(site=[0, 0, 0, 0]).assign_coords(site_kind=("site", kinds))
    assert reference_kinds(named) == ["tissue surface", "skin surface"]
    assert reference_kinds(history.drop_dims("site")) == []
