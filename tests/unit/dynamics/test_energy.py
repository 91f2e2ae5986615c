"""The energy balance: each term in closed form, and what the time integration takes out."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.energy import Energies
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
    assert Energies(kinetic=3.0, initial=3.0).imbalance == 0.0
    assert Energies().imbalance == 0.0


def test_stored_energies_are_replaced_and_dissipations_and_work_add_up():
    before = Energies(1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, initial=5.0)
    after = before.after(kinetic=0.1, strain=0.2, contact=0.4, friction=0.8, damping=1.6, numerical=3.2, work=6.4)
    assert after == Energies(0.1, 0.2, 0.4, 8.8, 17.6, 35.2, 70.4, initial=5.0)
    assert before.friction == 8.0
