"""The contact in 3D: frames, strains, onsets, stick ratio, reference nodes."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import xarray as xr

from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.report.figures.solid import (
    _touched_frame,
    reference_kinds,
    reference_nodes_figure,
    slip_frames_figure,
    slip_onset_figure,
    stick_ratio_figure,
    surface_strain_figure,
)
from fingerslip.slip import Events, SlipEvents, contact_patch, slide_window
from unit.report.scenes import block_history


@pytest.fixture(scope="module")
def history() -> xr.Dataset:
    return block_history().load()


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
    low, high = _touched_frame(history, patch, patch.points)
    assert low == pytest.approx([-0.8, -10.8])
    assert high == pytest.approx([10.8, 0.8])
    apart = history.assign(contact_state=0 * history["contact_state"])
    corner = history["contact_state"].copy()
    corner[:] = 0
    corner[-1, patch.nodes[0]] = 1
    np.testing.assert_allclose(_touched_frame(apart, patch, patch.points), (low, high))
    low, high = _touched_frame(history.assign(contact_state=corner), patch, patch.points)
    np.testing.assert_allclose(0.5 * (low + high), 1e3 * patch.points[0], atol=1e-9)


def with_states(history: xr.Dataset, before: int, after: int, switch: float) -> xr.Dataset:
    """Return a history whose whole contact changes its state once."""
    states = np.where(history["time"].values[:, None] < switch, before, after)
    kept = history.copy()
    kept["contact_state"] = history["contact_state"].copy(data=np.broadcast_to(states, history["contact_state"].shape))
    return kept


def triangles(figure: object) -> list[np.ndarray]:
    """Return the colours of the triangles, panel by panel."""
    return [axes.collections[0].get_facecolor() for axes in figure.axes if axes.collections and axes.get_title("left")]  # type: ignore[attr-defined]


def test_colours_count_from_the_start_of_the_slide_and_share_one_scale(history: xr.Dataset) -> None:
    window = slide_window(history)
    assert window is not None
    early, late = window.start + 0.02, window.end - 0.01
    runs = {"early": with_states(history, STICK, SLIP, early), "late": with_states(history, STICK, SLIP, late)}
    figure = slip_onset_figure(runs)
    first, second = triangles(figure)
    assert len({tuple(colour) for colour in first}) == len({tuple(colour) for colour in second}) == 1
    assert not np.array_equal(first[0], second[0])
    (scale,) = [axes for axes in figure.axes if "time into" in axes.get_ylabel()]
    assert scale.get_ylim()[1] == pytest.approx(late - window.start, abs=0.011)  # a record


def test_what_sticks_to_the_end_is_dark_and_what_never_touches_is_not_drawn(history: xr.Dataset) -> None:
    stuck, open_ = (with_states(history, state, state, 0.0) for state in (STICK, OPEN))
    figure = slip_onset_figure({"stuck": stuck, "open": open_})
    drawn = triangles(figure)
    assert np.allclose(drawn[0], drawn[0][0])
    assert drawn[0][0][:3].max() < 0.25
    assert len(drawn[1]) == 0


def test_panels_share_the_axes_of_the_plate_and_arrows_tell_the_directions_apart(history: xr.Dataset) -> None:
    turned = history.copy()
    turned["counterface_displacement"] = -history["counterface_displacement"]
    figure = slip_onset_figure({"there": history, "back": turned})
    panels = [axes for axes in figure.axes if axes.get_title("left")]
    (there,), (back,) = ([text for text in axes.texts if hasattr(text, "arrow_patch")] for axes in panels)
    direction = np.subtract(there.xy, there.xyann)
    np.testing.assert_allclose(direction, -np.subtract(back.xy, back.xyann), atol=1e-12)
    assert panels[0].get_xlim() == panels[1].get_xlim()


def test_stick_ratio_is_drawn_over_the_slide(history: xr.Dataset) -> None:
    (axes,) = shown(stick_ratio_figure({"block": history}))
    (line,) = axes.lines
    assert line.get_label() == "block"
    assert line.get_xdata().size == 6  # records of the slide, its start included
    assert np.nanmax(line.get_xdata()) <= 0.5 * (1.0 + 1e-9)


def test_several_runs_have_a_legend(history: xr.Dataset) -> None:
    (axes,) = shown(stick_ratio_figure({"one": history, "other": history}))
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["one", "other"]


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
