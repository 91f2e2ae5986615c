"""Maps of stick and slip, and nodes that lag the plate."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.report.figures.contact import contact_displacement_figure, slip_maps_figure
from fingerslip.slip import Events
from unit.report.figures.made import ALL, APART, EVENTS, HISTORIES, HISTORY, NO_SLIDE, marked, panels, words
from unit.synthetic import HALF_WIDTH, PRESS_END


def test_slip_map_has_a_panel_for_each_run_and_marks_its_events() -> None:
    figure = slip_maps_figure(HISTORIES, ALL)
    assert [axes.get_title(loc="left") for axes in panels(figure)] == list(HISTORIES)
    times = [PRESS_END, EVENTS.slip.incipient, EVENTS.slip.three_quarter, EVENTS.slip.overall]
    assert marked(panels(figure)[0]) == pytest.approx(times)
    assert {"time [s]", "position along the plate [mm]", "open", "stick", "slip"} <= words(figure)


def test_slip_map_shows_the_states_themselves() -> None:
    (axes,) = panels(slip_maps_figure({"a": HISTORY}, {}))
    values = np.asarray(axes.collections[0].get_array())
    assert values.shape == (41, HISTORY.sizes["time"])
    assert set(np.unique(values)) == {0, 1, 2}
    # The centre sticks longest.
    assert (values == 1).sum(axis=1).argmax() == 20


def test_displacement_has_nine_nodes_and_the_plate() -> None:
    axes = panels(contact_displacement_figure(HISTORY, EVENTS))[0]
    curves = [line for line in axes.lines if len(line.get_xdata()) > 2]
    assert len(curves) == 10
    plate = curves[-1].get_ydata()
    assert plate[-1] == pytest.approx(3.0)
    assert max(line.get_ydata()[-1] for line in curves[:-1]) == pytest.approx(3.0 * 0.71, abs=0.03)
    assert "displacement since the slide began [mm]" in words(axes.figure)


def test_displacement_is_drawn_for_both_edges_and_the_centre_last_to_leave() -> None:
    axes = panels(contact_displacement_figure(HISTORY, EVENTS))[0]
    ends = [line.get_ydata()[-1] for line in axes.lines if len(line.get_xdata()) > 2][:-1]
    # Slip starts at the edges, so the centre follows furthest, and both sides alike.
    assert int(np.argmax(ends)) == 4
    assert ends[:4] == pytest.approx(ends[:4:-1], abs=0.01)
    assert marked(axes) == pytest.approx(
        [EVENTS.displacement.incipient, EVENTS.displacement.three_quarter, EVENTS.displacement.overall]
    )


def test_a_slide_to_the_left_is_drawn_downwards() -> None:
    names = ("counterface_displacement", "contact_displacement")
    left = HISTORY.assign({name: HISTORY[name] * [-1.0, 1.0] for name in names})
    low, high = panels(contact_displacement_figure(left))[0].get_ylim()
    assert low < -2.0
    assert 0.0 < high < 0.5


def test_map_is_ordered_by_position_whatever_the_numbering() -> None:
    order = np.random.default_rng(1).permutation(HISTORY.sizes["contact_node"])
    maps = [slip_maps_figure({"a": history}, {}) for history in (HISTORY, HISTORY.isel(contact_node=order))]
    states = [np.asarray(panels(figure)[0].collections[0].get_array()) for figure in maps]
    np.testing.assert_array_equal(states[0], states[1])
    heights = panels(maps[0])[0].collections[0].get_coordinates()[:, 0, 1]
    assert (heights[0], heights[-1]) == pytest.approx((-1e3 * HALF_WIDTH - 0.1, 1e3 * HALF_WIDTH + 0.1))


@pytest.mark.parametrize("history", [NO_SLIDE, APART], ids=["no slide", "open"])
def test_without_a_slide_in_contact_the_figure_says_so(history: object) -> None:
    (axes,) = panels(contact_displacement_figure(history, Events()))
    assert [text.get_text() for text in axes.texts] == ["no slide in contact"]


def test_map_without_contact_says_so() -> None:
    (axes,) = panels(slip_maps_figure({"a": APART}, {}))
    assert [text.get_text() for text in axes.texts] == ["no contact"]
