"""Figures of the contact over time: forces, energies, slip maps, motion of its nodes."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.report.figures.contact import (
    _scale,
    contact_displacement_figure,
    energy_figure,
    force_figure,
    force_overview_figure,
    held_figure,
    slip_maps_figure,
)
from fingerslip.report.figures.marks import is_held
from fingerslip.slip import Events
from unit.report.figures.made import ALL, APART, EVENTS, HISTORIES, HISTORY, NO_SLIDE, marked, panels, words
from unit.synthetic import HALF_WIDTH, PRESS_END


def test_force_figure_has_units_and_ratio_at_the_friction_coefficient() -> None:
    forces, ratios = panels(force_figure(HISTORY, EVENTS))
    assert forces.get_ylabel() == "force [mN]"
    assert max(forces.lines[0].get_ydata()) == pytest.approx(400.0)
    ratio = next(line for line in ratios.lines if line.get_label() == "tangential / normal force")
    assert ratio.get_ydata()[-1] == pytest.approx(0.6)


def test_energy_balance_keeps_small_parts_apart() -> None:
    large, small = panels(energy_figure(HISTORY))
    assert large.get_ylabel() == "energy [µJ]"
    assert "imbalance" in {line.get_label() for line in small.lines}


def test_relaxation_is_drawn_where_layers_relax() -> None:
    name, label = "viscous_dissipation", "relaxation of the layers"
    relaxing = HISTORY.assign({name: HISTORY["external_work"] / 3.0})
    older = HISTORY.drop_vars(name)
    shown = [
        label in {line.get_label() for line in panels(energy_figure(one))[0].lines}
        for one in (HISTORY, relaxing, older)
    ]
    assert shown == [False, True, False]


def test_ratio_is_left_out_while_hardly_anything_presses() -> None:
    ratios = panels(force_figure(HISTORY))[1]
    ratio = next(line for line in ratios.lines if line.get_label() == "tangential / normal force").get_ydata()
    normal = HISTORY["counterface_force"].values[:, 0, 1]
    assert np.array_equal(np.isnan(ratio), normal <= 0.02 * normal.max())
    level = next(line for line in ratios.lines if line.get_label() == "friction coefficient")
    assert level.get_ydata()[0] == 0.6


def test_small_parts_of_the_energy_are_shares_of_the_largest_work() -> None:
    _, small = panels(energy_figure(HISTORY))
    shares = {line.get_label(): np.asarray(line.get_ydata()) for line in small.lines}
    work = float(HISTORY["external_work"].max())
    assert shares["contact penalty"][-1] == pytest.approx(float(HISTORY["contact_energy"][-1]) / work)
    # Zero cannot be shown on a logarithmic scale.
    assert shares["material damping"].tolist() == [1e-16] * HISTORY.sizes["time"]


@pytest.mark.parametrize(
    ("largest", "expected"),
    [
        (2.5, (1.0, "N")),
        (0.4, (1e3, "mN")),
        (1.0, (1.0, "N")),
        (2e-5, (1e6, "µN")),
        (3e-9, (1e9, "nN")),
        (4e-12, (1e12, "pN")),
        (0.0, (1.0, "N")),
    ],
)
def test_units_get_the_prefix_that_makes_them_readable(largest: float, expected: tuple[float, str]) -> None:
    assert _scale(largest, "N") == expected


def test_overview_has_a_panel_for_each_run() -> None:
    assert [axes.get_title(loc="left") for axes in panels(force_overview_figure(HISTORIES, ALL))] == list(HISTORIES)


def test_forces_are_marked_with_slip_events() -> None:
    slip = [PRESS_END, EVENTS.slip.incipient, EVENTS.slip.three_quarter, EVENTS.slip.overall]
    assert marked(panels(force_figure(HISTORY, EVENTS))[0]) == pytest.approx(slip)


def test_tangential_force_is_a_magnitude_whatever_the_direction_of_the_slide() -> None:
    back = HISTORY.assign(counterface_force=HISTORY["counterface_force"] * [-1.0, 1.0])
    curves = [panels(force_figure(history))[0].lines[1].get_ydata() for history in (HISTORY, back)]
    np.testing.assert_allclose(curves[0], curves[1])


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


HELD = HISTORY.assign(phase_kind=("phase", ["press", "hold"]))


def test_a_run_with_a_slide_is_not_held() -> None:
    assert not is_held(HISTORY)
    assert is_held(HELD)


def test_force_has_a_line_for_each_run() -> None:
    (forces,) = panels(held_figure({"one": HELD, "other": HELD}))
    assert [line.get_label() for line in forces.lines] == ["one", "other"]
    assert forces.get_ylabel() == "normal force [mN]"
    assert max(forces.lines[0].get_ydata()) == pytest.approx(400.0)


def test_bodies_that_are_free_have_a_panel_for_how_far_they_move() -> None:
    times = HELD.sizes["time"]
    moved = np.zeros((times, 1, 2))
    moved[:, 0, 1] = np.linspace(0.0, 3e-4, times)
    free = HELD.drop_dims("rigid_body", errors="ignore").assign_coords(rigid_body=["plate"])
    free = free.assign(rigid_body_displacement=(("time", "rigid_body", "component"), moved))
    _, motion = panels(held_figure({"run": free}))
    assert motion.get_ylabel() == "displacement of the body [mm]"
    assert max(motion.lines[0].get_ydata()) == pytest.approx(0.3)
