"""The energy balance: what time integration takes out, contact forces that a step must not count, and energy made."""

import itertools

import numpy as np
import pytest
import xarray as xr

import fingerslip as fs
from fingerslip.dynamics.recording.labels import made_energy
from problems.pushed import push_and_slide
from unit.dynamics.models import STATIC, contact, model_of, oscillator, own_scheme

STORED = ("kinetic_energy", "strain_energy", "contact_energy")


def stored_energy(history: xr.Dataset) -> np.ndarray:
    return sum(history[name].values for name in STORED)


@pytest.mark.parametrize(("step", "alpha"), [(0.1, 0.0), (10.0, 0.0), (0.5, -0.05), (0.5, -1 / 3)])
def test_energy_is_kept_at_alpha_zero_and_lost_below_and_the_balance_knows_how_much(step, alpha):
    history = fs.simulate(oscillator(step, alpha, 200 * step))
    scale = history.strain_energy.values.max()
    gained = stored_energy(history) - history.external_work.values
    assert np.abs(history.energy_imbalance.values).max() <= 1e-11 * scale
    if alpha:
        assert gained[-1] < -0.02 * scale
        swing = np.abs(history.displacement.values[:, 0, 0] - STATIC)
        assert swing[-40:].max() < 0.98 * swing[:40].max()
    else:
        assert np.abs(gained).max() <= 1e-11 * scale
        assert np.abs(history.numerical_dissipation.values).max() <= 1e-11 * scale


@pytest.mark.parametrize("time", [fs.TimeStepping(5e-3), fs.QuasiStatic(5e-3)])
def test_the_imbalance_is_work_and_initial_energy_less_everything_they_went_into(time):
    """All terms of the history, of a run in which each of them acts."""
    law = fs.Elastic(34e3, 0.4, 1000.0, prony=(fs.PronyTerm(0.3, 0.05),))
    flying = {} if isinstance(time, fs.QuasiStatic) else {"initial_velocity": (0.0, -1e-3)}
    damping = fs.RayleighDamping(1.0, 1e-4)
    history = fs.simulate(push_and_slide(materials={"bulk": law}, damping=damping, time=time, **flying))
    lost = ("friction", "damping", "viscous", "numerical")
    dissipated = sum(history[f"{name}_dissipation"].values for name in lost)
    initial = stored_energy(history)[0]
    assert bool(initial) == bool(flying)
    imbalance = history.external_work.values + initial - stored_energy(history) - dissipated
    work = float(history.external_work.max())
    np.testing.assert_allclose(history.energy_imbalance.values, imbalance, atol=1e-14 * work)
    assert np.abs(imbalance).max() <= 1e-11 * work
    assert (np.abs(dissipated[-1]) > 0.0).all()


def thrown(dim, alpha, ratio, friction):
    """Return the history of a soft block that is thrown obliquely at a rough plate, in steps of half a wave's time."""
    size, modulus, density = 1e-3, 1e6, 1000.0
    aside, up = np.eye(dim)[[0, -1]]
    penalties = dict.fromkeys(("normal_penalty", "tangential_penalty"), ratio * modulus / size)
    plate = {"counterface": fs.Plane(tuple(up), -2e-4), "friction": fs.Coulomb(friction), "search_distance": 1.0}
    step = 0.5 * size * (density / modulus) ** 0.5
    return fs.simulate(
        model_of(
            "Q4" if dim == 2 else "H8",
            *[np.linspace(0.0, 4 * size, 5)] * dim,
            materials={"bulk": fs.Elastic(modulus, 0.3, density)},
            supports={},
            contacts=contact(**plate, **penalties),
            initial_velocity=tuple(0.5 * aside - up),
            time=fs.TimeStepping(step, alpha, 100 * step),
        )
    )


# In 3D with one penalty and the larger friction; the others are in the slow tier.
@pytest.mark.parametrize(
    ("alpha", "ratio", "friction", "dim"),
    [
        pytest.param(*case, marks=[pytest.mark.slow] * (case[3] == 3 and case[1:3] != (100.0, 1.0)))
        for case in itertools.product([0.0, -0.05, -0.41421], [1.0, 100.0, 1e4], [0.3, 1.0], [2, 3])
    ],
)
def test_rough_impacts_make_no_energy(alpha, ratio, friction, dim):
    """Without dropping, that of 10 by 10 cells grew eightfold (alpha = 0), twofold (-0.05) and by 1 % (-0.41421)."""
    history = thrown(dim, alpha, ratio, friction)
    energy = stored_energy(history)
    assert energy.max() <= (1.0 + 1e-6) * energy[0]
    assert np.abs(history.energy_imbalance.values).max() <= 1e-11 * energy[0]
    assert energy[-1] > 0.5 * energy[0]


def rod(alpha, ratio, scheme=fs.TimeStepping):
    """Return the history of a rod that is thrown at a wall, with the stiffness of contact over E / h."""
    modulus, density, length, count = 1e6, 1000.0, 0.1, 20
    size = length / count
    step = 0.5 * size * (density / modulus) ** 0.5
    wall = {"counterface": fs.Plane((0.0, 1.0), -1e-3), "friction": fs.Coulomb(0.0)}
    return fs.simulate(
        model_of(
            "Q4",
            np.linspace(0.0, size, 2),
            np.linspace(0.0, length, count + 1),
            materials={"bulk": fs.Elastic(modulus, 0.0, density)},
            supports={"left": ("x",), "right": ("x",)},
            contacts=contact(**wall, normal_penalty=ratio * modulus / size),
            initial_velocity=(0.0, -1.0),
            time=scheme(step, alpha, 200 * step),
        )
    )


def careless(step, alpha, end):
    """Return HHT-alpha of a user who takes the acceleration at the end of a step for its mean."""
    return own_scheme(step, alpha, end, end_share=1.0)


@pytest.mark.slow
def test_steps_that_make_energy_are_warned_of_more_than_was_put_in_is_refused_and_lost_energy_is_no_matter(caplog):
    for alpha, ratio in ((-0.3, 1e4), (0.0, 1.0), (0.0, 100.0), (-0.05, 1e4)):
        energy = stored_energy(rod(alpha, ratio))
        assert energy.max() <= (1.0 + 1e-12) * energy[0], (alpha, ratio)
    assert "have made" not in caplog.text
    with pytest.raises(fs.ConvergenceError, match=r"more than the 0\.25 J put in.* take a smaller step"):
        rod(0.0, 100.0, careless)
    energy = stored_energy(rod(0.0, 60.0, careless))
    assert energy.max() - energy[0] > 0.1 * energy[0]
    assert "time steps have made" in caplog.text
    assert "softer contact penalties or the scheme TimeStepping" in caplog.text


def test_energy_is_made_by_friction_and_time_steps_together_or_by_damping(caplog):
    """Of a history in which they accumulate, and then fall; steps without inertia are not looked at."""
    history = rod(-0.05, 1.0)
    largest, rise = float(history.kinetic_energy.max()), np.linspace(0.0, 1e-3, history.time.size)
    for name in ("friction_dissipation", "numerical_dissipation", "damping_dissipation"):
        fallen = history[name].values + rise
        fallen[-1] -= 5e-3
        made, share = made_energy(history.assign({name: ("time", fallen)}))
        assert made == pytest.approx(5e-3, rel=0.01)
        assert share == pytest.approx(5e-3 / largest, rel=0.01)
    fs.simulate(push_and_slide(time=fs.QuasiStatic(0.05)))
    assert "have made" not in caplog.text
