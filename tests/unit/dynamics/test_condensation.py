"""The condensed step is one substitution and gives what the full system gives."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from fingerslip.dynamics.condensation import condense, condensed_solve
from fingerslip.dynamics.factor import SuperLUFactor
from unit.dynamics.matrices import FACTORS, positive_definite


def operator(count, size, seed=1):
    """Return rows with two entries each, as contact frames have."""
    rng = np.random.default_rng(seed)
    columns = rng.permutation(size)[: 2 * count].reshape(count, 2).ravel()
    rows = np.repeat(np.arange(count), 2)
    return sparse.csr_matrix((rng.normal(size=2 * count), (rows, columns)), shape=(count, size))


@pytest.mark.parametrize("factor", FACTORS)
@pytest.mark.parametrize("count", [1, 7, 25])
def test_condensed_compliance_is_that_of_the_inverse(factor, count, monkeypatch):
    monkeypatch.setattr("fingerslip.dynamics.condensation.factorise", factor)
    matrix, local = positive_definite(60), operator(count, 60)
    exact = local @ np.linalg.solve(matrix.toarray(), local.toarray().T)
    condensed = condense(matrix, local)
    np.testing.assert_allclose(condensed.compliance, exact, atol=1e-12 * np.abs(exact).max())
    np.testing.assert_array_equal(condensed.compliance, condensed.compliance.T)


def test_columns_beyond_one_block_are_condensed_alike():
    """More contact columns than are substituted at once, so that the blocks must be put together in order."""
    matrix, local = positive_definite(700), operator(300, 700)
    exact = local @ np.linalg.solve(matrix.toarray(), local.toarray().T)
    np.testing.assert_allclose(condense(matrix, local).compliance, exact, atol=1e-11 * np.abs(exact).max())


@pytest.mark.parametrize("factor", FACTORS)
def test_one_substitution_with_contact_forces_in_its_middle(factor, monkeypatch):
    monkeypatch.setattr("fingerslip.dynamics.condensation.factorise", factor)
    matrix, local = positive_definite(60), operator(8, 60)
    right = np.random.default_rng(4).normal(size=60)
    seen = []

    def contact(free):
        seen.append(free)
        return 3.0 * np.arange(8) - 5.0 * free

    solution, forces = condensed_solve(condense(matrix, local), right, 0.7, contact)
    free = local @ np.linalg.solve(matrix.toarray(), right)
    np.testing.assert_allclose(seen[0], free, atol=1e-12)
    np.testing.assert_allclose(matrix @ solution, right + 0.7 * (local.T @ forces), atol=1e-11)


@pytest.mark.parametrize("factor", FACTORS)
def test_without_contact_it_is_a_plain_solution(factor, monkeypatch):
    monkeypatch.setattr("fingerslip.dynamics.condensation.factorise", factor)
    matrix = positive_definite(40)
    right = np.arange(40.0)
    condensed = condense(matrix, sparse.csr_matrix((0, 40)))
    solution, forces = condensed_solve(condensed, right, 1.0, lambda free: free)
    np.testing.assert_allclose(matrix @ solution, right, atol=1e-10)
    assert forces.shape == (0,)


class Counting(SuperLUFactor):
    """A factor that counts its substitutions."""

    def __init__(self, matrix):
        super().__init__(matrix)
        self.calls = []

    def forward(self, right_hand_side):
        self.calls.append("forward")
        return super().forward(right_hand_side)

    def backward(self, halfway):
        self.calls.append("backward")
        return super().backward(halfway)


@pytest.mark.parametrize("force", [0.0, 2.0])
def test_a_step_costs_one_substitution_with_and_without_contact_forces(force, monkeypatch):
    monkeypatch.setattr("fingerslip.dynamics.condensation.factorise", Counting)
    condensed = condense(positive_definite(40), operator(6, 40))
    condensed.factor.calls.clear()
    condensed_solve(condensed, np.ones(40), 0.5, lambda free: force + 0.0 * free)
    assert condensed.factor.calls == ["forward", "backward"]


@pytest.mark.parametrize("columns", [4, 30])
def test_sparse_and_dense_storage_give_the_same(columns, monkeypatch):
    """A banded matrix fills little along the path of one column; many columns of a dense one are stored densely."""
    matrix = sparse.diags([-1.0, 2.5, -1.0], [-1, 0, 1], shape=(60, 60), format="csr")
    local, right = operator(columns, 60), np.arange(60.0)
    found = []
    for share in (0.0, 2.0):
        monkeypatch.setattr("fingerslip.dynamics.condensation._SPARSE_BELOW", share)
        condensed = condense(matrix, local)
        assert sparse.issparse(condensed.forward_columns) == (share > 1.0)
        found.append(condensed_solve(condensed, right, 0.7, lambda free: 1.0 - free)[0])
    np.testing.assert_allclose(found[0], found[1], atol=1e-12 * np.abs(found[0]).max())
