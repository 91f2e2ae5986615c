"""Signals over time: accelerations, strain energy density, forces, energies."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.report.figures.signals import (
    _scale,
    acceleration_figure,
    acceleration_overview_figure,
    energy_figure,
    force_figure,
    force_overview_figure,
    strain_energy_density_figure,
)
from fingerslip.slip import Events
from unit.report.figures.made import ALL, APART, BARE, EVENTS, HISTORIES, HISTORY, NO_SLIDE, marked, panels, words
from unit.synthetic import PRESS_END, Process, make


def test_acceleration_has_the_four_types_on_one_scale() -> None:
    figure = acceleration_figure(HISTORY, EVENTS, "original")
    assert [axes.get_title(loc="left") for axes in panels(figure)] == ["FA-I", "SA-I", "FA-II", "SA-II"]
    assert len({axes.get_ylim() for axes in panels(figure)}) == 1
    assert all(marked(axes)[-1] == EVENTS.acceleration.overall for axes in panels(figure))
    assert {"acceleration along the plate [m/s²]", "Acceleration at the receptors: original"} <= words(figure)


def test_transition_does_not_set_the_scale() -> None:
    weak = make(Process(peaks={1.5: 0.02, 1.71: 0.1}))
    top = panels(acceleration_figure(weak))[0].get_ylim()[1]
    assert 0.05 < top < 0.15


def test_density_starts_at_zero_with_both_areas() -> None:
    figure = strain_energy_density_figure(HISTORY, EVENTS)
    assert all(axes.get_ylim()[0] == 0.0 for axes in panels(figure))
    assert "strain energy density [J/m³]" in words(figure)
    area_a, area_b = (line for line in panels(figure)[0].lines if len(line.get_xdata()) > 2)
    assert area_b.get_ydata()[-1] > area_a.get_ydata()[-1]


def test_force_figure_has_units_and_ratio_at_the_friction_coefficient() -> None:
    forces, ratios = panels(force_figure(HISTORY, EVENTS))
    assert forces.get_ylabel() == "force [mN]"
    assert max(forces.lines[0].get_ydata()) == pytest.approx(400.0)
    ratio = next(line for line in ratios.lines if line.get_label() == "tangential / normal force")
    assert ratio.get_ydata()[-1] == pytest.approx(0.6)


def test_overviews_have_a_panel_for_each_run() -> None:
    for figure in (force_overview_figure(HISTORIES, ALL), acceleration_overview_figure(HISTORIES, ALL)):
        assert [axes.get_title(loc="left") for axes in panels(figure)] == list(HISTORIES)


def test_peaks_that_count_are_dotted() -> None:
    axes = panels(acceleration_overview_figure({"a": HISTORY}, {"a": EVENTS}))[0]
    dots = next(line for line in axes.lines if line.get_marker() == "o")
    assert list(dots.get_xdata()) == pytest.approx([1.53, 1.63, 1.71], abs=0.0051)


def test_energy_balance_keeps_small_parts_apart() -> None:
    large, small = panels(energy_figure(HISTORY))
    assert large.get_ylabel() == "energy [µJ]"
    assert "imbalance" in {line.get_label() for line in small.lines}


def test_a_high_transition_is_cut_and_says_how_high_it_was() -> None:
    weak = make(Process(step=1e-3, peaks={1.5: 0.02, 1.71: 0.1}))
    texts = [text.get_text() for text in panels(acceleration_figure(weak))[0].texts]
    assert any(text.startswith("cut, reaches ") for text in texts)
    assert not any(text.get_text().startswith("cut") for text in panels(acceleration_figure(NO_SLIDE))[0].texts)


@pytest.mark.parametrize("draw", [acceleration_figure, strain_energy_density_figure])
def test_missing_receptors_are_said_for_each_area(draw: object) -> None:
    for axes in panels(draw(BARE)):
        texts = [text.get_text() for text in axes.texts]
        assert texts[:2] == ["no receptor in area A", "no receptor in area B"]


@pytest.mark.parametrize("history", [NO_SLIDE, APART, BARE], ids=["no slide", "no contact", "no receptors"])
def test_overview_without_a_signal_says_so(history: object) -> None:
    (axes,) = panels(acceleration_overview_figure({"a": history}, {"a": Events()}))
    assert [text.get_text() for text in axes.texts] == ["no slide or no receptor"]


def test_ratio_is_left_out_while_hardly_anything_presses() -> None:
    ratios = panels(force_figure(HISTORY))[1]
    ratio = next(line for line in ratios.lines if line.get_label() == "tangential / normal force").get_ydata()
    normal = HISTORY["counterface_force"].values[:, 0, 1]
    assert np.array_equal(np.isnan(ratio), normal <= 0.02 * normal.max())
    level = next(line for line in ratios.lines if line.get_label() == "friction coefficient")
    assert level.get_ydata()[0] == 0.6


def test_forces_are_marked_with_slip_events_and_accelerations_with_their_own() -> None:
    slip = [PRESS_END, EVENTS.slip.incipient, EVENTS.slip.three_quarter, EVENTS.slip.overall]
    own = EVENTS.acceleration
    peaks = [PRESS_END, own.incipient, own.three_quarter, own.overall]
    assert marked(panels(force_figure(HISTORY, EVENTS))[0]) == pytest.approx(slip)
    assert marked(panels(acceleration_overview_figure({"a": HISTORY}, {"a": EVENTS}))[0]) == pytest.approx(peaks)


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
