"""What bodies that relax remember, what a step finds of it, and what their springs store."""

from dataclasses import replace

import numpy as np
import pytest

from fingerslip.fe.finite.history import end_history, spring_excess
from fingerslip.materials.prony import PronyTerm
from fingerslip.materials.relaxing import shape_energy
from problems.blocks import KINDS
from problems.verification.large_relaxation import relaxed_law
from unit.fe.finite.bodies import EVERY_PAIR, RELAXING, SOFT, STEP, body, moved, relaxing_body, stepped

EVERY_KIND = pytest.mark.parametrize("kind", KINDS, ids="-".join)


def test_an_elastic_body_or_layer_has_no_history_and_a_step_that_was_not_begun_has_no_end():
    bulk = body("Q4", law=SOFT)
    assert bulk.relaxation is None
    state, strained = bulk.at_rest(STEP), bulk.deformed(moved(bulk, 0.02))
    assert (state.left, state.history) == (strained.left, strained.history) == (None, None)
    assert strained.pulled is None
    assert bulk.begun(state, STEP) is state
    assert bulk.ended(state) is state
    bulk = relaxing_body(("Q4", "selective", "plane_strain"), RELAXING[1])
    state = stepped(bulk)
    far = np.flatnonzero(bulk.relaxation.points == 1)
    assert not spring_excess(bulk.relaxation, 1, bulk.materials.materials[1], state, far).any()
    every = np.arange(bulk.weights.size)
    np.testing.assert_allclose(bulk.energy_densities(state, every[::3]), bulk.energy_densities(state, every)[::3])
    with pytest.raises(ValueError, match="was not begun"):
        end_history(bulk.relaxation, bulk.materials.materials, bulk.deformed(moved(bulk, 0.01)))


def test_halved_steps_have_their_own_weights_and_the_state_keeps_its_history():
    """Strain is linear within a step: with the middle on the line, halves differ by what the law is nonlinear."""
    bulk = relaxing_body(("H8", "selective", "solid"))
    state = stepped(bulk)
    whole, half = bulk.begun(state, STEP), bulk.begun(state, STEP / 2)
    assert half.left.terms[0].taken_share < whole.left.terms[0].taken_share
    assert whole.history is half.history is state.history
    ended = bulk.ended(bulk.deformed(moved(bulk, 0.02), whole))
    assert ended.history is not state.history
    np.testing.assert_array_equal(state.history.points, stepped(bulk).history.points)
    bulk = relaxing_body(("Q4", "full", "plane_strain"))
    start, at = bulk.at_rest(STEP), moved(bulk, 1e-4)
    whole = bulk.ended(bulk.deformed(at, bulk.begun(start, STEP)))
    middle = bulk.ended(bulk.deformed(at / 2, bulk.begun(start, STEP / 2)))
    halves = bulk.ended(bulk.deformed(at, bulk.begun(middle, STEP / 2)))
    scale = np.abs(bulk.force(whole)).max()
    np.testing.assert_allclose(bulk.force(halves), bulk.force(whole), atol=1e-3 * scale)


def strained_for(bulk, at, step, steps):
    """Return a body that is at a displacement for some steps."""
    state = bulk.at_rest(step)
    for _ in range(steps):
        state = bulk.ended(bulk.deformed(at, bulk.begun(state, step)))
    return state


@EVERY_PAIR
def test_energy_force_and_stiffness_at_once_are_those_of_the_law(element, integration, formulation, law):
    kind = element, integration, formulation
    bulk, elastic = (body(*kind, law=own) for own in (replace(law, prony=(PronyTerm(0.6, 1e12),)), law))
    at = moved(bulk, 0.03)
    state, wanted = strained_for(bulk, at, STEP, 1), elastic.deformed(at)
    assert bulk.energy(state) == pytest.approx(elastic.energy(wanted), rel=1e-9)
    np.testing.assert_allclose(bulk.force(state), elastic.force(wanted), atol=1e-9)
    difference = np.abs(bulk.tangent(state) - elastic.tangent(wanted)).max()
    assert difference <= 1e-9 * np.abs(elastic.tangent(wanted)).max()


@EVERY_PAIR
def test_energy_and_force_in_the_end_are_those_of_the_relaxed_law(element, integration, formulation, law):
    """But for what the neo-Hookean law stores in the shape where only the volume changes."""
    kind = element, integration, formulation
    relaxing, rest = replace(law, prony=(PronyTerm(0.6, 0.02),)), relaxed_law(law, 0.6)
    bulk, elastic = (body(*kind, law=own) for own in (relaxing, rest))
    at = moved(bulk, 0.03)
    state, wanted = strained_for(bulk, at, 0.04, 25), elastic.deformed(at)
    alone = shape_energy(law, np.tile(state.log_strain.mean(axis=1, keepdims=True), 3))
    missed = 0.6 * float(np.abs(alone) @ bulk.weights.ravel())
    assert missed < 1e-2 * bulk.energy(state)
    assert bulk.energy(state) == pytest.approx(elastic.energy(wanted), abs=1e-8 * bulk.energy(state) + missed)
    np.testing.assert_allclose(
        bulk.force(state), elastic.force(wanted), atol=1e-8 * np.abs(elastic.force(wanted)).max()
    )


@EVERY_KIND
def test_held_strain_loses_energy_in_every_step(kind):
    bulk = relaxing_body(kind)
    at, state, energies = moved(bulk, 0.03), bulk.at_rest(STEP), []
    for _ in range(6):
        state = bulk.ended(bulk.deformed(at, bulk.begun(state, STEP)))
        energies.append(bulk.energy(state))
    assert (np.diff(energies) < 0.0).all()
