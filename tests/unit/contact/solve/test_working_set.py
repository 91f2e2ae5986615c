"""Working sets: the part of W on their nodes, and a preconditioner that moves with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fingerslip.contact.frames import contact_frames
from fingerslip.contact.solve import gmres
from fingerslip.contact.solve.coarse import unit_forces
from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.gmres import Preconditioner
from fingerslip.contact.solve.local_inverse import renew_rows
from fingerslip.contact.solve.past import Past
from fingerslip.contact.solve.working_set import WorkingSet, gather

DIM, COUNT = 3, 8


def compliance(turning: bool = False, seed: int = 1) -> Compliance:
    root = np.random.default_rng(0).normal(size=(COUNT * DIM, COUNT * DIM))
    normals = np.random.default_rng(seed).normal(size=(COUNT, DIM))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    frames = contact_frames(normals, np.array([1.0, 0.0, 0.0])) if turning else None
    return Compliance(root @ root.T, np.full((COUNT, DIM), 0.5), frames, 2.0)


def scaled(made: WorkingSet) -> np.ndarray:
    """Return rho W among the nodes."""
    return made.products(np.eye(made.scale.size, dtype=np.float32))


def renewed(made: WorkingSet, slopes: np.ndarray) -> WorkingSet:
    inverse, weights = made.inverse.copy(), (made.scale * made.factor, made.scale * made.penalty)
    given = inverse.near, inverse.rows, inverse.marks, slopes, made.frames, weights
    renew_rows(*given, made.coupling.body, made.nodes)
    return replace(made, inverse=inverse)


SCALE = np.random.default_rng(2).uniform(1.0, 2.0, (COUNT, DIM))
STICK = np.broadcast_to(np.eye(DIM), (COUNT, DIM, DIM))


@pytest.mark.parametrize("turning", [True, False])
def test_a_working_set_multiplies_with_the_scaled_compliance_among_its_nodes(turning):
    nodes = np.array([1, 4, 6])
    made = gather(compliance(turning), SCALE, nodes, None)
    exact = SCALE[nodes].reshape(-1, 1) * compliance(turning).block(nodes)
    np.testing.assert_allclose(scaled(made), exact, atol=1e-5 * np.abs(exact).max())
    on_groups = exact @ unit_forces(made.coarse.columns)
    np.testing.assert_allclose(made.coarse.moved, on_groups, atol=1e-5 * np.abs(exact).max())
    assert scaled(made).dtype == made.body.dtype == np.float32


def test_frames_that_turn_are_taken_along_without_gathering_again():
    old = gather(compliance(turning=True), SCALE, np.array([1, 4, 6]), None)
    later = compliance(turning=True, seed=5)
    made = old.in_step(later, SCALE)
    assert made.body is old.body
    exact = SCALE[old.nodes].reshape(-1, 1) * later.block(old.nodes)
    np.testing.assert_allclose(scaled(made), exact, atol=1e-5 * np.abs(exact).max())
    assert gather(compliance(), SCALE, old.nodes, None).in_step(compliance(), SCALE).frames.shape == (3, 3, 3)


@pytest.mark.parametrize("other", [False, True])
def test_an_old_working_set_hands_on_its_rows_and_its_forces(other):
    old = renewed(gather(compliance(), SCALE, np.array([1, 4, 6]), None), STICK[:3].copy())
    past = Past(np.ones((COUNT, DIM)), np.zeros((COUNT, DIM)))
    later = replace(compliance(), body=2.0 * compliance().body, edition=(1.0,)) if other else compliance()
    made = gather(later, SCALE, np.array([6, 4, 5]), replace(old, past=past))
    assert made.past is past
    np.testing.assert_array_equal(made.inverse.rows[[1, 0]], old.inverse.rows[[1, 2]])
    np.testing.assert_array_equal(np.isnan(made.inverse.marks).any(axis=(1, 2)), [False, False, True])
    assert made.coupling.near is old.coupling.near
    np.testing.assert_array_equal(made.coupling.body, (2.0 if other else 1.0) * old.coupling.body)


def test_motions_that_share_a_compliance_share_what_is_known_of_it():
    shared = compliance()
    first, second = (gather(shared, SCALE, nodes, None) for nodes in (np.array([1, 4]), np.array([0, 6])))
    assert first.coupling is second.coupling


@pytest.mark.parametrize("turning", [True, False])
def test_among_few_nodes_the_preconditioner_is_the_inverse(turning):
    made = renewed(gather(compliance(turning), SCALE, np.arange(COUNT)[::-1].copy(), None), STICK.copy())
    matrix = SCALE[::-1].reshape(-1, 1) * compliance(turning).block(np.arange(COUNT)[::-1])
    vector = np.random.default_rng(4).normal(size=COUNT * DIM)
    given, found = (matrix @ vector).astype(np.float32), np.zeros(COUNT * DIM, dtype=np.float32)
    gmres._precondition(Preconditioner.of(STICK.astype(np.float32), made.coarse, made.inverse), given, found)
    np.testing.assert_allclose(matrix @ found, matrix @ vector, atol=1e-4 * np.abs(matrix @ vector).max())


def test_a_compliance_of_other_factors_is_gathered_again():
    old = gather(compliance(), SCALE, np.array([1, 4, 6]), None)
    later = replace(compliance(), body=2.0 * compliance().body, edition=(0.1, 2))
    made = old.in_step(later, SCALE)
    np.testing.assert_array_equal(made.nodes, old.nodes)
    np.testing.assert_array_equal(made.body, 2.0 * old.body)
    assert made.in_step(later, SCALE) is made


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_single_precision_rounds_nothing_of_a_compliance_that_has_no_more(precision):
    whole = compliance()
    made = gather(replace(whole, body=whole.body.astype(precision)), SCALE, np.array([1, 4, 6]), None)
    assert made.is_exact == (precision is np.float32)
    assert made.body.dtype == np.float32
