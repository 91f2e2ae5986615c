"""Dashpots at quadrature points follow the closed forms of their recurrence, material by material."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.fe.finite.history import PACKED, selective_excess
from fingerslip.materials.prony import recurrence
from fingerslip.materials.relaxing import Constants
from unit.fe.finite.bodies import KINDS, SOFT, body, moved
from unit.fe.finite.relaxing import STEP, TERMS, relaxing_body, stepped


def test_an_elastic_body_has_no_history():
    bulk = body("Q4", law=SOFT)
    assert bulk.relaxation is None
    state = bulk.at_rest(STEP)
    assert (state.left, state.history) == (None, None)
    assert bulk.begun(state, STEP) is state
    assert bulk.ended(state) is state


@pytest.mark.parametrize("kind", KINDS, ids="-".join)
def test_dashpots_follow_what_is_remembered(kind):
    """All that is remembered obeys the recurrence of its material; the elastic half has no dashpots."""
    bulk = relaxing_body(kind)
    states = [stepped(bulk, steps) for steps in (1, 2, 3)]
    follow = recurrence(TERMS, STEP)
    near = bulk.relaxation.points == 0
    values = np.stack([np.zeros_like(states[0].history.points), *(state.history.points for state in states)])
    np.testing.assert_allclose(
        states[-1].history.point_dashpots[:, near], follow.follow(values[:, near])[:, -1], atol=1e-12
    )
    assert not states[-1].history.point_dashpots[:, ~near].any()
    own = bulk.relaxation.groups == 0
    means = np.stack([np.zeros_like(states[0].history.groups), *(state.history.groups for state in states)])
    np.testing.assert_allclose(states[-1].history.group_dashpots[:, own], follow.follow(means[:, own])[:, -1])


@pytest.mark.parametrize("kind", KINDS, ids="-".join)
def test_sizes_and_what_a_step_finds_at_rest(kind):
    bulk = relaxing_body(kind)
    rest, dim = bulk.at_rest(STEP), bulk.space.dim
    assert rest.history.points.shape == (bulk.weights.size, PACKED[dim] + 3)
    assert rest.history.point_dashpots.shape[0] == len(TERMS)
    assert rest.left.terms.taken == pytest.approx([recurrence(TERMS, STEP).shares @ recurrence(TERMS, STEP).end, 0.0])
    for left in (rest.left.points, rest.left.groups, rest.left.offsets, rest.left.group_offsets, rest.pulled):
        assert not left.any()
    assert rest.left.moduli[1] == pytest.approx(0.0, abs=1e-12)


def test_halved_steps_have_their_own_weights_and_the_state_keeps_its_history():
    bulk = relaxing_body(("H8", "selective", "solid"))
    state = stepped(bulk)
    whole, half = bulk.begun(state, STEP), bulk.begun(state, STEP / 2)
    assert half.left.terms.taken[0] < whole.left.terms.taken[0]
    assert whole.history is half.history is state.history
    ended = bulk.ended(bulk.deformed(moved(bulk, 0.02), whole))
    assert ended.history is not state.history
    np.testing.assert_array_equal(state.history.points, stepped(bulk).history.points)


def test_two_halves_are_nearly_a_step():
    """Strain is linear within a step: with the middle on the line, halves differ by what the law is nonlinear."""
    bulk = relaxing_body(("Q4", "full", "plane_strain"))
    start, at = bulk.at_rest(STEP), moved(bulk, 1e-4)
    whole = bulk.ended(bulk.deformed(at, bulk.begun(start, STEP)))
    middle = bulk.ended(bulk.deformed(at / 2, bulk.begun(start, STEP / 2)))
    halves = bulk.ended(bulk.deformed(at, bulk.begun(middle, STEP / 2)))
    scale = np.abs(bulk.force(whole)).max()
    np.testing.assert_allclose(bulk.force(halves), bulk.force(whole), atol=1e-3 * scale)


def test_selective_excess_is_none_at_once_and_the_relaxed_energy_in_the_end():
    """In 3D K x^2/2 - G/3 x^2 with what is left of G; in plane stress with the strain across eliminated."""
    constants = Constants(2.0, 10.0, 0.4, TERMS)
    along = np.array([[0.1, 0.0], [-0.2, 0.0]])
    modulus, left = 10.0 - 4.0 / 3.0, 1.0 - sum(term.share for term in TERMS)
    nothing = [np.zeros_like(along)] * len(TERMS)
    np.testing.assert_allclose(selective_excess(constants, modulus, along, nothing), 0.0, atol=1e-15)
    relaxed = selective_excess(constants, modulus, along, [along] * len(TERMS))
    np.testing.assert_allclose(relaxed, (1.0 - left) * 2.0 / 3.0 * along[:, 0] ** 2)
