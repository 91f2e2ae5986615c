"""What a deformed body says of its volume, and what it carries along."""

from __future__ import annotations

import numpy as np
import pytest

from unit.fe.finite.bodies import EVERY, KINDS, SOFT, body, moved
from unit.fe.finite.relaxing import STEP, relaxing_body, stepped


@EVERY
def test_volumes_are_the_determinants_of_the_deformation(element, integration, formulation):
    bulk = body(element, integration, formulation)
    state = bulk.deformed(moved(bulk, 0.03))
    np.testing.assert_allclose(state.volume, np.linalg.det(state.deformation))
    np.testing.assert_allclose(np.exp(state.log_volume), state.volume)


def test_an_elastic_body_carries_nothing():
    bulk = body("Q4", law=SOFT)
    state = bulk.deformed(moved(bulk, 0.02))
    assert (state.left, state.pulled, state.history) == (None, None, None)


@pytest.mark.parametrize("kind", KINDS, ids="-".join)
def test_iterates_of_a_step_carry_what_its_start_left(kind):
    bulk = relaxing_body(kind)
    begun = bulk.begun(stepped(bulk), STEP)
    one = bulk.deformed(moved(bulk, 0.02), begun)
    other = bulk.deformed(moved(bulk, 0.03), one)
    assert begun.left is one.left is other.left
    assert begun.history is one.history is other.history
    assert not np.allclose(one.pulled, other.pulled)
