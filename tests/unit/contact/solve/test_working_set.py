"""Working sets: the part of W on their nodes, and a preconditioner that moves with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.dense import factorise_dense
from fingerslip.contact.solve.working_set import Preconditioner, WorkingSet, gather

DIM, COUNT = 3, 8


def compliance() -> Compliance:
    root = np.random.default_rng(0).normal(size=(COUNT * DIM, COUNT * DIM))
    return Compliance(root @ root.T, np.full((COUNT, DIM), 0.5))


def preconditioner(nodes: np.ndarray) -> tuple[Preconditioner, np.ndarray]:
    """Return factors for some nodes, and the matrix that they are of."""
    size = nodes.size * DIM
    matrix = (np.eye(size) + 0.1 * np.random.default_rng(1).normal(size=(size, size))).astype(np.float32)
    factors = factorise_dense(matrix.copy())
    return Preconditioner(factors, nodes, np.ones(size, dtype=bool), np.arange(size)), matrix


def test_a_working_set_has_the_scaled_compliance_among_its_nodes():
    nodes, scale = np.array([1, 4, 6]), np.random.default_rng(2).uniform(1.0, 2.0, (COUNT, DIM))
    made = gather(compliance(), scale, nodes, None)
    np.testing.assert_array_equal(made.nodes, nodes)
    exact = scale[nodes].reshape(-1, 1) * compliance().block(nodes)
    np.testing.assert_allclose(made.scaled, exact, rtol=1e-6)
    assert made.scaled.dtype == np.float32
    assert made.preconditioner is None


def test_an_old_working_set_hands_on_its_preconditioner_and_its_forces():
    scale, before = np.ones((COUNT, DIM)), np.ones((COUNT, DIM))
    old = gather(compliance(), scale, np.array([1, 4]), None)
    assert gather(compliance(), scale, np.array([4, 5]), replace(old, before=before)).before is None
    full = replace(old, preconditioner=preconditioner(old.nodes)[0], lost=7, before=before)
    made = gather(compliance(), scale, np.array([4, 5]), full)
    assert isinstance(made, WorkingSet)
    assert (made.lost, made.before is before) == (7, True)
    np.testing.assert_array_equal(made.preconditioner.unknowns, [0, 1, 2])
    np.testing.assert_array_equal(made.preconditioner.kept, [False] * 3 + [True] * 3)


@pytest.mark.parametrize("nodes", [[2, 5, 7], [0, 2, 3, 5, 6, 7], [5, 9], [9, 10]])
def test_a_moved_preconditioner_solves_for_kept_nodes_and_passes_new_ones(nodes):
    made, matrix = preconditioner(np.array([2, 5, 7]))
    vector = np.random.default_rng(3).normal(size=len(nodes) * DIM).astype(np.float32)
    found = made.moved_to(np.array(nodes), DIM).solve(vector)
    given = np.zeros(9)
    places = {node: slice(DIM * i, DIM * i + DIM) for i, node in enumerate(nodes)}
    for i, node in enumerate((2, 5, 7)):
        if node in places:
            given[DIM * i : DIM * i + DIM] = vector[places[node]]
    solved = np.linalg.solve(matrix, given)
    for i, node in enumerate((2, 5, 7)):
        if node in places:
            np.testing.assert_allclose(found[places[node]], solved[DIM * i : DIM * i + DIM], atol=1e-5)
    for node in set(nodes) - {2, 5, 7}:
        np.testing.assert_array_equal(found[places[node]], vector[places[node]])
