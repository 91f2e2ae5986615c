"""Factors are kept until steps with them have cost more than new ones, and exist for indefinite tangents too."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.dynamics.finite import factors as module
from unit.dynamics.finite.blocks import block, prepared


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
