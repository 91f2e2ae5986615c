"""Figures of the contact and of receptors over time: forces, energies, slip maps, accelerations, spikes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr

from fingerslip.afferents.model import Spikes
from fingerslip.report.figures.signals import (
    _scale,
    acceleration_figure,
    acceleration_overview_figure,
    contact_displacement_figure,
    energy_figure,
    force_figure,
    force_overview_figure,
    held_figure,
    slip_maps_figure,
    spike_figure,
    strain_energy_density_figure,
)
from fingerslip.report.figures.style import figure_bytes
from fingerslip.slip import Events, SlipEvents
from unit.report.figures.made import (
    ALL,
    APART,
    BARE,
    EVENTS,
    HISTORIES,
    HISTORY,
    NO_SLIDE,
    line,
    marked,
    panels,
    texts,
    titles,
    words,
)
from unit.report.scenes import block_history
from unit.synthetic import HALF_WIDTH, PRESS_END, Process, make

SLIP = [PRESS_END, EVENTS.slip.incipient, EVENTS.slip.three_quarter, EVENTS.slip.overall]
KINDS = ["FA-I", "SA-I", "FA-II", "SA-II"]


@pytest.mark.parametrize("draw", [slip_maps_figure, force_overview_figure, acceleration_overview_figure])
def test_overviews_have_a_panel_for_each_run(draw: Callable[..., Any]) -> None:
    assert titles(draw(HISTORIES, ALL)) == list(HISTORIES)


@pytest.mark.parametrize(
    ("draw", "first_events", "expected"),
    [
        (lambda: force_figure(HISTORY, EVENTS), SLIP, {"time [s]", "force [mN]", "ratio, fraction"}),
        (
            lambda: slip_maps_figure(HISTORIES, ALL),
            SLIP,
            {"time [s]", "position along the plate [mm]", "open", "stick", "slip", "incipient"},
        ),
        (
            lambda: contact_displacement_figure(HISTORY, EVENTS),
            [EVENTS.displacement.incipient, EVENTS.displacement.three_quarter, EVENTS.displacement.overall],
            {"displacement since the slide began [mm]"},
        ),
        (
            lambda: acceleration_overview_figure({"a": HISTORY}, {"a": EVENTS}),
            [PRESS_END, EVENTS.acceleration.incipient, EVENTS.acceleration.three_quarter, EVENTS.acceleration.overall],
            {"acceleration along the plate [m/s²]", "peak that counts", "overall"},
        ),
        (
            lambda: acceleration_figure(HISTORY, EVENTS, "original"),
            [PRESS_END, EVENTS.acceleration.incipient, EVENTS.acceleration.three_quarter, EVENTS.acceleration.overall],
            {"acceleration along the plate [m/s²]", "Acceleration at the receptors: original"},
        ),
        (lambda: strain_energy_density_figure(HISTORY, EVENTS), SLIP, {"strain energy density [J/m³]"}),
    ],
)
def test_figures_are_labelled_and_marked_with_the_events_of_their_reading(
    draw: Callable[[], Any], first_events: list[float], expected: set[str]
) -> None:
    figure = draw()
    assert marked(panels(figure)[0]) == pytest.approx(first_events)
    assert expected <= words(figure)


@pytest.mark.parametrize(
    "history",
    [
        pytest.param(NO_SLIDE, id="no slide", marks=pytest.mark.slow),
        pytest.param(APART, id="no contact"),
        pytest.param(BARE, id="no receptors"),
    ],
)
def test_figures_of_incomplete_histories_are_drawn_without_a_warning(history: xr.Dataset) -> None:
    figures = (
        slip_maps_figure({"a": history}, {"a": Events()}),
        contact_displacement_figure(history, Events()),
        acceleration_figure(history, Events()),
        acceleration_overview_figure({"a": history}, {}),
        strain_energy_density_figure(history, Events()),
        force_figure(history, Events()),
        force_overview_figure({"a": history}, {}),
        energy_figure(history),
    )
    for figure in figures:
        assert figure_bytes(figure).startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("draw", "history", "said"),
    [
        (contact_displacement_figure, NO_SLIDE, ["no slide in contact"]),
        (contact_displacement_figure, APART, ["no slide in contact"]),
        (lambda history: slip_maps_figure({"a": history}, {}), APART, ["no contact"]),
        *(
            (lambda history: acceleration_overview_figure({"a": history}, {}), history, ["no slide or no receptor"])
            for history in (NO_SLIDE, APART, BARE)
        ),
        (acceleration_figure, BARE, ["no receptor in area A", "no receptor in area B", "slide starts"]),
        (strain_energy_density_figure, BARE, ["no receptor in area A", "no receptor in area B", "slide starts"]),
    ],
)
def test_an_empty_panel_says_why(draw: Callable[..., Any], history: xr.Dataset, said: list[str]) -> None:
    assert texts(panels(draw(history))[0]) == said


def test_ratio_reaches_the_friction_coefficient_and_is_left_out_while_hardly_anything_presses() -> None:
    forces, ratios = panels(force_figure(HISTORY, EVENTS))
    assert max(forces.lines[0].get_ydata()) == pytest.approx(400.0)
    ratio, normal = line(ratios, "tangential / normal force").get_ydata(), HISTORY["counterface_force"].values[:, 0, 1]
    assert ratio[-1] == pytest.approx(0.6)
    assert np.array_equal(np.isnan(ratio), normal <= 0.02 * normal.max())
    assert line(ratios, "friction coefficient").get_ydata()[0] == 0.6
    back = HISTORY.assign(counterface_force=HISTORY["counterface_force"] * [-1.0, 1.0])
    curves = [panels(force_figure(history))[0].lines[1].get_ydata() for history in (HISTORY, back)]
    np.testing.assert_allclose(curves[0], curves[1], err_msg="a magnitude, whatever the direction of the slide")


def test_energy_balance_keeps_small_parts_apart_as_shares_of_the_largest_work() -> None:
    large, small = panels(energy_figure(HISTORY))
    assert large.get_ylabel() == "energy [µJ]"
    work = float(HISTORY["external_work"].max())
    shares = {name: np.asarray(line(small, name).get_ydata()) for name in ("contact penalty", "material damping")}
    assert shares["contact penalty"][-1] == pytest.approx(float(HISTORY["contact_energy"][-1]) / work)
    # Zero cannot be shown on a logarithmic scale.
    assert shares["material damping"].tolist() == [1e-16] * HISTORY.sizes["time"]
    relaxing = HISTORY.assign(viscous_dissipation=HISTORY["external_work"] / 3.0)
    for history, drawn in ((HISTORY, False), (relaxing, True), (HISTORY.drop_vars("viscous_dissipation"), False)):
        labels = {item.get_label() for item in panels(energy_figure(history))[0].lines}
        assert ("relaxation of the layers" in labels) == drawn


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


def test_slip_map_shows_the_states_by_position_whatever_the_numbering() -> None:
    order = np.random.default_rng(1).permutation(HISTORY.sizes["contact_node"])
    meshes = [
        panels(slip_maps_figure({"a": history}, {}))[0].collections[0]
        for history in (HISTORY, HISTORY.isel(contact_node=order))
    ]
    values, others = (np.asarray(mesh.get_array()) for mesh in meshes)
    np.testing.assert_array_equal(values, others)
    assert values.shape == (41, HISTORY.sizes["time"])
    assert set(np.unique(values)) == {0, 1, 2}
    assert (values == 1).sum(axis=1).argmax() == 20, "the centre sticks longest"
    heights = meshes[0].get_coordinates()[:, 0, 1]
    assert (heights[0], heights[-1]) == pytest.approx((-1e3 * HALF_WIDTH - 0.1, 1e3 * HALF_WIDTH + 0.1))


def test_displacement_has_nine_nodes_and_the_plate() -> None:
    axes = panels(contact_displacement_figure(HISTORY, EVENTS))[0]
    curves = [item.get_ydata() for item in axes.lines if len(item.get_xdata()) > 2]
    assert len(curves) == 10
    assert curves[-1][-1] == pytest.approx(3.0)
    ends = [curve[-1] for curve in curves[:-1]]
    assert max(ends) == pytest.approx(3.0 * 0.71, abs=0.03)
    # Slip starts at the edges, so the centre follows furthest, and both sides alike.
    assert int(np.argmax(ends)) == 4
    assert ends[:4] == pytest.approx(ends[:4:-1], abs=0.01)
    names = ("counterface_displacement", "contact_displacement")
    left = HISTORY.assign({name: HISTORY[name] * [-1.0, 1.0] for name in names})
    low, high = panels(contact_displacement_figure(left))[0].get_ylim()
    assert low < -2.0
    assert 0.0 < high < 0.5


def test_held_runs_have_a_line_each_and_a_panel_for_bodies_that_are_free() -> None:
    held = HISTORY.assign(phase_kind=("phase", ["press", "hold"]))
    (forces,) = panels(held_figure({"one": held, "other": held}))
    assert [item.get_label() for item in forces.lines] == ["one", "other"]
    assert forces.get_ylabel() == "normal force [mN]"
    assert max(forces.lines[0].get_ydata()) == pytest.approx(400.0)
    moved = np.zeros((held.sizes["time"], 1, 2))
    moved[:, 0, 1] = np.linspace(0.0, 3e-4, len(moved))
    free = held.drop_dims("rigid_body", errors="ignore").assign_coords(rigid_body=["plate"])
    free = free.assign(rigid_body_displacement=(("time", "rigid_body", "component"), moved))
    _, motion = panels(held_figure({"run": free}))
    assert motion.get_ylabel() == "displacement of the body [mm]"
    assert max(motion.lines[0].get_ydata()) == pytest.approx(0.3)


def test_acceleration_is_on_one_scale_which_the_transition_does_not_set() -> None:
    figure = acceleration_figure(HISTORY, EVENTS)
    assert titles(figure) == KINDS
    assert len({axes.get_ylim() for axes in panels(figure)}) == 1
    axes = panels(acceleration_figure(make(Process(step=1e-3, peaks={1.5: 0.02, 1.71: 0.1}))))[0]
    assert 0.05 < axes.get_ylim()[1] < 0.15
    assert any(text.startswith("cut, reaches ") for text in texts(axes))
    assert not any(text.startswith("cut") for text in texts(panels(acceleration_figure(NO_SLIDE))[0]))
    single = HISTORY.isel(site=np.flatnonzero(HISTORY["site_kind"].values == "FA-I"))
    assert acceleration_figure(single).get_supylabel() == "acceleration along\nthe plate [m/s²]"


def test_density_starts_at_zero_with_both_areas() -> None:
    figure = strain_energy_density_figure(HISTORY, EVENTS)
    assert all(axes.get_ylim()[0] == 0.0 for axes in panels(figure))
    area_a, area_b = (item for item in panels(figure)[0].lines if len(item.get_xdata()) > 2)
    assert area_b.get_ydata()[-1] > area_a.get_ydata()[-1]


@pytest.mark.parametrize("draw", [acceleration_figure, strain_energy_density_figure])
def test_types_that_a_run_does_not_record_have_no_panel(draw: Callable[..., Any]) -> None:
    some = HISTORY.isel(site=np.flatnonzero(np.isin(HISTORY["site_kind"].values, ["FA-I", "SA-II"])))
    assert titles(draw(some)) == ["FA-I", "SA-II"]


def test_peaks_that_count_are_dotted_and_only_events_that_happened_have_keys() -> None:
    axes = panels(acceleration_overview_figure({"a": HISTORY}, {"a": EVENTS}))[0]
    dots = next(item for item in axes.lines if item.get_marker() == "o")
    assert list(dots.get_xdata()) == pytest.approx([1.53, 1.63, 1.71], abs=0.0051)
    alone = Events(acceleration=SlipEvents(overall=1.7))
    for events, keys in ((EVENTS, {"incipient", "three-quarter", "overall"}), (alone, {"overall"})):
        figure = acceleration_overview_figure({"a": HISTORY}, {"a": events})
        assert words(figure) & {"incipient", "three-quarter", "overall"} == keys


def test_every_type_has_its_raster_with_a_row_for_each_afferent_and_rates_come_last() -> None:
    times = (np.array([0.1, 0.2]), np.array([0.3]), np.array([0.15, 0.35]))
    spikes = Spikes(("a", "b", "c"), ("SA-I", "SA-I", "FA-I"), times, 0.0, 0.5)
    slow, fast, rates = spike_figure(spikes, block_history()).axes
    assert [len(axes.collections) for axes in (slow, fast)] == [2, 1]
    assert slow.get_ylabel() == "SA-I\n2 afferents"
    drawn = [collection.get_positions() for collection in slow.collections]
    np.testing.assert_allclose(np.concatenate(drawn), [0.1, 0.2, 0.3])
    assert rates.get_ylabel() == "mean rate [1/s]"
