"""The energy balance: each term in closed form, and what the time integration takes out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.dynamics.energy import Energies, integration_dissipation
from fingerslip.dynamics.scheme import hht, predict
from unit.dynamics.oscillator import STATIC, oscillator


def mechanical_energy(history):
    return (history.kinetic_energy + history.strain_energy - history.external_work).values


@pytest.mark.parametrize("step", [0.1, 10.0])
def test_energy_is_kept_at_alpha_zero(step):
    history = fs.simulate(oscillator(step, 0.0, 100 * step))
    scale = history.strain_energy.values.max()
    assert np.abs(mechanical_energy(history)).max() <= 1e-11 * scale
    assert np.abs(history.numerical_dissipation.values).max() <= 1e-11 * scale


@pytest.mark.parametrize("alpha", [-0.05, -1 / 3])
def test_energy_is_lost_below_alpha_zero_and_the_balance_knows_how_much(alpha):
    history = fs.simulate(oscillator(0.5, alpha, 100.0))
    scale = history.strain_energy.values.max()
    assert mechanical_energy(history)[-1] < -0.02 * scale
    assert np.abs(history.energy_imbalance.values).max() <= 1e-12 * scale
    swing = np.abs(history.displacement.values[:, 0, 0] - STATIC)
    assert swing[-40:].max() < 0.98 * swing[:40].max()


def test_the_imbalance_is_work_less_everything_it_went_into():
    energies = Energies(1.0, 2.0, 4.0, 8.0, 16.0, 32.0, external_work=100.0)
    assert energies.imbalance == 100.0 - 63.0
    assert Energies().imbalance == 0.0


def test_stored_energies_are_replaced_and_dissipations_and_work_add_up():
    before = Energies(1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
    after = before.after(kinetic=0.1, strain=0.2, contact=0.4, friction=0.8, damping=1.6, numerical=3.2, work=6.4)
    assert after == Energies(0.1, 0.2, 0.4, 8.8, 17.6, 35.2, 70.4)
    assert before.friction == 8.0


def free_oscillation(scheme, mass, stiffness, start, steps):
    """Yield what a step of a free oscillator loses of its energy, and what the closed form says."""
    (u, v), weight = start, 1.0 + scheme.alpha
    a, two_back = -stiffness * u / mass, None
    force_before = stiffness * u
    for _ in range(steps):
        ahead = predict(scheme, *np.array([[u], [v], [a]]))
        right = scheme.alpha * stiffness * u - weight * stiffness * ahead.displacement[0]
        new_a = right / (mass + weight * stiffness * scheme.displacement_factor)
        new_u = ahead.displacement[0] + scheme.displacement_factor * new_a
        new_v = ahead.velocity[0] + scheme.velocity_factor * new_a
        two_back = force_before if two_back is None else two_back
        said = integration_dissipation(
            scheme,
            displacement_change=np.array([new_u - u]),
            velocity_change=np.array([new_v - v]),
            inertia_change=np.array([mass * (new_a - a)]),
            unbalance_change=np.array([stiffness * new_u - two_back]),
        )
        lost = 0.5 * mass * (v**2 - new_v**2) + 0.5 * stiffness * (u**2 - new_u**2)
        yield lost, said
        two_back, (u, v, a) = stiffness * u, (new_u, new_v, new_a)


@settings(deadline=None, derandomize=True)
@given(st.floats(-0.5, 0.0), st.floats(0.05, 20.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_dissipation_of_the_scheme_is_the_energy_that_a_free_oscillator_loses(alpha, step, place, speed):
    scheme = hht(step, alpha)
    pairs = np.array(list(free_oscillation(scheme, 2.0, 3.0, (place, speed), 12)))
    scale = 2.0 * speed**2 + 3.0 * place**2
    np.testing.assert_allclose(pairs[:, 0], pairs[:, 1], atol=1e-12 * scale * (1.0 + step**2))


def test_the_trapezoidal_rule_takes_nothing_out_whatever_the_motion():
    changes = np.random.default_rng(0).normal(size=(4, 9))
    names = ("displacement_change", "velocity_change", "inertia_change", "unbalance_change")
    assert integration_dissipation(hht(0.3, 0.0), **dict(zip(names, changes, strict=True))) == 0.0
