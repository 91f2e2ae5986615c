"""Figures of markers: a line for each, in the colour of its ring, and panels of all fields."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.quiver import Quiver

from fingerslip.marker_layouts import ring_layout
from fingerslip.report.figures.markers import fields_figure, marker_tracks_figure, ring_colours
from fingerslip.vision.fields import marker_fields
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
