"""The deformed body, in 2D and 3D, and the contact in 3D: frames, strains, onsets, stick ratio, reference nodes."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import PolyCollection

from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.errors import ResultError
from fingerslip.report.figures.deformed import (
    crop,
    cut_frames_figure,
    deformed_figure,
    frame_times,
    has_frames,
)
from fingerslip.report.figures.solid import (
    _touched_frame,
    reference_kinds,
    reference_nodes_figure,
    slip_frames_figure,
    slip_onset_figure,
    stick_ratio_figure,
    surface_strain_figure,
)
from fingerslip.report.scene.options import SceneOptions
from fingerslip.slip import Events, SlipEvents, contact_patch, slide_window
from unit.report.figures.made import panels, titles, words
from unit.report.scenes import block_history
from unit.synthetic import Process, make


@pytest.fixture(scope="module")
def flat() -> xr.Dataset:
    return block_history("Q4")


@pytest.fixture(scope="module")
def history() -> xr.Dataset:
    return block_history().load()


def test_panels_of_a_section_are_the_start_of_the_slide_and_the_events(flat: xr.Dataset) -> None:
    figure = deformed_figure(flat, Events(slip=SlipEvents(incipient=0.06, noticed=0.07, overall=0.1)))
    assert titles(figure) == ["0.050 s, start of slide, 10 ms before incipient", "0.100 s, overall"]
    drawn = [axes for axes in panels(figure) if axes.get_title(loc="left")]
    cells = next(item for item in drawn[-1].collections if isinstance(item, PolyCollection))
    assert len(cells.get_paths()) == flat.sizes["cell"]


@pytest.mark.parametrize("scalar", ["region", "displacement", "strain_energy_density"])
def test_other_fields_and_times_of_a_section_can_be_chosen(flat: xr.Dataset, scalar: str) -> None:
    figure = deformed_figure(flat, options=SceneOptions(scalar=scalar), times=[0.0, 0.1])
    assert len(titles(figure)) == 2
    corners = np.array([panels(figure)[0].get_xlim(), panels(figure)[0].get_ylim()])
    assert (corners[:, 1] - corners[:, 0] > 10.0).all(), "the whole body is framed, in millimetres"


def test_a_history_without_snapshots_is_refused(history: xr.Dataset) -> None:
    assert not has_frames(make(Process()))
    assert not has_frames(history)
    with pytest.raises(ResultError, match="no snapshots of the whole mesh; write record"):
        deformed_figure(make(Process()))


def test_views_have_a_panel_for_each_time_and_one_bar_or_a_legend(history: xr.Dataset) -> None:
    figure = deformed_figure(history, times=[0.0, 0.1])
    assert titles(figure) == ["0.000 s", "0.100 s"]
    assert sum(axes.get_ylabel() == "von Mises stress [kPa]" for axes in figure.axes) == 1
    options = SceneOptions(scalar="region", contact=True, camera="below", written=False)
    figure = deformed_figure(history, options=options, times=[0.1])
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["skin", "tissue", "stick", "slip"]
    times = frame_times(history, Events(slip=SlipEvents(three_quarter=0.08, overall=0.09)), ("incipient", "overall"))
    assert list(times.values()) == ["start of slide", "overall"]


@pytest.mark.slow
def test_every_snapshot_is_cut_once_and_none_after_overall_slip(history: xr.Dataset) -> None:
    assert history["snapshot_time"].values == pytest.approx([0.0, 0.05, 0.1])
    assert titles(cut_frames_figure(history)) == ["0.050 s", "0.100 s"]
    assert titles(cut_frames_figure(history, Events(SlipEvents(overall=0.06)))) == ["0.050 s"]


def test_pictures_of_cuts_differ_as_the_stress_does_and_share_one_bar(history: xr.Dataset) -> None:
    figure = cut_frames_figure(history)
    first, second = (axes.images[0].get_array() for axes in figure.axes if axes.images)
    assert first.shape == second.shape
    assert np.abs(first.astype(int) - second.astype(int)).max() > 50
    assert [axes.get_ylabel() for axes in figure.axes if axes.get_ylabel()] == ["von Mises stress [kPa]"]


def test_white_margins_go_at_the_same_place_of_all_pictures() -> None:
    first, second = np.full((2, 6, 8, 3), 255, dtype=np.uint8)
    first[1, 2], second[3, 5] = 0, 0
    for picture, black in zip(crop([first, second]), [(0, 0), (2, 3)], strict=True):
        assert picture.shape == (3, 4, 3)
        assert np.argwhere(picture[..., 0] == 0).tolist() == [list(black)]
    blank = np.full((3, 3, 3), 255, dtype=np.uint8)
    assert crop([blank])[0].shape == blank.shape


def test_frames_show_the_moments_and_name_what_happened(history: xr.Dataset) -> None:
    events = Events(SlipEvents(incipient=0.055, overall=0.085))
    figure = slip_frames_figure(history, events, times=[0.05, 0.07, 0.1])
    assert titles(figure) == ["0.050 s", "0.070 s, after incipient", "0.100 s, after overall"]
    (triangles,) = panels(slip_frames_figure(history, times=[0.0]))[0].collections
    assert len(triangles.get_paths()) == 32
    assert len({tuple(colour) for colour in triangles.get_facecolor()}) == 1, "all open before the press"


def test_without_times_frames_end_after_overall_slip_and_show_the_record_after_each_event(history: xr.Dataset) -> None:
    assert len(titles(slip_frames_figure(history))) == 9
    found = titles(slip_frames_figure(history, Events(SlipEvents(overall=0.07))))
    assert len(found) == 9
    assert (found[0][:7], found[-1][:7]) == ("0.050 s", "0.070 s")
    times = history["time"].values
    events = SlipEvents(incipient=times[-4] - 1e-6, overall=times[-2] - 1e-6)
    expected = {f"{times[-4]:.3f} s, after incipient", f"{times[-2]:.3f} s, after overall"}
    assert expected <= set(titles(slip_frames_figure(history, Events(events))))


def test_strains_and_rates_have_a_row_each_and_a_scale_about_zero(history: xr.Dataset) -> None:
    scales = [axes for axes in panels(surface_strain_figure(history)) if "[" in axes.get_ylabel()]
    assert [axes.get_ylabel() for axes in scales] == ["strain along the slide [%]", "its rate [%/s]"]
    assert all(axes.get_ylim()[0] == pytest.approx(-axes.get_ylim()[1]) for axes in scales)


def test_the_frame_holds_what_ever_touches_or_all_where_nothing_does(history: xr.Dataset) -> None:
    patch = contact_patch(history)
    low, high = _touched_frame(history, patch, patch.points)
    assert low == pytest.approx([-0.8, -10.8])
    assert high == pytest.approx([10.8, 0.8])
    apart = history.assign(contact_state=0 * history["contact_state"])
    np.testing.assert_allclose(_touched_frame(apart, patch, patch.points), (low, high))
    corner = history["contact_state"].copy()
    corner[:] = 0
    corner[-1, patch.nodes[0]] = 1
    low, high = _touched_frame(history.assign(contact_state=corner), patch, patch.points)
    np.testing.assert_allclose(0.5 * (low + high), 1e3 * patch.points[0], atol=1e-9)


def with_states(history: xr.Dataset, before: int, after: int, switch: float) -> xr.Dataset:
    """Return a history whose whole contact changes its state once."""
    states = np.where(history["time"].values[:, None] < switch, before, after)
    shape = history["contact_state"].shape
    return history.assign(contact_state=history["contact_state"].copy(data=np.broadcast_to(states, shape)))


def triangles(figure: object) -> list[np.ndarray]:
    """Return the colours of the triangles, panel by panel."""
    return [axes.collections[0].get_facecolor() for axes in figure.axes if axes.collections and axes.get_title("left")]  # type: ignore[attr-defined]


def test_onsets_count_from_the_start_of_the_slide_and_share_one_scale(history: xr.Dataset) -> None:
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
    drawn = triangles(slip_onset_figure({"stuck": stuck, "open": open_}))
    assert np.allclose(drawn[0], drawn[0][0])
    assert drawn[0][0][:3].max() < 0.25
    assert len(drawn[1]) == 0


def test_onsets_share_the_axes_of_the_plate_and_arrows_tell_the_directions_apart(history: xr.Dataset) -> None:
    turned = history.assign(counterface_displacement=-history["counterface_displacement"])
    figure = slip_onset_figure({"there": history, "back": turned})
    first, second = (axes for axes in figure.axes if axes.get_title("left"))
    (there,), (back,) = ([text for text in axes.texts if hasattr(text, "arrow_patch")] for axes in (first, second))
    np.testing.assert_allclose(np.subtract(there.xy, there.xyann), -np.subtract(back.xy, back.xyann), atol=1e-12)
    assert first.get_xlim() == second.get_xlim()


def test_stick_ratio_is_drawn_over_the_slide_with_a_legend_for_several_runs(history: xr.Dataset) -> None:
    (axes,) = panels(stick_ratio_figure({"block": history}))
    (line,) = axes.lines
    assert line.get_label() == "block"
    assert line.get_xdata().size == 6  # records of the slide, its start included
    assert np.nanmax(line.get_xdata()) <= 0.5 * (1.0 + 1e-9)
    (axes,) = panels(stick_ratio_figure({"one": history, "other": history}))
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["one", "other"]


def test_every_reference_node_has_a_panel_of_its_own_with_the_plate(history: xr.Dataset) -> None:
    kinds = ["skin surface", "skin surface", "tissue surface"]
    nodes = history.isel(site=[0, 0, 0]).assign_coords(
        site=["skin-h1", "skin-h2", "tissue-v1"], site_kind=("site", kinds)
    )
    assert reference_kinds(nodes) == ["skin surface", "tissue surface"]
    assert reference_kinds(history) == reference_kinds(history.drop_dims("site")) == []
    figure = reference_nodes_figure(nodes, Events(SlipEvents(overall=0.09)))
    assert titles(figure) == ["h1, skin", "h2, skin", "v1, tissue"]
    lines = panels(figure)[0].lines
    plate = next(item for item in lines if item.get_linestyle() == ":" and item.get_color() == "#000000")
    assert plate.get_ydata()[-1] == pytest.approx(1.0)
    assert {"displacement", "plate", "overall"} <= words(figure)
    assert "incipient" not in words(figure), "it did not happen"


def test_the_jerk_at_the_start_of_the_slide_is_left_out(history: xr.Dataset) -> None:
    slow = {name: 5.0 * history[name] for name in ("time", "phase_start", "phase_end")}
    longer = history.assign_coords({**slow, "site_kind": ("site", ["skin surface"])})
    size = xr.where((longer["time"] > 0.24) & (longer["time"] < 0.3), 100.0, 0.1)
    signals = (size * xr.ones_like(longer["acceleration"])).transpose(*longer["acceleration"].dims)
    axes = panels(reference_nodes_figure(longer.assign(acceleration=signals)))[-1]
    assert axes.get_ylabel() == "acceleration [m/s²]"
    assert axes.get_ylim()[1] == pytest.approx(0.13)
