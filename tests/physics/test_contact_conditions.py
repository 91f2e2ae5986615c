"""One step after the other through `advance`: unilateral contact with Coulomb friction holds, or the step is refused.

The body is any symmetric positive definite stiffness whose degrees of freedom are those of the contact nodes. The
conditions are checked on what a user sees, displacements and contact forces, and not on the solver's own residual.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

import fingerslip as fs
from fingerslip.contact.candidates import Candidates, Surfaces
from fingerslip.dynamics.loads import Load
from fingerslip.dynamics.step import Stopwatch, advance, build_stepper, first_state
from fingerslip.dynamics.system import System
from fingerslip.errors import ConvergenceError
from fingerslip.model import Ramp
from problems.contact import body_compliance, broken_conditions, free_motion, penalty_compliances, shapes

TOLERANCE = 1e-10
SLIDING = {"count": 4, "body": "full rank", "drive": "sliding", "decade": -2, "spread": 0.0, "friction": 0.5}
STEPS = 3


def system_of(body, penalties, loads, friction, dim):
    """Return a system whose unknowns are the displacements of its contact nodes over a plate at rest."""
    size, count = len(body), len(body) // dim
    stiffness = np.linalg.inv(body)
    nodes = np.arange(count)
    candidates = Candidates(
        nodes=nodes,
        body=np.zeros(count, dtype=np.int64),
        positions=np.column_stack([nodes] * (dim - 1) + [0.0 * nodes]).astype(float),
        area=np.ones(count),
        normal_stiffness=1.0 / penalties[:, 0],
        tangential_stiffness=1.0 / penalties[:, 1],
    )
    plate = fs.Plane((0.0,) * (dim - 1) + (1.0,), offset=0.0)
    return System(
        space=SimpleNamespace(dim=dim),
        constants=None,
        free=np.arange(size),
        driven=np.zeros(0, dtype=np.int64),
        stiffness=sparse.csr_matrix(0.5 * (stiffness + stiffness.T)),
        mass=sparse.csr_matrix(sparse.eye(size)),
        loads=loads,
        initial_velocity=np.zeros(size),
        candidates=candidates,
        surfaces=Surfaces((plate,), (fs.Coulomb(friction),)),
        relative=sparse.csr_matrix(sparse.eye(size)),
        outsiders=(),
        motions=(),
        site_nodes=np.zeros(0, dtype=np.int64),
    )


def loads_of(motions, body):
    """Return loads that bring the body, were there no plate, to each motion (count, dim) at the times 1, 2, ..."""
    stiffness = np.linalg.inv(body)
    hats = [Ramp((number, number + 1.0, number + 2.0), (0.0, 1.0, 0.0)) for number in range(len(motions))]
    # The normal comes last in global components.
    return tuple(
        Load(stiffness @ np.roll(motion, -1, axis=1).ravel(), hat) for motion, hat in zip(motions, hats, strict=True)
    )


def steps_of(*, seed, dim, count, body, drive, decade, spread, friction):
    """Yield the system with the states before and after each step."""
    rng = np.random.default_rng(seed)
    matrix = body_compliance(body, count * dim, rng)
    penalties = penalty_compliances(decade, spread, count, dim, rng)
    motions = [free_motion(drive, count, dim, rng) for _ in range(STEPS)]
    system = system_of(matrix, penalties, loads_of(motions, matrix), friction, dim)
    stepper = build_stepper(system, fs.QuasiStatic(1.0), fs.RayleighDamping())
    state = first_state(stepper)
    for number in range(STEPS):
        after = advance(stepper, state, number + 1.0, np.zeros((0, dim)), Stopwatch())
        yield system, matrix, state, after
        state = after


def marched(problem):
    """Return the steps that were solved, and whether the next one was refused."""
    steps = []
    try:
        steps.extend(steps_of(**problem))
    except ConvergenceError:
        return steps, True
    return steps, False


def broken_by(system, matrix, before, after):
    """Return which conditions a step breaks, with gaps and slips from the displacements of the body."""
    dim = system.space.dim
    candidates, forces = system.candidates, after.contact_forces
    normal, tangential = forces[:, -1], forces[:, :-1]
    moved = after.displacement.reshape(-1, dim)
    gap = moved[:, -1] + normal / candidates.normal_stiffness
    change = (moved - before.displacement.reshape(-1, dim))[:, :-1]
    slip = change + (tangential - before.contact_forces[:, :-1]) / candidates.tangential_stiffness[:, None]
    force = 100 * TOLERANCE * np.abs(forces).max()
    own = np.diag(matrix).reshape(-1, dim).max(axis=1)
    own += 1.0 / np.minimum(candidates.normal_stiffness, candidates.tangential_stiffness)
    # Rounding of the body's own solution, which its condition number amplifies.
    largest = np.maximum(np.abs(before.displacement).max(), np.abs(after.displacement).max())
    rounding = 1e-15 * np.linalg.cond(matrix) * largest
    coefficients = np.full(len(forces), system.surfaces.friction[0].coefficient)
    return broken_conditions(normal, tangential, gap, slip, coefficients, force, force * own + rounding)


@settings(max_examples=300, derandomize=True)
@given(**shapes(15))
def test_every_step_keeps_the_contact_conditions_or_is_refused(**problem):
    steps, refused = marched(problem)
    for system, matrix, before, after in steps:
        assert after.residual <= TOLERANCE
        broken = broken_by(system, matrix, before, after)
        assert not broken, f"{', '.join(broken)} in the step to {after.time:g} s"
        load = system.load(after.time)
        scale = np.abs(load).max() + np.abs(after.contact_forces).max()
        expected = after.contact_forces.ravel()
        np.testing.assert_allclose(system.stiffness @ after.displacement - load, expected, atol=1e-9 * scale)
    # A soft motion in an arbitrary direction may be refused, also without friction.
    assert not refused or problem["friction"] > 0.3 or problem["body"] == "rigid motion"


@pytest.mark.parametrize("body", ["full rank", "spread", "nearly singular"])
@pytest.mark.parametrize("friction", [0.0, 0.5, 1.0])
def test_refusals_are_rare_at_the_friction_of_skin(body, friction):
    shape = {"count": 8, "body": body, "drive": "random", "decade": -3, "spread": 2.0, "friction": friction}
    refused = [marched({"seed": seed, "dim": 2 + seed % 2} | shape)[1] for seed in range(20)]
    assert np.mean(refused) <= 0.1


@given(st.integers(0, 1000), st.sampled_from([2, 3]))
@settings(max_examples=30, derandomize=True)
def test_wrong_forces_break_the_conditions(seed, dim):
    """The check itself can fail: too much friction, friction along the slip, adhesion, or forces on open nodes."""
    last = marched(SLIDING | {"seed": seed, "dim": dim})[0][-1]
    system, matrix, before, after = last
    assert not broken_by(*last)
    forces = after.contact_forces
    changed = {
        "beyond the cone": forces * np.array([1.1] * (dim - 1) + [1.0]),
        "along the slip": forces * np.array([-1.0] * (dim - 1) + [1.0]),
        "adhesion": -forces,
        "elsewhere": forces + np.abs(forces).max(),
    }
    for name, wrong in changed.items():
        assert broken_by(system, matrix, before, replace(after, contact_forces=wrong)), name
