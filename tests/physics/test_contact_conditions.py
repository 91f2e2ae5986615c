"""Signorini's and Coulomb's conditions, one by one and to the stated residual, on problems of every kind.

What the residual means for gaps and slips is in :mod:`problems.contact`. An answer that is not solved may be anything,
but its stated residual must say so: then a step raises.
"""

import contextlib
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.verification.blocks import block_on_plate
from fingerslip.verification.meshes import axes_of
from problems.contact import TOLERANCE, Problem, assert_conditions, assert_coulomb
from problems.verification.condensed import condensed_states, make_stepper

MOTIONS = {
    "any": lambda rng, shape: rng.normal(size=shape),
    "open": lambda rng, shape: np.abs(rng.normal(size=shape)) + np.eye(1, shape[1]),
    "pressed": lambda rng, shape: 0.1 * rng.normal(size=shape) - np.eye(1, shape[1]),
    "dragged": lambda rng, shape: 0.1 * rng.normal(size=shape) - np.eye(1, shape[1]) + 30 * np.eye(1, shape[1], 1),
}


def made(seed, dim, count, *, decades, friction, motion):
    """Return a problem whose body has eigenvalues over `decades`, with penalties over six decades node by node."""
    rng = np.random.default_rng(seed)
    vectors = np.linalg.qr(rng.normal(size=(count * dim, count * dim)))[0]
    body = (vectors * 10.0 ** rng.uniform(-decades, 0.0, count * dim)) @ vectors.T
    penalty = 10.0 ** np.repeat(rng.uniform(-6.0, 0.0, (count, 2)), [1, dim - 1], axis=1)
    coefficients = friction * rng.uniform(0.5, 1.0, count)
    return Problem(0.5 * (body + body.T), penalty, MOTIONS[motion](rng, (count, dim)), coefficients)


def problems(most, motions=tuple(MOTIONS)):
    return st.builds(
        made,
        seed=st.integers(0, 2**31),
        dim=st.sampled_from([2, 3]),
        count=st.integers(1, 12),
        decades=st.floats(0.0, 14.0),
        friction=st.sampled_from([0.0, 0.3, most]) | st.floats(0.0, most),
        motion=st.sampled_from(motions),
    )


@settings(max_examples=300, deadline=None, derandomize=True)
@given(problems(5.0))
def test_every_answer_is_as_good_as_it_says(problem):
    solution = problem.solution()
    assert np.isfinite(solution.forces).all()
    assert_conditions(problem, solution)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(problems(0.9, ("any", "open", "pressed")))
def test_ordinary_friction_is_solved_however_bad_the_matrix(problem):
    """But for bodies of arbitrary coupling that are dragged far: of those about one in 400 is not."""
    assert problem.solution().residual <= TOLERANCE


@settings(max_examples=50, deadline=None, derandomize=True)
@given(problems(5.0, ("open",)))
def test_nodes_that_are_open_stay_free(problem):
    solution = problem.solution()
    assert solution.residual == 0.0
    assert not solution.forces.any()


WRONG = {
    "tension": [-1.0, 1.0, 1.0],
    "too much friction": [1.0, 1.001, 1.001],
    "turned": [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
    "half the force": [0.5, 0.5, 0.5],
    "let go": [0.0, 0.0, 0.0],
}


@pytest.mark.parametrize("change", WRONG.values(), ids=WRONG)
def test_the_conditions_refuse_wrong_answers(change):
    """Each changes one node of a right answer in one way; the stated residual stays as it was."""
    problem = made(3, 3, 6, decades=2.0, friction=0.5, motion="dragged")
    right = problem.solution()
    assert_conditions(problem, right)
    forces = right.forces.copy()
    node = int(np.argmax(forces[:, 0]))
    factors = np.array(change)
    forces[node] = factors * forces[node] if factors.ndim == 1 else forces[node] @ factors
    with pytest.raises(AssertionError):
        assert_conditions(problem, type(right)(forces, right.residual, right.iterations, right.worst))


def pressed_block(element, friction, penalties):
    """Return a block that is pressed and dragged in long steps."""
    grid, names = np.linspace(0.0, 8e-3, 5), ("normal_penalty", "tangential_penalty")
    return block_on_plate(
        element,
        *((grid, grid[:2], grid[:3]) if element == "H8" else (grid, grid[:3])),
        material=fs.Elastic(34e3, 0.4, 1000.0),
        plate={"friction": fs.Coulomb(friction), **dict(zip(names, penalties, strict=True))},
        supports={"top": axes_of(element)},
        programme=(fs.Press(0.4e-3, 4e-3), fs.Slide(1.6e-3, 8e-3)),
        time=fs.TimeStepping(0.02),
    )


def states(model):
    """Yield the state before and after every step, until the end or until a step is not solved."""
    stepper = make_stepper(model)
    with contextlib.suppress(fs.ConvergenceError):
        for before, after in pairwise(condensed_states(stepper, model)):
            yield stepper.system.candidates, before.interface, after.interface


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    st.sampled_from(["Q4", "T6", "H8"]),
    st.sampled_from([0.0, 0.5, 5.0]) | st.floats(0.0, 5.0),
    st.tuples(st.floats(4.0, 10.0), st.floats(4.0, 10.0)),
)
def test_a_step_keeps_the_conditions_or_raises(element, friction, decades):
    """Penalties over six decades; gap and slip of the recorded interface, not of the problem that was solved."""
    model = pressed_block(element, friction, tuple(10.0**decade for decade in decades))
    for candidates, before, after in states(model):
        force, length = np.abs(after.forces).max(), 1e-3
        normal, gap = after.forces[:, 0], after.relative[:, 0]
        law = candidates.normal_stiffness * np.maximum(-gap, 0.0)
        close = 1e-8 * force + 1e-12 * length * candidates.normal_stiffness
        assert (normal >= 0.0).all()
        assert (np.abs(normal - law) <= close).all()
        stiffness = candidates.tangential_stiffness
        traction = after.forces[:, 1:]
        elastic = (traction - before.forces[:, 1:]) / stiffness[:, None]
        slip = (after.relative - before.relative)[:, 1:] + elastic
        for node in np.flatnonzero(normal > 0.0):
            margin = 1e-8 * force + 1e-12 * length * stiffness[node]
            assert_coulomb(traction[node], slip[node] * stiffness[node], friction * normal[node], margin)
