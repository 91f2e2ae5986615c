"""Forces and energies over time."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.report.figures.contact import _scale, energy_figure, force_figure, force_overview_figure
from unit.report.figures.made import ALL, EVENTS, HISTORIES, HISTORY, marked, panels
from unit.synthetic import PRESS_END


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
