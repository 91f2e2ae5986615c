"""The prediction of a step: the free end, and the right-hand side from its definition."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.step.prediction import predict
from problems.pushed import push_and_slide
from problems.verification.reference import condensed_states, make_stepper


@pytest.mark.parametrize("alpha", [0.0, -0.2])
@pytest.mark.parametrize("damping", [fs.RayleighDamping(), fs.RayleighDamping(2.0, 1e-4)])
def test_the_right_hand_side_is_that_of_the_scheme(alpha, damping):
    """b = (1 + alpha) (f - C v~ - K u~) + alpha F_0 with dense matrices, in the middle of a press."""
    model = push_and_slide(alpha=alpha, damping=damping, tractions={"left": (3.0, 0.0)})
    stepper = make_stepper(model)
    state = [state for state, _ in zip(condensed_states(stepper, model), range(12), strict=False)][-1]
    shift = np.array([[0.0, 3e-4]])
    (start,) = predict([stepper], [state], 0.06, [shift])
    mass, stiffness = stepper.system.mass.toarray(), stepper.system.stiffness.toarray()
    free = stepper.scheme.predict(state.displacement, state.velocity, state.acceleration)
    force = (damping.mass * mass + damping.stiffness * stiffness) @ free.velocity + stiffness @ free.displacement
    expected = (1.0 + alpha) * (stepper.system.load(0.06) - force) + alpha * state.unbalance
    np.testing.assert_allclose(start.right_hand_side, expected, atol=1e-12 * np.abs(expected).max())
    moved = (stepper.system.relative @ free.displacement).reshape(-1, 2) - shift
    np.testing.assert_array_equal(start.moved, moved)
    assert (start.time, start.before) == (0.06, state)
