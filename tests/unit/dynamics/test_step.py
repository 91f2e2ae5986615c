"""One step of the scheme with contact: the full solution, checked errors, and the state before left alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.contact.solve.forces import solve_contact
from fingerslip.contact.solve.newton import ContactSolution
from fingerslip.dynamics import condensation
from fingerslip.dynamics import step as step_module
from fingerslip.dynamics.motion import counterface_motion
from fingerslip.dynamics.simulation import step_times
from fingerslip.dynamics.step import advance, first_state
from fingerslip.dynamics.stepper import Stopwatch, build_steppers
from fingerslip.dynamics.system import build_system
from problems.blocks import ELEMENTS
from problems.pushed import push_and_slide, reference
from unit.dynamics.matrices import FACTORS


def test_a_step_leaves_the_state_before_as_it_was():
    model = push_and_slide(damping=fs.RayleighDamping(1.0, 1e-4))
    system = build_system(model)
    stepper = build_steppers([system], model.time, model.damping)[0]
    state = first_state(stepper)
    for number in range(1, 4):
        arrays = {name: value.copy() for name, value in vars(state).items() if isinstance(value, np.ndarray)}
        forces = state.interface.forces.copy()
        counterfaces = system.motions[0].displacement(np.array([number * 5e-3]))
        after = advance([stepper], [state], number * 5e-3, [counterfaces], Stopwatch())[0]
        for name, value in arrays.items():
            np.testing.assert_array_equal(getattr(state, name), value, err_msg=name)
        np.testing.assert_array_equal(state.interface.forces, forces)
        state = after


def test_the_first_acceleration_is_that_of_the_loads():
    """A free block under traction falls as a counterface: a = t A / m everywhere at the start."""
    model = push_and_slide(
        supports={}, contacts=(), programme=(), tractions={"left": (7.0, 0.0), "right": (7.0, 0.0)},
        time=fs.TimeStepping(1e-4, end=1e-3),
    )  # fmt: skip
    system = build_system(model)
    state = first_state(build_steppers([system], model.time, model.damping)[0])
    total = system.mass @ state.acceleration
    np.testing.assert_allclose(
        total.reshape(-1, 2).sum(axis=0), system.load(0.0).reshape(-1, 2).sum(axis=0), atol=1e-15
    )
    assert state.acceleration.any()


def test_unsolved_contact_is_an_error_that_says_when_where_and_how_badly(monkeypatch):
    calls = []

    def broken(compliance, free, friction, start, tolerance, *, working_set):
        calls.append(None)
        bad = 0.25 if len(calls) == 3 else 0.0
        return ContactSolution(np.zeros_like(free), bad, 7, 2), working_set

    monkeypatch.setattr(step_module, "solve_contact", broken)
    model = push_and_slide()
    with pytest.raises(fs.ConvergenceError) as caught:
        fs.simulate(model)
    error = caught.value
    assert error.time == pytest.approx(3 * 5e-3)
    assert error.node == build_system(model).candidates.nodes[2]
    assert error.residual == 0.25
    assert f"t = 0.015 s, node {error.node}: residual 2.50e-01, needs <= 1e-10; try a smaller time step" in str(error)


def test_a_residual_that_is_no_number_is_an_error_too(monkeypatch):
    def broken(compliance, free, friction, start, tolerance, *, working_set):
        return ContactSolution(np.full_like(free, np.nan), np.nan, 7, 0), working_set

    monkeypatch.setattr(step_module, "solve_contact", broken)
    with pytest.raises(fs.ConvergenceError):
        fs.simulate(push_and_slide())


@pytest.mark.parametrize("residual", [0.99e-10, 1.01e-10])
def test_the_residual_that_the_solver_states_decides(monkeypatch, residual):
    """The solver is asked for more than what a step has to have, and the forces themselves are not looked at."""
    asked = []

    def stated(compliance, free, friction, start, tolerance, *, working_set):
        asked.append(tolerance)
        solution, working_set = solve_contact(compliance, free, friction, start, tolerance, working_set=working_set)
        return replace(solution, residual=residual), working_set

    monkeypatch.setattr(step_module, "solve_contact", stated)
    if residual > 1e-10:
        with pytest.raises(fs.ConvergenceError):
            fs.simulate(push_and_slide())
    else:
        assert fs.simulate(push_and_slide())["normal_traction"].values.any()
    assert set(asked) == {1e-12}


def march(model):
    """Yield (all displacements, velocities, accelerations, interface) at every time."""
    system = build_system(model)
    stepper = build_steppers([system], model.time, model.damping)[0]
    times = step_times(model)
    counterfaces = system.motions[0].displacement(times)
    state, watch = first_state(stepper), Stopwatch()
    for number, time in enumerate(times):
        state = advance([stepper], [state], time, [counterfaces[number : number + 1]], watch)[0] if number else state
        fields = np.zeros((3, system.space.n_dofs))
        fields[:, system.free] = state.displacement, state.velocity, state.acceleration
        yield fields, system.candidates.nodes, state.interface


@pytest.mark.parametrize("factor", FACTORS)
@pytest.mark.parametrize("element", ELEMENTS)
def test_condensed_solution_is_the_full_solution(element, factor, monkeypatch):
    """Tolerance 1e-9 of the largest value of each field: rounding alone, amplified by 1/(beta h^2) in accelerations."""
    monkeypatch.setattr(condensation, "factorise", factor)
    penalty = 1e8
    contact = fs.Contact(
        boundary="bottom",
        friction=fs.Coulomb(0.4),
        normal_penalty=penalty,
        tangential_penalty=penalty,
        search_distance=1.0,
    )
    model = push_and_slide(element, damping=fs.RayleighDamping(2.0, 1e-4), contacts=(contact,))
    counterfaces = counterface_motion(model.programme, contact.counterface).displacement(step_times(model))
    expected = list(reference(model, counterfaces, penalty))
    found = list(march(model))
    for number, name in enumerate(("displacement", "velocity", "acceleration")):
        full = np.array([getattr(state, name) for state in expected])
        condensed = np.array([fields[number] for fields, _, _ in found])
        error = np.abs(condensed - full).max() / np.abs(full).max()
        assert error <= 1e-9, f"{name}: {error:.1e}"
    forces = np.array([state.forces for state in expected])
    own = np.array([interface.forces for _, _, interface in found])
    assert np.abs(own - forces).max() <= 1e-9 * np.abs(forces).max()
    states = np.array([interface.state for _, _, interface in found])
    assert {0, 1, 2} <= set(states.ravel().tolist()), "the run must see open, sticking and slipping nodes"
    assert (states[-1] != 1).all(), "and end with overall slip"


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
        state = advance([stepper], [state], number * 1e-3, [np.zeros((0, 2))], watch)[0]
        momentum = (system.mass @ state.velocity)[::2].sum()
        place = (system.mass @ state.displacement)[::2].sum()
        assert momentum == pytest.approx(total * acceleration * state.time, rel=1e-9)
        assert place == pytest.approx(total * acceleration * state.time**2 / 2, rel=1e-9)
