"""Ends of steps: states of several motions are those of each alone, and their balances of energy close."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.recording.steps import step_times
from fingerslip.dynamics.step.contact_step import solve_step, weighted_forces
from fingerslip.dynamics.step.finish import finish
from fingerslip.dynamics.step.prediction import predict
from problems.pushed import push_and_slide
from problems.verification.reference import condensed_states, make_stepper

DOWN = fs.SupportMotion((0.1e-3, -0.2e-3), fs.Ramp((0.0, 0.4), (0.0, 1.0)))


def solved(stepper, model, states):
    """Return predictions, contacts and unknowns of a step from each of some states."""
    times, motion = step_times(model), stepper.system.motions[0]
    end = states[0].time + float(times[1])
    shift = motion.displacement(np.array([end]))
    starts = predict([stepper] * len(states), states, end, [shift] * len(states))
    halfways = [stepper.condensed.forward(start.right_hand_side) for start in starts]
    contacts = [solve_step(stepper, start, own.local) for start, own in zip(starts, halfways, strict=True)]
    forces = [weighted_forces(stepper, contact).ravel() for contact in contacts]
    unknowns = [stepper.condensed.backward(*own) for own in zip(halfways, forces, strict=True)]
    return starts, contacts, np.array(unknowns)


@pytest.fixture(scope="module", params=["held", "moved"])
def stepped(request):
    """Return a model with its stepper, and every tenth state of its motion."""
    moved = {"support_motions": {"top": DOWN}} if request.param == "moved" else {}
    model = push_and_slide(damping=fs.RayleighDamping(2.0, 1e-4), gravity=(0.0, -9.81), **moved)
    stepper = make_stepper(model)
    return model, stepper, list(condensed_states(stepper, model))[::10]


def test_states_of_several_motions_are_those_of_each(stepped):
    model, stepper, states = stepped
    step = solved(stepper, model, [states[1]] * 2)
    both = finish([stepper] * 2, *step)
    for number, state in enumerate(both):
        own = slice(number, number + 1)
        (alone,) = finish([stepper], *(part[own] for part in step))
        for field in fields(state):
            found, expected = getattr(state, field.name), getattr(alone, field.name)
            if isinstance(expected, np.ndarray):
                # Two products add up in another order than one.
                scale = np.abs(expected).max(initial=0.0)
                np.testing.assert_allclose(found, expected, atol=1e-12 * scale, err_msg=field.name)
        assert vars(state.energies) == pytest.approx(vars(alone.energies), rel=1e-12)


def test_the_balance_of_energy_closes_in_every_step(stepped):
    model, stepper, states = stepped
    for state in states[:-1]:
        (after,) = finish([stepper], *solved(stepper, model, [state]))
        size = max(abs(getattr(after.energies, field.name)) for field in fields(after.energies))
        assert after.energies.imbalance - state.energies.imbalance == pytest.approx(0.0, abs=1e-11 * size)
        assert after.contact_forces_before is state.contact_forces
        assert after.unbalance_before is state.unbalance
        moved = stepper.system.moved(after.displacement, after.counterfaces)
        np.testing.assert_allclose(after.moved, moved, atol=1e-15)


def test_moving_supports_do_the_work_of_the_mean_of_their_forces(stepped):
    model, stepper, states = stepped
    moving, before = stepper.system.unknowns.moving, states[1]
    (start,), (contact,), unknowns = solved(stepper, model, [before])
    (after,) = finish([stepper], [start], [contact], unknowns)
    change = after.displacement - before.displacement
    gravity = 0.5 * (before.load + after.load) @ change
    forces = 0.5 * (before.contact_forces + after.contact_forces)
    plate = np.sum(forces * (after.counterfaces - before.counterfaces))
    supports = 0.5 * (stepper.support_force(before) + stepper.support_force(after)) @ change[moving]
    work = after.energies.external_work - before.energies.external_work
    assert work == pytest.approx(gravity + plate + supports, rel=1e-9)
    assert bool(moving.size) == ("top" in model.support_motions)
