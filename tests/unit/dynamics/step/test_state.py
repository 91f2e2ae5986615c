"""The state at the start: at rest or in free flight, with the acceleration of the loads."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.contact.states import OPEN
from fingerslip.dynamics.step.state import first_state
from fingerslip.verification.meshes import box
from problems.held import apart
from problems.pushed import push_and_slide
from problems.verification.reference import make_stepper


def test_the_first_acceleration_is_that_of_the_loads():
    """A free block under traction falls as a counterface: a = t A / m everywhere at the start."""
    model = push_and_slide(
        supports={}, contacts=(), programme=(), tractions={"left": (7.0, 0.0), "right": (7.0, 0.0)},
        time=fs.TimeStepping(1e-4, end=1e-3),
    )  # fmt: skip
    stepper = make_stepper(model)
    system, state = stepper.system, first_state(stepper)
    total = system.mass @ state.acceleration
    np.testing.assert_allclose(
        total.reshape(-1, 2).sum(axis=0), system.load(0.0).reshape(-1, 2).sum(axis=0), atol=1e-15
    )
    assert state.acceleration.any()


def test_a_body_that_is_touched_starts_at_rest_without_forces():
    state = first_state(make_stepper(push_and_slide()))
    for name in ("displacement", "velocity", "acceleration", "contact_forces", "moved", "counterfaces"):
        assert not getattr(state, name).any(), name
    assert (state.interface.state == OPEN).all()
    assert (state.interface.relative[:, 0] >= 0.0).all()
    assert state.energies.imbalance == 0.0


def test_damping_slows_a_body_in_free_flight_from_the_start():
    """With mass-proportional damping alone, M a = -a_M M v."""
    model = push_and_slide(
        supports={}, contacts=(), programme=(), time=fs.TimeStepping(1e-4, end=1e-3),
        damping=fs.RayleighDamping(mass=3.0), initial_velocity=(0.2, 0.0),
    )  # fmt: skip
    stepper = make_stepper(model)
    state = first_state(stepper)
    np.testing.assert_allclose(state.acceleration, -3.0 * state.velocity, atol=1e-12)
    assert state.energies.kinetic == pytest.approx(0.5 * 0.2**2 * stepper.system.mass.sum() / 2)
    assert state.energies.imbalance == 0.0


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
def test_a_body_with_much_damping_creeps_under_a_load_that_starts_at_once(load, alpha):
    """Damping by a time tau that is long beside all vibrations: the body goes to rest as 1 - exp(-t / tau)."""
    step, tau = 1e-3, 0.1
    model = {
        "mesh": box("Q4", np.linspace(0.0, 5e-3, 5), np.linspace(0.0, 10e-3, 11)),
        "materials": {"bulk": fs.Elastic(1e5, 0.3, 1000.0)},
        "formulation": "plane_strain",
        "supports": {"bottom": ("x", "y")},
        "time": fs.TimeStepping(step, alpha, end=1.0),
        **load,
    }
    history = fs.simulate(fs.Model(**model, damping=fs.RayleighDamping(stiffness=tau)))
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
