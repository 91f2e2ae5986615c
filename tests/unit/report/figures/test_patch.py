"""Maps of the contact patch."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import xarray as xr

from fingerslip.report.figures.solid import slip_frames_figure, surface_strain_figure, touched_frame
from fingerslip.slip import Events, SlipEvents, contact_patch
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
    assert titles == ["0.050 s", "0.070 s, after incipient", "0.100 s, after overall"]


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
    assert f"{times[-4]:.3f} s, after incipient" in titles
    assert f"{times[-2]:.3f} s, after overall" in titles


def test_strains_and_rates_have_a_row_each_and_a_scale_about_zero(history: xr.Dataset) -> None:
    figure = surface_strain_figure(history)
    scales = [axes for axes in shown(figure) if "[" in axes.get_ylabel()]
    assert [axes.get_ylabel() for axes in scales] == ["strain along the slide [%]", "its rate [%/s]"]
    for axes in scales:
        low, high = axes.get_ylim()
        assert low == pytest.approx(-high)


def test_frames_need_no_events(history: xr.Dataset) -> None:
    assert dataclasses.is_dataclass(Events())
    assert len(shown(slip_frames_figure(history))) == 9


def test_the_frame_holds_what_ever_touches_or_all_where_nothing_does(history: xr.Dataset) -> None:
    patch = contact_patch(history)
    low, high = touched_frame(history, patch, patch.points)
    assert low == pytest.approx([-0.8, -10.8])
    assert high == pytest.approx([10.8, 0.8])
    apart = history.assign(contact_state=0 * history["contact_state"])
    corner = history["contact_state"].copy()
    corner[:] = 0
    corner[-1, patch.nodes[0]] = 1
    np.testing.assert_allclose(touched_frame(apart, patch, patch.points), (low, high))
    low, high = touched_frame(history.assign(contact_state=corner), patch, patch.points)
    np.testing.assert_allclose(0.5 * (low + high), 1e3 * patch.points[0], atol=1e-9)
