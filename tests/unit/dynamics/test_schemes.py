"""Time integration: published spectral radii, stability, second order, the energy it takes out, and its start."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.dynamics.system.scheme import hht, make_scheme, static
from problems.blocks import fitted_slope
from problems.held import apart
from unit.dynamics.models import FREQUENCY, STATIC, model_of, oscillator, own_scheme


def amplification(alpha, frequency):
    """Return the matrix that takes (u, v, a) of a free oscillator over a step of 1 s."""
    scheme, columns = hht(1.0, alpha), []
    for state in np.eye(3):
        ahead = scheme.predict(*state[:, None])
        old, new = frequency**2 * state[0], frequency**2 * ahead.displacement[0]
        weight = 1.0 + alpha
        acceleration = (alpha * old - weight * new) / (1.0 + weight * frequency**2 * scheme.displacement_factor)
        displacement = ahead.displacement[0] + scheme.displacement_factor * acceleration
        columns.append([displacement, ahead.velocity[0] + scheme.velocity_factor * acceleration, acceleration])
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
        ahead = scheme.predict(*np.array([[u], [v], [a]]))
        right = scheme.start_weight * stiffness * u - weight * stiffness * ahead.displacement[0]
        new_a = right / (mass + weight * stiffness * scheme.displacement_factor)
        new_u = ahead.displacement[0] + scheme.displacement_factor * new_a
        new_v = ahead.velocity[0] + scheme.velocity_factor * new_a
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


def test_dissipation_of_the_trapezoidal_rule_and_of_static_steps():
    """The first takes nothing out, whatever the motion; the second the work of what is unbalanced at both ends."""
    changes = np.random.default_rng(0).normal(size=(6, 9))
    assert hht(0.3, 0.0).dissipation(*changes[:3], tuple(changes[3:])) == 0.0
    change = np.array([2.0]), np.zeros(1), np.zeros(1), (np.array([9.0]), np.array([-3.0]), np.ones(1))
    assert static(0.1).dissipation(*change) == 2.0


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
