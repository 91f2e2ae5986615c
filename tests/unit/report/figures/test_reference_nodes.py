"""The figure of the reference nodes."""

from __future__ import annotations

import pytest
import xarray as xr

from fingerslip.report.figures.solid import reference_kinds, reference_nodes_figure
from fingerslip.slip import Events, SlipEvents
from unit.report.scenes import block_history


@pytest.fixture(scope="module")
def history() -> xr.Dataset:
    return block_history()


def shown(figure: object) -> list[object]:
    return [axes for axes in figure.axes if axes.get_visible()]  # type: ignore[attr-defined]


def test_every_node_has_a_panel_of_its_own_with_the_plate(history: xr.Dataset) -> None:
    nodes = history.isel(site=[0, 0, 0]).assign_coords(
        site=["skin-h1", "skin-h2", "tissue-v1"],
        site_kind=("site", ["skin surface", "skin surface", "tissue surface"]),
    )
    figure = reference_nodes_figure(nodes, Events(SlipEvents(overall=0.09)))
    titles = [axes.get_title("left") for axes in shown(figure) if axes.get_title("left")]
    assert titles == ["h1, skin", "h2, skin", "v1, tissue"]
    left = shown(figure)[0]
    plate = next(line for line in left.lines if line.get_linestyle() == ":" and line.get_color() == "#000000")
    assert plate.get_ydata()[-1] == pytest.approx(1.0)
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names[:2] == ["displacement", "plate"]
    assert "overall" in names
    assert "incipient" not in names, "it did not happen"


def test_the_jerk_at_the_start_of_the_slide_is_left_out(history: xr.Dataset) -> None:
    slow = {name: 5.0 * history[name] for name in ("time", "phase_start", "phase_end")}
    longer = history.assign_coords({**slow, "site_kind": ("site", ["skin surface"])})
    size = xr.where((longer["time"] > 0.24) & (longer["time"] < 0.3), 100.0, 0.1)
    signals = (size * xr.ones_like(longer["acceleration"])).transpose(*longer["acceleration"].dims)
    axes = shown(reference_nodes_figure(longer.assign(acceleration=signals)))[-1]
    assert axes.get_ylabel() == "acceleration [m/s²]"
    assert axes.get_ylim()[1] == pytest.approx(0.13)


def test_kinds_are_those_of_surfaces_each_once(history: xr.Dataset) -> None:
    kinds = ["tissue surface", "FA-I", "skin surface", "skin surface"]
    named = history.isel(site=[0, 0, 0, 0]).assign_coords(site_kind=("site", kinds))
    assert reference_kinds(named) == ["tissue surface", "skin surface"]
    assert reference_kinds(history.drop_dims("site")) == []
