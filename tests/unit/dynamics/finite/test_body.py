"""The body in the unknowns of a system: what supports hold and what they move."""

from __future__ import annotations

import numpy as np

import fingerslip as fs
from fingerslip.dynamics.system.system import build_system
from unit.dynamics.finite.blocks import block


def random_displacement(system):
    return np.random.default_rng(1).uniform(-0.02, 0.02, system.mass.shape[0])


def test_forces_on_the_unknowns_are_those_of_the_nodes():
    for model in (block(), block(support_motions={})):
        system = build_system(model)
        body = system.require_body()
        state = body.at(random_displacement(system))
        np.testing.assert_array_equal(state.force[: system.free.size], state.nodal[system.free])
        carried = [state.nodal[dofs].sum() for dofs in system.unknowns.carried]
        np.testing.assert_allclose(state.force[system.free.size :], carried)


def test_energy_force_and_tangent_belong_together_with_supports_that_move():
    """The last unknown moves the whole top."""
    system = build_system(block())
    body, at = system.require_body(), random_displacement(system)
    state, step = body.at(at), 1e-6
    assert state.energy == 0.0
    tangent = body.tangent(state)
    assert tangent.shape == (at.size, at.size)
    for unknown in (0, at.size - 1):
        change = step * np.eye(at.size)[unknown]
        ahead, back = body.at(at + change), body.at(at - change)
        slope = (body.energy(ahead) - body.energy(back)) / (2 * step)
        np.testing.assert_allclose(slope, state.force[unknown], atol=1e-4)
        slopes = (ahead.force - back.force) / (2 * step)
        np.testing.assert_allclose(slopes, tangent[:, [unknown]].toarray().ravel(), atol=1e-3)


def test_a_positive_tangent_has_no_negative_eigenvalue():
    system = build_system(block())
    body = system.require_body()
    at = random_displacement(system)
    at[system.unknowns.moving] = -0.25
    values = np.linalg.eigvalsh(body.tangent(body.at(at), positive=True).toarray())
    assert values[0] > -1e-8 * values[-1]


def test_a_step_of_a_body_that_relaxes_begins_and_ends():
    """What it remembers changes with the end alone, and an elastic body has nothing to begin."""
    law = fs.NeoHookean(1e4, 0.4, 1000.0, prony=(fs.PronyTerm(0.4, 0.3),))
    system = build_system(block(materials={"bulk": law}))
    body, at = system.require_body(), random_displacement(system)
    rest = body.at_rest(0.25)
    assert body.relaxes
    assert rest.energy == 0.0
    begun = body.begun(rest, 0.25)
    state = body.at(at, begun)
    assert state.deformed.history is begun.deformed.history
    ended = body.ended(state)
    assert ended.deformed.history is not begun.deformed.history
    assert ended.energy == body.energy(ended) > 0.0
    elastic = build_system(block()).require_body()
    assert not elastic.relaxes
    assert elastic.begun(rest, 0.25) is rest
    np.testing.assert_array_equal(elastic.at_rest(0.25).force, elastic.at(np.zeros_like(at)).force)


def test_a_system_at_small_strain_has_no_body():
    assert build_system(block()).body is not None
    assert build_system(block(kinematics="small")).body is None
