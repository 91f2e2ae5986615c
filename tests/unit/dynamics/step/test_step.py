"""One step of the scheme with contact: the full solution, checked errors, and the state before left alone."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.dynamics.recording.steps import step_times
from fingerslip.dynamics.step import condensation, step
from fingerslip.dynamics.step.state import first_state
from fingerslip.dynamics.step.step import advance
from fingerslip.dynamics.step.stepper import Stopwatch, build_steppers
from fingerslip.dynamics.system.system import build_system
from fingerslip.linear.solvers.superlu import SuperLU
from problems.blocks import ELEMENTS
from problems.matrices import SOLVERS
from problems.pushed import pad, push_and_slide
from problems.verification.reference import condensed_states, full_motions, full_system, make_stepper


def test_a_step_leaves_the_state_before_as_it_was():
    model = push_and_slide(damping=fs.RayleighDamping(1.0, 1e-4))
    system = build_system(model)
    stepper = build_steppers([system], model.time, model.damping)[0]
    state = first_state(stepper)
    for number in range(1, 4):
        arrays = {name: value.copy() for name, value in vars(state).items() if isinstance(value, np.ndarray)}
        forces = state.interface.forces.copy()
        counterfaces = system.motions[0].displacement(np.array([number * 5e-3]))
        after = advance([stepper], [state], number * 5e-3, [counterfaces], watch=Stopwatch())[0]
        for name, value in arrays.items():
            np.testing.assert_array_equal(getattr(state, name), value, err_msg=name)
        np.testing.assert_array_equal(state.interface.forces, forces)
        state = after


def test_what_contact_has_found_of_its_forces_is_what_they_do(monkeypatch):
    """Steps take it from contact, those in which nodes leave too."""
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", 0)
    told, left, original = [], [], step._joint_motion

    def asked(steppers, contacts, shape):
        told.append(original(steppers, contacts, shape))
        left.append(contacts[0].release_force is not None)
        return told[-1]

    monkeypatch.setattr(step, "_joint_motion", asked)
    model = push_and_slide(mesh=pad("Q4", columns=16))
    found = fs.simulate(model, solver=SuperLU())
    assert all(moved is not None for moved in told)
    assert any(left)
    monkeypatch.setattr(step, "_joint_motion", lambda *_: None)
    exact = fs.simulate(model, solver=SuperLU())
    for name in ("contact_displacement", "contact_acceleration", "normal_traction", "tangential_traction"):
        expected = exact[name].values
        np.testing.assert_allclose(found[name].values, expected, atol=1e-9 * np.abs(expected).max(), err_msg=name)


WAYS = {"columns": 10**9, "schur": 0}


@pytest.mark.parametrize(
    ("element", "largest"),
    [
        pytest.param(
            element, largest, id=f"{element}-{way}", marks=[pytest.mark.slow] * ((element, way) == ("T6", "schur"))
        )
        for element in ELEMENTS
        for way, largest in WAYS.items()
    ],
)
@pytest.mark.parametrize("solver", SOLVERS)
def test_condensed_solution_is_the_full_solution(element, solver, largest, monkeypatch):
    """Tolerance 1e-9 of the largest value of each field: rounding alone, amplified by 1/(beta h^2) in accelerations."""
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", largest)
    monkeypatch.setattr(type(solver), "rough", type(solver).series)
    penalties = {"normal_penalty": 1e8, "tangential_penalty": 1e8}
    contact = fs.Contact("bottom", friction=fs.Coulomb(0.4), search_distance=1.0, **penalties)
    model = push_and_slide(element, damping=fs.RayleighDamping(2.0, 1e-4), contacts=(contact,))
    stepper, full = make_stepper(model, solver), full_system(model)
    system, times = stepper.system, step_times(model)
    expected = full_motions(full, system.motions[0].displacement(times), times)
    found = list(condensed_states(stepper, model))
    for name in ("displacement", "velocity", "acceleration"):
        whole = np.array([getattr(motion, name) for motion in expected])
        condensed = np.zeros_like(whole)
        condensed[:, system.free] = [getattr(state, name) for state in found]
        error = np.abs(condensed - whole).max() / np.abs(whole).max()
        assert error <= 1e-9, f"{name}: {error:.1e}"
    forces = np.array([motion.forces for motion in expected])
    own = np.array([state.contact_forces for state in found])
    np.testing.assert_array_equal(system.candidates.nodes, full.nodes)
    assert np.abs(own - forces).max() <= 1e-9 * np.abs(forces).max()
    states = np.array([state.interface.state for state in found])
    assert {OPEN, STICK, SLIP} <= set(states.ravel().tolist()), "the run must see open, sticking and slipping nodes"
    assert (states[-1] != STICK).all(), "and end with overall slip"


def test_a_free_block_follows_newton():
    """Without contact and support the centre of mass moves as s = a t^2 / 2, which the scheme integrates exactly."""
    model = push_and_slide(
        supports={}, contacts=(), programme=(), tractions={"left": (7.0, 0.0)}, time=fs.TimeStepping(1e-3, end=0.02)
    )
    system = build_system(model)
    stepper = build_steppers([system], model.time, model.damping)[0]
    state, watch = first_state(stepper), Stopwatch()
    total = system.mass.sum() / 2
    acceleration = system.load(0.0).sum() / total
    for number in range(1, 21):
        state = advance([stepper], [state], number * 1e-3, [np.zeros((0, 2))], watch=watch)[0]
        momentum = (system.mass @ state.velocity)[::2].sum()
        moment = (system.mass @ state.displacement)[::2].sum()
        assert momentum == pytest.approx(total * acceleration * state.time, rel=1e-9)
        assert moment == pytest.approx(total * acceleration * state.time**2 / 2, rel=1e-9)
