"""The state at the start: at rest or in free flight, with the acceleration of the loads."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.contact.states import OPEN
from fingerslip.dynamics.step.state import first_state
from fingerslip.verification.reference import make_stepper
from problems.pushed import push_and_slide


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
