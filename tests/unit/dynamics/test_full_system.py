"""The condensed solver must be the full solver: compared with an independent one over a whole press-and-slide."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics import condensation
from fingerslip.dynamics.factor import PardisoFactor, SuperLUFactor, pardiso_available
from fingerslip.dynamics.motion import body_motion
from fingerslip.dynamics.simulate import step_times
from fingerslip.dynamics.step import Stopwatch, advance, build_stepper, first_state
from fingerslip.dynamics.system import build_system
from problems.blocks import ELEMENTS
from problems.pushed import push_and_slide, reference

FACTORS = [
    pytest.param(PardisoFactor, marks=pytest.mark.skipif(not pardiso_available(), reason="MKL is not installed")),
    SuperLUFactor,
]


def march(model):
    """Yield (all displacements, velocities, accelerations, interface) at every time."""
    system = build_system(model)
    stepper = build_stepper(system, model.time, model.damping)
    times = step_times(model)
    bodies = system.motions[0].displacement(times)
    state, watch = first_state(stepper), Stopwatch()
    for number, time in enumerate(times):
        state = advance(stepper, state, time, bodies[number : number + 1], watch) if number else state
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
        boundary="bottom", friction=fs.Coulomb(0.4), normal_penalty=penalty, tangential_penalty=penalty, reach=1.0
    )
    model = push_and_slide(element, damping=fs.RayleighDamping(2.0, 1e-4), contacts=(contact,))
    bodies = body_motion(model.programme, contact.body).displacement(step_times(model))
    expected = list(reference(model, bodies, penalty))
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
