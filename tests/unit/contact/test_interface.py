"""The contact law over steps: stick, slip, reversal, landing, and its energies."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerslip import history
from fingerslip.contact.candidates import Candidates
from fingerslip.contact.interface import conditions, contact_problem, rest_state, settle
from fingerslip.contact.solve.newton import solve_friction
from fingerslip.contact.states import OPEN, SLIP, STICK

NORMAL, TANGENTIAL, MU = 400.0, 100.0, 0.5


def candidates(count=1):
    full = np.full(count, 1.0)
    return Candidates(
        nodes=np.arange(count),
        counterface=np.zeros(count, dtype=np.int64),
        positions=np.zeros((count, 2)),
        area=full,
        normal_stiffness=NORMAL * full,
        tangential_stiffness=TANGENTIAL * full,
    )


def move(nodes, before, relative, mu=MU):
    """Take a rigid skin to given gaps and tangential positions: only the penalties give way."""
    relative = np.atleast_2d(np.asarray(relative, dtype=float))
    free = contact_problem(relative, before.forces, before.relative, nodes.tangential_stiffness)
    penalties = np.column_stack([nodes.normal_stiffness, nodes.tangential_stiffness]).ravel()
    coefficients = np.full(len(nodes.nodes), mu)
    solution = solve_friction(np.diag(1.0 / penalties), free, coefficients, before.forces, 1e-13)
    assert solution.residual <= 1e-13
    work = -0.5 * float(np.sum((before.forces + solution.forces) * (relative - before.relative)))
    stretch = np.ones((len(nodes.nodes), 1))
    return settle(
        nodes, before, solution.forces, relative, friction_coefficient=coefficients, stretch=stretch, work=work
    )


def follow(path, mu=MU, gap=0.0):
    """Return the outcomes of a path of (gap, tangential position)."""
    nodes = candidates()
    state, outcomes = rest_state(nodes, np.array([gap])), []
    for relative in path:
        outcomes.append(move(nodes, state, relative, mu))
        state = outcomes[-1].state
    return outcomes


def test_at_rest_and_open_a_node_has_no_force_and_no_slip_nor_traction_without_friction_and_states_are_numbers():
    state = rest_state(candidates(3), np.full(3, 0.2))
    np.testing.assert_array_equal(state.relative, [[0.2, 0.0]] * 3)
    assert not state.forces.any()
    assert (state.state == OPEN).all()
    outcome = follow([(0.1, 0.0), (0.1, 5.0)], gap=0.1)[-1]
    assert outcome.state.state[0] == OPEN
    assert not outcome.state.forces.any()
    assert (outcome.state.slip_distance[0], outcome.stored, outcome.friction) == (0.0, 0.0, 0.0)
    smooth = follow([(-0.01, 0.0), (-0.01, 0.05)], mu=0.0)[-1]
    assert (smooth.state.forces[0, 1], smooth.friction) == (0.0, 0.0)
    assert (OPEN, STICK, SLIP) == (history.OPEN, history.STICK, history.SLIP) == (0, 1, 2)
    assert history.VARIABLES["contact_state"].long_name == "0 open, 1 stick, 2 slip"


@pytest.mark.parametrize(
    ("path", "states", "forces", "slips"),
    [
        # Two springs, whose force unloads until it is at the limit.
        ([(-0.01, 0.0), (-0.01, 0.015), (-0.01, 0.018), (-0.005, 0.018)], [STICK, STICK, STICK, SLIP],
         [[4.0, 0.0], [4.0, -1.5], [4.0, -1.8], [2.0, -1.0]], [0.0, 0.0, 0.0, 0.008]),
        # The elastic slip at the limit of 2 N is 0.02. On the way back the last but one comes to it, and does not slip.
        ([(-0.01, 0.0), (-0.01, 0.05), (-0.01, 0.03), (-0.01, 0.01), (-0.01, 0.0)], [STICK, SLIP, STICK, STICK, SLIP],
         [[4.0, 0.0], [4.0, -2.0], [4.0, 0.0], [4.0, 2.0], [4.0, 2.0]], [0.0, 0.03, 0.03, 0.03, 0.04]),
    ],
    ids=["unloaded", "reversed"],
)  # fmt: skip
def test_a_node_sticks_by_two_springs_and_returns_to_the_cone(path, states, forces, slips):
    """Stored is what the springs hold, and slip costs the limit times its way; many steps make the way of one."""
    outcomes = follow(path)
    after = [outcome.state for outcome in outcomes]
    assert [int(state.state[0]) for state in after] == states
    np.testing.assert_allclose([state.forces[0] for state in after], forces, atol=1e-12)
    np.testing.assert_allclose([state.slip_distance[0] for state in after], slips, atol=1e-13)
    stored = 0.5 * np.square(forces) @ [1.0 / NORMAL, 1.0 / TANGENTIAL]
    np.testing.assert_allclose([outcome.stored for outcome in outcomes], stored, rtol=1e-12)
    cost = np.abs(forces)[1:, 1] * np.diff(slips)
    np.testing.assert_allclose([outcome.friction for outcome in outcomes[1:]], cost, atol=1e-14)
    often = follow([*path[:1], *((path[1][0], x) for x in np.linspace(path[0][1], path[1][1], 51))])
    np.testing.assert_allclose(often[-1].state.forces[0], forces[1], rtol=1e-12)
    assert sum(outcome.friction for outcome in often) == pytest.approx(cost[0], abs=1e-12)


def test_slip_since_contact_is_kept_where_the_node_sticks_and_starts_again_where_it_leaves():
    slipping = [(-0.01, 0.0), (-0.01, 0.05), (-0.01, 0.06)]
    reversed_lifted_and_landed = [(-0.01, 0.05), (-0.01, 0.0), (0.01, 0.0), (-0.01, 0.3), (-0.01, 0.4)]
    states = [outcome.state for outcome in follow(slipping + reversed_lifted_and_landed)]
    assert [int(state.state[0]) for state in states] == [STICK, SLIP, SLIP, STICK, SLIP, OPEN, SLIP, SLIP]
    since = [float(state.slip_since_contact[0]) for state in states]
    np.testing.assert_allclose(since, [0, 0.03, 0.04, 0.04, 0.06, 0, 0, 0.1], atol=1e-12)
    np.testing.assert_allclose(states[-1].slip_distance, 0.03 + 0.01 + 0.02 + 0.1, rtol=1e-12)


def test_laws_see_pressure_and_slip_of_the_last_step_and_the_time_of_the_next():
    nodes = replace(candidates(), area=np.array([2.0]))
    before = follow([(-0.01, 0.0), (-0.01, 0.05), (-0.01, 0.06)])[-1].state
    seen = conditions(nodes, before, step=0.25, time=3.0)
    assert (seen.pressure[0], seen.time) == (2.0, 3.0)
    np.testing.assert_allclose([seen.slip_rate[0], seen.slip_since_contact[0]], [0.04, 0.04], rtol=1e-12)
    assert conditions(nodes, before, step=0.0, time=0.1).slip_rate.tolist() == [0.0], "before the first step"


def test_a_node_that_leaves_and_lands_elsewhere_starts_afresh():
    """What it moved by in the air is no slip, be it before the first contact or after another one."""
    left, landed = follow([(-0.01, 0.05), (0.01, 0.5), (-0.01, 0.5)])[1:]
    assert not left.state.forces.any()
    np.testing.assert_allclose(landed.state.forces[0], [4.0, 0.0], atol=1e-12)
    assert landed.state.slip_distance[0] == left.state.slip_distance[0]
    first = follow([(0.01, 0.0), (-0.01, 5.0)], gap=0.01)[-1].state
    assert (first.forces[0, 0], first.slip_distance[0]) == (pytest.approx(4.0), 0.0)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.lists(st.tuples(st.floats(-0.02, 0.01), st.floats(-0.1, 0.1)), min_size=1, max_size=8), st.floats(0.0, 2.0))
def test_friction_only_dissipates_and_the_work_adds_up(path, mu):
    nodes = candidates()
    before = rest_state(nodes, np.zeros(1))
    stored = 0.0
    for relative in path:
        copies = {name: value.copy() for name, value in vars(before).items()}
        outcome = move(nodes, before, relative, mu)
        after = outcome.state
        assert all(np.array_equal(getattr(before, name), value) for name, value in copies.items())
        assert outcome.friction >= -1e-14
        mean = 0.5 * (before.forces + after.forces)
        work = -float(np.sum(mean * (after.relative - before.relative)))
        assert outcome.stored - stored + outcome.friction + outcome.numerical == pytest.approx(work, abs=1e-13)
        assert after.slip_distance[0] >= before.slip_distance[0]
        limit = mu * after.forces[0, 0]
        assert abs(after.forces[0, 1]) <= limit * (1 + 1e-12) + 1e-15
        assert (after.state[0] == OPEN) == (after.forces[0, 0] == 0.0)
        before, stored = after, outcome.stored
