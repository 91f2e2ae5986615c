"""Figures of the contact patch."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import xarray as xr

from fingerslip.report.figures.patch import (
    reference_nodes_figure,
    slip_frames_figure,
    stick_ratio_figure,
    surface_strain_figure,
)
from fingerslip.slip import Events, SlipEvents
from unit.report.scenes import block_history


@pytest.fixture(scope="module")
def history() -> xr.Dataset:
    return block_history()


def shown(figure: object) -> list[object]:
    return [axes for axes in figure.axes if axes.get_visible()]  # type: ignore[attr-defined]


def test_frames_show_the_moments_and_name_what_happened(history: xr.Dataset) -> None:
    events = Events(SlipEvents(incipient=0.055, overall=0.085))
    figure = slip_frames_figure(history, events, times=[0.05, 0.07, 0.1])
    titles = [axes.get_title("left") for axes in shown(figure)]
    assert titles == ["0.050 s", "0.070 s (incipient)", "0.100 s (overall)"]


def test_a_frame_has_every_triangle_in_the_colour_of_its_state(history: xr.Dataset) -> None:
    axes = shown(slip_frames_figure(history, times=[0.0]))[0]
    (triangles,) = axes.collections
    assert len(triangles.get_paths()) == 32
    assert len({tuple(colour) for colour in triangles.get_facecolor()}) == 1  # all open before the press


def test_without_times_the_frames_end_after_overall_slip(history: xr.Dataset) -> None:
    titles = [axes.get_title("left") for axes in shown(slip_frames_figure(history, Events(SlipEvents(overall=0.07))))]
    assert len(titles) == 9
    assert titles[0].startswith("0.050 s")
    assert titles[-1].startswith("0.070 s")


def test_without_times_a_frame_shows_the_first_record_after_each_event(history: xr.Dataset) -> None:
    times = history["time"].values
    incipient, overall = times[-4] - 1e-6, times[-2] - 1e-6
    figure = slip_frames_figure(history, Events(SlipEvents(incipient=incipient, overall=overall)))
    titles = [axes.get_title("left") for axes in shown(figure)]
    assert f"{times[-4]:.3f} s (incipient)" in titles
    assert f"{times[-2]:.3f} s (overall)" in titles


def test_strains_and_rates_have_a_row_each_and_a_scale_about_zero(history: xr.Dataset) -> None:
    figure = surface_strain_figure(history)
    scales = [axes for axes in shown(figure) if "[" in axes.get_ylabel()]
    assert [axes.get_ylabel() for axes in scales] == ["strain along the slide [%]", "its rate [%/s]"]
    for axes in scales:
        low, high = axes.get_ylim()
        assert low == pytest.approx(-high)


def test_stick_ratio_is_drawn_over_the_slide(history: xr.Dataset) -> None:
    (axes,) = shown(stick_ratio_figure({"block": history}))
    (line,) = axes.lines
    assert line.get_label() == "block"
    assert line.get_xdata().size == 6  # records of the slide, its start included
    assert np.nanmax(line.get_xdata()) <= 0.5 * (1.0 + 1e-9)


def test_reference_nodes_have_a_row_for_each_kind(history: xr.Dataset) -> None:
    named = history.assign_coords(site_kind=("site", ["skin surface"]))
    figure = reference_nodes_figure(named, Events(SlipEvents(overall=0.09)))
    left, right = shown(figure)
    assert left.get_title("left") == "skin surface"
    assert right.get_ylabel() == "acceleration [m/s²]"
    plate = next(line for line in left.lines if line.get_linestyle() == ":" and line.get_color() == "#000000")
    assert plate.get_ydata()[-1] == pytest.approx(1.0)


def test_nodes_of_a_line_share_its_style_and_places_their_colour(history: xr.Dataset) -> None:
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


def test_frames_need_no_events(history: xr.Dataset) -> None:
    assert dataclasses.is_dataclass(Events())
    assert len(shown(slip_frames_figure(history))) == 9
