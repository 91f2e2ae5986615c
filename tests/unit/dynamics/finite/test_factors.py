"""Factors are kept until steps with them have cost more than new ones, and exist for indefinite tangents too."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from fingerslip.dynamics.finite import factors as module
from fingerslip.dynamics.finite.newton import advance_finite
from fingerslip.errors import FingerslipError
from fingerslip.linear.solvers.superlu import SuperLU
from unit.dynamics.finite.blocks import block, prepared

NONE = np.zeros((0, 2))


def test_factors_are_kept_while_steps_stay_as_short():
    factors, state = prepared(block())
    first = factors.at(state.body)
    for _ in range(100):
        factors.used(3)
    assert factors.at(state.body) is first
    assert factors.count == 1


def test_factors_are_renewed_where_they_have_cost_more_than_new_ones():
    factors, state = prepared(block())
    first = factors.at(state.body)
    factors.used(2)
    for _ in range(module._COST[2] // 4):
        factors.used(6)
    assert factors.at(state.body) is first
    factors.used(6)
    assert factors.at(state.body) is not first
    assert factors.count == 2


def test_an_indefinite_tangent_still_gives_factors():
    """Under a quarter of their height, all cells would rather turn."""
    factors, state = prepared(block(element="T6"))
    system = factors.system
    crushed = np.zeros(system.mass.shape[0])
    places = system.space.positions.ravel()[system.free]
    upright = system.free % 2 == 1
    crushed[: system.free.size][upright] = -0.75 * places[upright]
    crushed[system.free.size :] = -0.75
    body = system.require_body().at(crushed)
    tangent = system.require_body().tangent(body).toarray()
    assert np.linalg.eigvalsh(tangent)[0] < 0.0
    stepper = factors.renew(body)
    assert stepper.system is system
    assert factors.count == 2
    solved = stepper.condensed.backward(stepper.condensed.forward(np.ones(len(crushed))), np.zeros(0))
    assert np.isfinite(solved).all()
    assert state.body is not None


def test_new_factors_are_those_of_the_middle_of_their_time():
    factors, state = prepared(block())
    velocity = np.zeros_like(state.displacement)
    velocity[0] = 1e-3 / factors.scheme.step
    for iterations in (2, *[2] * 8, 100):
        factors.used(iterations)
    factors.at(state.body, velocity)
    body, positive, _ = factors.made_of
    assert not positive
    assert body.displacement[0] == pytest.approx(state.displacement[0] + 5 * 1e-3)
    assert factors.count == 2


def test_factors_look_no_further_than_cells_let_them():
    factors, state = prepared(block())
    factors.used(2)
    factors.used(100)
    factors.at(state.body, np.random.default_rng(0).normal(size=state.displacement.size) / factors.scheme.step)
    assert factors.made_of.body is state.body


class Rough:
    """A solver whose rough factors are those of a matrix in which each unknown is wrong by up to a factor."""

    def __init__(self, wrong):
        self.exact, self.wrong, self.made = SuperLU(), wrong, 0

    def series(self):
        return self.exact

    def rough(self):
        return self

    def factorise(self, matrix):
        self.made += 1
        if self.wrong is None:
            raise FingerslipError("the matrix is not positive definite")
        wrong = sparse.diags(self.wrong ** np.random.default_rng(0).uniform(-1.0, 1.0, matrix.shape[0]))
        return self.exact.factorise(sparse.csr_matrix(wrong @ matrix @ wrong))


def test_rough_factors_are_replaced_in_a_step_that_they_do_not_solve():
    model = block(0.02, steps=1)
    ends = []
    for wrong, serves in ((1.0, True), (1.01, True), (5.0, False)):
        factors, state = prepared(model, solver=Rough(wrong))
        ends.append(advance_finite(factors, state, 1.0, NONE, watch=factors.watch)[0].displacement)
        assert (factors.count == 1) == serves
        assert factors.made_of.rough == serves
        assert factors.solver.made == 1
    np.testing.assert_allclose(ends[1:], [ends[0]] * 2, atol=1e-6)


def test_exact_factors_are_taken_where_rough_ones_cannot_be_made():
    factors, _ = prepared(block(), solver=Rough(None))
    assert not factors.made_of.rough
    assert np.isfinite(factors.current.condensed.forward(np.ones(factors.system.mass.shape[0])).vector).all()


@pytest.mark.parametrize("rough", [True, False])
def test_saved_factors_are_made_again_as_they_were(rough):
    factors, state = prepared(block(), solver=Rough(3.0))
    factors.renew(state.body, rough=rough)
    again, _ = prepared(block(), solver=Rough(3.0))
    again.restore(*factors.saved_state())
    assert again.made_of.rough == rough
    right = np.ones(state.displacement.size)
    one, other = (own.current.condensed for own in (factors, again))
    nothing = np.zeros(0)
    np.testing.assert_array_equal(
        one.backward(one.forward(right), nothing), other.backward(other.forward(right), nothing)
    )
