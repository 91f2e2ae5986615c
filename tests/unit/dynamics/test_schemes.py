"""Time integration: published spectral radii, order, start, energy, and forces that a step must not count."""

import dataclasses
import itertools

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.dynamics.recording.dataset import made_energy
from fingerslip.dynamics.system.scheme import hht, make_scheme, static
from problems.blocks import fitted_slope
from problems.held import apart
from problems.pushed import push_and_slide
from unit.dynamics.models import FREQUENCY, STATIC, contact, model_of, oscillator, own_scheme


def amplification(alpha, frequency):
    """Return the matrix that takes (u, v, a) of a free oscillator over a step of 1 s."""
    scheme, columns = hht(1.0, alpha), []
    for state in np.eye(3):
        (moved,), (moving,) = scheme.predict(*state[:, None])
        old, new = frequency**2 * state[0], frequency**2 * moved
        weight = 1.0 + alpha
        acceleration = (alpha * old - weight * new) / (1.0 + weight * frequency**2 * scheme.displacement_factor)
        displacement = moved + scheme.displacement_factor * acceleration
        columns.append([displacement, moving + scheme.velocity_factor * acceleration, acceleration])
    return np.array(columns).T


def spectral_radius(alpha, frequency):
    return np.abs(np.linalg.eigvals(amplification(alpha, frequency))).max()


@pytest.mark.parametrize(
    ("alpha", "expected"), [(0.0, 1.0), (-0.05, 0.9048), (-0.2, 0.6667), (-1 / 3, 0.5), (-0.41421, 0.7071), (-0.5, 1.0)]
)
def test_published_spectral_radii_at_infinite_step(alpha, expected):
    """Hilber, Hughes & Taylor 1977; double eigenvalues are found to the root of rounding only, hence 1e-3."""
    assert spectral_radius(alpha, 1e6) == pytest.approx(expected, abs=1e-3)


@settings(deadline=None, derandomize=True)
@given(st.floats(-0.5, 0.0), st.floats(-4.0, 6.0))
def test_unconditionally_stable(alpha, decade):
    assert spectral_radius(alpha, 10.0**decade) <= 1.0 + 1e-6


@pytest.mark.parametrize("alpha", [0.0, -0.05, -1 / 3])
def test_second_order_on_one_oscillator(alpha):
    end, steps = 6.0, [0.2, 0.1, 0.05]
    errors = []
    for step in steps:
        history = fs.simulate(oscillator(step, alpha, end))
        exact = STATIC * (1.0 - np.cos(FREQUENCY * history.time.values))
        errors.append(np.abs(history.displacement.values[:, 0, 0] - exact).max())
    slope = fitted_slope(steps, errors)
    assert slope == pytest.approx(2.0, abs=0.1), f"alpha {alpha}: fitted order {slope:.3f}, errors {errors}"


def free_oscillation(scheme, mass, stiffness, start, steps):
    """Yield what a step of a free oscillator loses of its energy, and what the closed form says."""
    (u, v), weight = start, scheme.end_weight
    a, two_back = -stiffness * u / mass, None
    force_before = stiffness * u
    for _ in range(steps):
        (moved,), (moving,) = scheme.predict(*np.array([[u], [v], [a]]))
        right = scheme.start_weight * stiffness * u - weight * stiffness * moved
        new_a = right / (mass + weight * stiffness * scheme.displacement_factor)
        new_u = moved + scheme.displacement_factor * new_a
        new_v = moving + scheme.velocity_factor * new_a
        two_back = force_before if two_back is None else two_back
        unbalance = (np.array([two_back]), np.array([stiffness * u]), np.array([stiffness * new_u]))
        changes = np.array([new_u - u]), np.array([new_v - v]), np.array([mass * (new_a - a)])
        said = scheme.dissipation(*changes, unbalance)
        lost = 0.5 * mass * (v**2 - new_v**2) + 0.5 * stiffness * (u**2 - new_u**2)
        yield lost, said
        two_back, (u, v, a) = stiffness * u, (new_u, new_v, new_a)


@settings(deadline=None, derandomize=True)
@given(st.floats(-0.5, 0.0), st.floats(0.05, 20.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_dissipation_of_the_scheme_is_the_energy_that_a_free_oscillator_loses(alpha, step, position, speed):
    scheme = hht(step, alpha)
    pairs = np.array(list(free_oscillation(scheme, 2.0, 3.0, (position, speed), 12)))
    scale = 2.0 * speed**2 + 3.0 * position**2
    np.testing.assert_allclose(pairs[:, 0], pairs[:, 1], atol=1e-12 * scale * (1.0 + step**2))


def test_the_settings_of_a_model_make_its_scheme_and_that_of_a_user_is_taken_as_it_is():
    assert make_scheme(fs.TimeStepping(5e-3, -0.1)) == hht(5e-3, -0.1)
    assert make_scheme(fs.QuasiStatic(5e-3)) == static(5e-3)
    scheme = own_scheme(0.1, 0.0, 6.0)
    assert make_scheme(scheme) is scheme
    model = oscillator(0.1, 0.0, 6.0)
    of_user, built_in = fs.simulate(dataclasses.replace(model, time=scheme)), fs.simulate(model)
    np.testing.assert_array_equal(of_user.displacement, built_in.displacement)
    assert np.abs(of_user.energy_imbalance.values).max() <= 1e-12 * of_user.strain_energy.values.max()


def test_the_first_acceleration_is_that_of_loads_and_mass_damping():
    """A cell that is free along x falls with a = g - a_M v everywhere."""
    changes = {"supports": {"bulk": ("y",)}, "initial_velocity": (0.2, 0.0), "gravity": (0.7, 0.0), "tractions": {}}
    model = dataclasses.replace(oscillator(0.1, -0.05, 1.0), **changes, damping=fs.RayleighDamping(mass=3.0))
    start = fs.simulate(model).isel(time=0)
    assert float(start.acceleration[0, 0]) == pytest.approx(0.7 - 3.0 * 0.2, rel=1e-9)
    assert float(start.kinetic_energy) == pytest.approx(0.5 * 3.0 * 0.2**2)
    assert float(start.energy_imbalance) == 0.0


@pytest.mark.parametrize("alpha", [-0.05, -0.3])
@pytest.mark.parametrize(
    "load",
    [
        {"gravity": (0.0, -9.81)},
        {"tractions": {"top": (0.0, -100.0)}},
        {"contacts": (fs.Contact("top", fs.Plane((0.0, -1.0)), drive=fs.Drive(1e-4, 0.5)),)},
    ],
    ids=["gravity", "traction", "drive"],
)
def test_a_body_with_much_damping_creeps_under_a_load_that_starts_at_once(alpha, load):
    """Damping by a time tau that is long beside all vibrations: the body goes to rest as 1 - exp(-t / tau)."""
    tau = 0.1
    model = model_of(
        "Q4",
        np.linspace(0.0, 5e-3, 5),
        np.linspace(0.0, 10e-3, 11),
        supports={"bottom": ("x", "y")},
        time=fs.TimeStepping(1e-3, alpha, end=0.6),
        damping=fs.RayleighDamping(stiffness=tau),
        **load,
    )
    history = fs.simulate(model)
    strain, time = history.strain_energy.values, history.time.values
    share = np.sqrt(strain / strain[-1])
    np.testing.assert_allclose(share[2:50], 1.0 - np.exp(-time[2:50] / tau), rtol=0.05)
    assert share[1] < share[2]
    assert (np.diff(history.damping_dissipation.values) > -1e-9 * strain[-1]).all()
    assert np.abs(history.energy_imbalance.values).max() < 1e-10 * history.external_work.values.max()


@pytest.mark.parametrize("alpha", [-0.05, -0.3])
def test_a_plate_on_a_stiff_damper_follows_its_force_from_the_start(alpha):
    """A force F on a damper c moves it by F t / c, whatever its mass; of the first step 0.43^2 is left at -0.3."""
    plate = fs.RigidBody(1e-6, free=("y",), dampers=fs.Dampers(y=10.0), loads=(fs.BodyLoad(y=2.0),))
    history = fs.simulate(apart(plate, time=fs.TimeStepping(1e-3, alpha, end=0.1)))
    moved = history.rigid_body_displacement.values[2:, 0, 1]
    np.testing.assert_allclose(moved, 0.2 * history.time.values[2:], rtol=0.02)


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
    history = rod(0.0, 60.0, careless)
    energy = stored_energy(history)
    assert energy.max() - energy[0] > 0.1 * energy[0]
    assert history.attrs["doubt"] in caplog.text
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
