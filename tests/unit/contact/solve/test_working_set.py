"""Working sets: the part of W on their nodes, and a preconditioner that moves with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fingerslip.contact.frames import contact_frames
from fingerslip.contact.solve.coarse import unit_forces
from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.past import Past
from fingerslip.contact.solve.working_set import gather

DIM, COUNT = 3, 8


def compliance(turning: bool = False, seed: int = 1) -> Compliance:
    root = np.random.default_rng(0).normal(size=(COUNT * DIM, COUNT * DIM))
    normals = np.random.default_rng(seed).normal(size=(COUNT, DIM))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    frames = contact_frames(normals, np.array([1.0, 0.0, 0.0])) if turning else None
    return Compliance(root @ root.T, np.full((COUNT, DIM), 0.5), frames, 2.0)


SCALE = np.random.default_rng(2).uniform(1.0, 2.0, (COUNT, DIM))
STICK = np.broadcast_to(np.eye(DIM), (COUNT, DIM, DIM))


@pytest.mark.parametrize("turning", [True, False])
def test_a_working_set_multiplies_with_the_scaled_compliance_among_its_nodes(turning):
    nodes = np.array([1, 4, 6])
    made = gather(compliance(turning), SCALE, nodes, None)
    exact = SCALE[nodes].reshape(-1, 1) * compliance(turning).block(nodes)
    vector = np.random.default_rng(3).normal(size=9).astype(np.float32)
    np.testing.assert_allclose(made.product(vector), exact @ vector, atol=1e-5 * np.abs(exact).max())
    np.testing.assert_allclose(made.scaled(), exact, atol=1e-5 * np.abs(exact).max())
    on_groups = exact @ unit_forces(made.coarse.columns)
    np.testing.assert_allclose(made.coarse.moved, on_groups, atol=1e-5 * np.abs(exact).max())
    assert made.product(vector).dtype == made.body.dtype == np.float32


def test_frames_that_turn_are_taken_along_without_gathering_again():
    old = gather(compliance(turning=True), SCALE, np.array([1, 4, 6]), None)
    later = compliance(turning=True, seed=5)
    made = old.in_step(later, SCALE)
    assert made.body is old.body
    exact = SCALE[old.nodes].reshape(-1, 1) * later.block(old.nodes)
    vector = np.ones(9, dtype=np.float32)
    np.testing.assert_allclose(made.product(vector), exact @ vector, atol=1e-5 * np.abs(exact).max())
    assert gather(compliance(), SCALE, old.nodes, None).in_step(compliance(), SCALE).frames.shape == (3, 3, 3)


@pytest.mark.slow
def test_an_old_working_set_hands_on_its_rows_and_its_forces():
    old = gather(compliance(), SCALE, np.array([1, 4, 6]), None).renewed(STICK[:3])
    past = Past(np.ones((COUNT, DIM)), np.zeros((COUNT, DIM)))
    made = gather(compliance(), SCALE, np.array([4, 5, 6]), replace(old, past=past))
    assert made.past is past
    np.testing.assert_array_equal(made.inverse.rows[[0, 2]], old.inverse.rows[[1, 2]])
    marks = np.concatenate([STICK[:3], made.frames], axis=1)
    np.testing.assert_array_equal(made.inverse.stale(marks), [False, True, False])


@pytest.mark.parametrize("turning", [True, False])
def test_among_few_nodes_the_preconditioner_is_the_inverse(turning):
    made = gather(compliance(turning), SCALE, np.arange(COUNT), None).renewed(STICK)
    matrix = SCALE.reshape(-1, 1) * compliance(turning).matrix
    vector = np.random.default_rng(4).normal(size=COUNT * DIM)
    found = made.preconditioner(STICK.astype(np.float32))((matrix @ vector).astype(np.float32))
    np.testing.assert_allclose(matrix @ found, matrix @ vector, atol=1e-4 * np.abs(matrix @ vector).max())


def test_a_compliance_of_other_factors_is_gathered_again():
    old = gather(compliance(), SCALE, np.array([1, 4, 6]), None)
    later = replace(compliance(), body=2.0 * compliance().body, edition=(0.1, 2))
    made = old.in_step(later, SCALE)
    np.testing.assert_array_equal(made.nodes, old.nodes)
    np.testing.assert_array_equal(made.body, 2.0 * old.body)
    assert made.in_step(later, SCALE) is made
