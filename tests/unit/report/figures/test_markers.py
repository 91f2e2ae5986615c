"""Figures of markers, of their tracks and of what detectors make of them."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from matplotlib.quiver import Quiver

from fingerslip.detect.evaluation.scores import Estimate
from fingerslip.marker_layouts import ring_layout
from fingerslip.report.figures.markers import (
    count_figure,
    fields_figure,
    importance_figure,
    jump_figure,
    learning_curve_figure,
    marker_tracks_figure,
    noise_figure,
    ring_colours,
    robustness_figure,
)
from fingerslip.vision.fields.fields import marker_fields
from fingerslip.vision.tracks import make_tracks
from unit.report.figures.made import panels, words

LAYOUT = ring_layout(1e-3, (1, 8, 16))

TIMES = np.arange(31) / 30


def tracks(units: str = "m", **more):
    """Return markers that move apart by a tenth in a second and shift by a millimetre along y."""
    position = LAYOUT.position * (1 + 0.1 * TIMES)[:, None, None] + TIMES[:, None, None] * (0.0, 1e-3)
    position[10:20, 24] = np.nan
    return make_tracks(position * (1.0 if units == "m" else 1e5), TIMES, units=units, **more)


def test_a_line_for_each_marker_in_the_colour_of_its_ring():
    figure = marker_tracks_figure(tracks(ring=LAYOUT.ring), "slide")
    first, second = panels(figure)
    assert len(first.lines) == len(second.lines) == 25
    colours = [line.get_color() for line in first.lines]
    assert [colours.count(colour) for colour in ring_colours(3)] == [1, 8, 16]
    assert colours[-1] == ring_colours(3)[0], "the centre is on top"
    np.testing.assert_allclose(second.lines[-1].get_ydata(), 1.0 * TIMES, atol=1e-12)
    assert {"Markers over time: slide", "displacement [mm]", "centre", "ring 2"} <= words(figure)


def test_lost_markers_leave_gaps_and_layouts_without_rings_have_no_key():
    figure = marker_tracks_figure(tracks("px"))
    gaps = [int(np.isnan(np.asarray(line.get_ydata(), dtype=float)).sum()) for line in panels(figure)[0].lines]
    assert sorted(gaps) == [0] * 24 + [10]
    assert "centre" not in words(figure)
    assert "displacement [px]" in words(figure)


@pytest.mark.parametrize("units", ["m", "px"])
def test_all_fields_have_their_panel(units):
    figure = fields_figure(marker_fields(tracks(units)), 0.5, "slide")
    shown = panels(figure)
    titles = [axes.get_title(loc="left") for axes in shown[:6]]
    assert titles[:3] == ["displacement", "velocity", "rigid residual"]
    assert titles[3:] == ["divergence [%]", "curl [%]", "larger principal strain [%]"]
    assert sum(isinstance(artist, Quiver) for axes in shown for artist in axes.get_children()) == 3
    assert shown[0].yaxis_inverted() == (units == "px")
    assert "Fields from markers at 0.5 s: slide" in words(figure)


def test_the_longest_arrow_is_stated_and_lost_markers_are_marked():
    figure = fields_figure(marker_fields(tracks()), 1.0)
    # The outermost marker moves by 0.2 mm away from the centre and by 1 mm along y.
    assert "longest 1.2 mm" in {text.get_text() for text in panels(figure)[0].texts}
    lost = fields_figure(marker_fields(tracks()), 0.5)
    crosses = panels(lost)[1].collections[-1].get_offsets()
    np.testing.assert_allclose(crosses, [1e3 * LAYOUT.position[24]], atol=1e-9)


def test_fields_without_a_triangle_say_so():
    line = make_tracks(np.tile(np.column_stack([np.arange(4.0), np.zeros(4)]), (31, 1, 1)), TIMES, units="px")
    figure = fields_figure(marker_fields(line), 0.0)
    assert [text.get_text() for axes in panels(figure)[3:6] for text in axes.texts] == ["no triangle of markers"] * 3


def test_no_times_have_no_lines():
    empty = make_tracks(np.empty((0, 2, 2)), [], units="px")
    assert len(panels(marker_tracks_figure(empty))[0].lines) == 2


@pytest.fixture
def still() -> xr.Dataset:
    rest = np.array([[10.0, 10.0], [30.0, 10.0], [10.0, 30.0], [30.0, 30.0]])
    position = rest + np.random.default_rng(0).normal(0, 0.1, (12, 4, 2))
    position[4:6, 2] = np.nan
    made = make_tracks(position, np.arange(12) / 10.0, units="px", attributes={"rest_frames": 3, "frame_rate": 10.0})
    state = np.zeros(12, dtype=np.int8)
    state[5] = 1
    dims = ("marker", "axis")
    return made.assign(frame_state=("time", state), reference=(dims, rest), rest_noise=(dims, np.full((4, 2), 0.1)))


def test_count_and_lost_intervals(still: xr.Dataset) -> None:
    count, lost = count_figure(still).axes
    assert count.get_lines()[0].get_ydata().tolist() == [4, 4, 4, 4, 3, 3, 4, 4, 4, 4, 4, 4]
    (bar,) = lost.patches
    assert (bar.get_x(), bar.get_width()) == pytest.approx((0.35, 0.2))


def test_noise_is_drawn_where_markers_rest(still: xr.Dataset) -> None:
    axes, _ = noise_figure(still, np.zeros((40, 40), dtype=np.uint8)).axes
    assert np.asarray(axes.collections[0].get_offsets()) == pytest.approx(still["reference"].values, abs=0.3)
    assert [text.get_text() for text in axes.texts] == ["0", "1", "2", "3"]


def test_jumps_count_all_pairs_of_frames(still: xr.Dataset) -> None:
    (axes,) = jump_figure(still).axes
    # A marker without three neighbours that were seen is not judged.
    assert sum(patch.get_height() for patch in axes.patches) == 8 * 4
    (empty,) = jump_figure(still.isel(time=slice(0, 1))).axes
    assert "no two frames" in empty.texts[0].get_text()


def test_a_learning_curve_shows_accuracy_and_f1() -> None:
    (axes,) = learning_curve_figure(
        [(4, Estimate(0.7, 0.6, 0.8), Estimate(0.6, 0.5, 0.7)), (8, Estimate(0.8, 0.7, 0.9), Estimate(0.75))]
    ).axes
    assert [line.get_ydata().tolist() for line in axes.get_lines()] == [[0.7, 0.8], [0.6, 0.75]]
    bars = [path.vertices[:, 1].tolist() for path in axes.collections[0].get_paths()]
    assert bars == [[0.6, 0.8], [0.7, 0.9]]
    assert [text.get_text() for text in axes.get_xticklabels()] == ["4", "8"]


def test_every_ring_has_a_bar() -> None:
    (axes,) = importance_figure({0: Estimate(0.02, 0.01, 0.03), 1: Estimate(-0.01, -0.02, 0.0)}).axes
    assert [bar.get_height() for bar in axes.patches] == pytest.approx([0.02, -0.01])


def test_every_disturbance_has_a_panel_and_no_accuracy_where_nothing_is_classified() -> None:
    right = Estimate(0.9, 0.8, 1.0)
    rows = [("lost", 0.0, right, 0.0), ("lost", 0.7, Estimate(None), 1.0), ("noise", 0.1, right, 0.0)]
    figure = robustness_figure(rows)
    first, second = figure.axes[:2]
    assert [axes.get_title(loc="left") for axes in (first, second)] == ["lost", "noise"]
    assert first.get_lines()[0].get_xdata().tolist() == [0.0]
    assert first.get_lines()[1].get_ydata().tolist() == [0.0, 1.0]
