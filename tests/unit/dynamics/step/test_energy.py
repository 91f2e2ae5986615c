"""The energy balance: each term in closed form, and what the time integration takes out."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.step.energy import Energies, made_energy
from fingerslip.dynamics.system.scheme import hht
from fingerslip.verification.meshes import box
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


def thrown(alpha, ratio, scheme=fs.TimeStepping):
    """Return the history of a rod that is thrown at a wall, with the stiffness of contact over E / h."""
    modulus, density, length, count = 1e6, 1000.0, 0.1, 20
    size = length / count
    contact = fs.Contact("bottom", fs.Plane((0.0, 1.0), -1e-3), fs.Coulomb(0.0), normal_penalty=ratio * modulus / size)
    return fs.simulate(
        fs.Model(
            mesh=box("Q4", np.linspace(0.0, size, 2), np.linspace(0.0, length, count + 1)),
            materials={"bulk": fs.Elastic(modulus, 0.0, density)},
            formulation="plane_strain",
            supports={"left": ("x",), "right": ("x",)},
            contacts=(contact,),
            initial_velocity=(0.0, -1.0),
            time=scheme(0.5 * size * (density / modulus) ** 0.5, alpha, 200 * 0.5 * size * (density / modulus) ** 0.5),
        )
    )


class Careless:
    """HHT-alpha of a user who takes the acceleration at the end of a step for its mean."""

    def __init__(self, step, alpha, end):
        self.own, self.end, self.end_share = hht(step, alpha), end, 1.0

    def __getattr__(self, name):
        return getattr(self.own, name)


def test_steps_that_make_energy_are_warned_of(caplog):
    with pytest.raises(fs.ConvergenceError, match=r"more than the 0\.25 J put in"):
        thrown(0.0, 100.0, Careless)
    history = thrown(0.0, 60.0, Careless)
    made, share = made_energy(history)
    assert share > 0.1
    energy = (history.kinetic_energy + history.strain_energy + history.contact_energy).values
    assert made >= energy.max() - energy[0] > 0.1 * energy[0]
    assert "time steps have made" in caplog.text
    assert "softer contact penalties or the scheme TimeStepping" in caplog.text
    assert "TimeStepping" in caplog.text


@pytest.mark.parametrize(("alpha", "ratio"), [(-0.3, 1e4), (0.0, 1.0), (0.0, 100.0), (-0.05, 1e4)])
def test_steps_that_lose_energy_are_not(alpha, ratio, caplog):
    history = thrown(alpha, ratio)
    assert made_energy(history)[1] < 1e-3
    energy = (history.kinetic_energy + history.strain_energy + history.contact_energy).values
    assert energy.max() <= (1.0 + 1e-12) * energy[0]
    assert "have made" not in caplog.text
