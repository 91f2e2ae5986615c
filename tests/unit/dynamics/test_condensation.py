"""The condensed step is one substitution and gives what the full system gives."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from fingerslip.dynamics.condensation import ByColumns, BySchur, condense
from fingerslip.linear.factorisation import SuperLUFactor
from unit.dynamics.matrices import FACTORS, needs_mkl, positive_definite


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
    _, compliance = condense(matrix, local)
    np.testing.assert_allclose(compliance, exact, atol=1e-12 * np.abs(exact).max())
    np.testing.assert_array_equal(compliance, compliance.T)


def test_columns_beyond_one_block_are_condensed_alike():
    """More contact columns than are substituted at once, so that the blocks must be put together in order."""
    matrix, local = positive_definite(700), operator(300, 700)
    exact = local @ np.linalg.solve(matrix.toarray(), local.toarray().T)
    np.testing.assert_allclose(condense(matrix, local)[1], exact, atol=1e-11 * np.abs(exact).max())


@pytest.mark.parametrize("factor", FACTORS)
def test_one_substitution_with_contact_forces_in_its_middle(factor, monkeypatch):
    monkeypatch.setattr("fingerslip.dynamics.condensation.factorise", factor)
    matrix, local = positive_definite(60), operator(8, 60)
    right = np.random.default_rng(4).normal(size=60)
    seen = []

    def contact(free):
        seen.append(free)
        return 3.0 * np.arange(8) - 5.0 * free

    solution, forces = condense(matrix, local)[0].solve(right, 0.7, contact)
    free = local @ np.linalg.solve(matrix.toarray(), right)
    np.testing.assert_allclose(seen[0], free, atol=1e-12)
    np.testing.assert_allclose(matrix @ solution, right + 0.7 * (local.T @ forces), atol=1e-11)


@pytest.mark.parametrize("factor", FACTORS)
def test_without_contact_it_is_a_plain_solution(factor, monkeypatch):
    monkeypatch.setattr("fingerslip.dynamics.condensation.factorise", factor)
    matrix = positive_definite(40)
    right = np.arange(40.0)
    condensed, _ = condense(matrix, sparse.csr_matrix((0, 40)))
    solution, forces = condensed.solve(right, 1.0, lambda free: free)
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
    condensed, _ = condense(positive_definite(40), operator(6, 40))
    condensed.factor.calls.clear()
    condensed.solve(np.ones(40), 0.5, lambda free: force + 0.0 * free)
    assert condensed.factor.calls == ["forward", "backward"]


@pytest.mark.parametrize("columns", [4, 30])
def test_sparse_and_dense_storage_give_the_same(columns, monkeypatch):
    """A banded matrix fills little along the path of one column; many columns of a dense one are stored densely."""
    matrix = sparse.diags([-1.0, 2.5, -1.0], [-1, 0, 1], shape=(60, 60), format="csr")
    local, right = operator(columns, 60), np.arange(60.0)
    found = []
    for share in (0.0, 2.0):
        monkeypatch.setattr("fingerslip.dynamics.condensation._SPARSE_BELOW", share)
        condensed, _ = condense(matrix, local)
        assert sparse.issparse(condensed.forward_columns) == (share > 1.0)
        found.append(condensed.solve(right, 0.7, lambda free: 1.0 - free)[0])
    np.testing.assert_allclose(found[0], found[1], atol=1e-12 * np.abs(found[0]).max())


SCHUR_WAYS = [pytest.param(True, marks=needs_mkl, id="pardiso"), pytest.param(False, id="superlu")]


@pytest.fixture(params=SCHUR_WAYS)
def by_schur(request, monkeypatch):
    """Have everything condensed by the Schur complement, by either library."""
    monkeypatch.setattr("fingerslip.dynamics.condensation._COLUMNS_UP_TO", 0)
    monkeypatch.setattr("fingerslip.linear.factorisation.pardiso_available", lambda: request.param)


@pytest.mark.parametrize("columns", [(), (1,), (4,)])
def test_the_schur_complement_gives_what_columns_give(columns, by_schur):
    matrix, local = positive_definite(60), operator(8, 60)
    right = np.random.default_rng(4).normal(size=(60, *columns))
    condensed, compliance = condense(matrix, local)
    assert isinstance(condensed, BySchur)
    exact = local @ np.linalg.solve(matrix.toarray(), local.toarray().T)
    np.testing.assert_allclose(compliance, exact, atol=1e-12 * np.abs(exact).max())
    solution, forces = condensed.solve(right, 0.7, lambda free: 2.0 - 5.0 * free)
    np.testing.assert_allclose(matrix @ solution, right + 0.7 * (local.T @ forces), atol=1e-10)
    np.testing.assert_allclose(forces, 2.0 - 5.0 * (local @ np.linalg.solve(matrix.toarray(), right)), atol=1e-10)
    assert condensed.solver in ("MKL PARDISO", "SuperLU")
    assert ("one substitution" in condensed.description) == (condensed.solver == "MKL PARDISO")


def test_nodes_that_are_picked_as_they_are_need_no_copy_of_the_compliance(by_schur):
    matrix = positive_definite(60)
    local = sparse.csr_matrix((np.ones(9), (np.arange(9), 3 + 5 * np.arange(9))), shape=(9, 60))
    exact = np.linalg.inv(matrix.toarray())[3:48:5, 3:48:5]
    condensed, compliance = condense(matrix, local)
    assert compliance is condensed.inverse
    np.testing.assert_allclose(compliance, exact, atol=1e-12 * np.abs(exact).max())


def test_columns_are_kept_only_while_they_are_small(monkeypatch):
    """8 of 60 unknowns are 480 entries; a matrix with short rows may have twelve times the entries of a full one."""
    matrix, local = positive_definite(60), operator(8, 60)
    full = sparse.csr_matrix(matrix + 1e-9 * np.ones((60, 60)))
    monkeypatch.setattr("fingerslip.dynamics.condensation._COLUMNS_UP_TO", 40)
    assert isinstance(condense(full, local)[0], BySchur)
    assert isinstance(condense(matrix, local)[0], ByColumns)
    monkeypatch.setattr("fingerslip.dynamics.condensation._COLUMNS_UP_TO", 39)
    assert isinstance(condense(matrix, local)[0], BySchur)


@pytest.mark.parametrize("way", [0, 10**9], ids=["schur", "columns"])
def test_columns_march_together_as_they_do_alone(way, monkeypatch):
    monkeypatch.setattr("fingerslip.dynamics.condensation._COLUMNS_UP_TO", way)
    matrix, local = positive_definite(60), operator(8, 60)
    right = np.random.default_rng(4).normal(size=(60, 3))
    condensed, _ = condense(matrix, local)
    together, _ = condensed.solve(right, 0.7, lambda free: 2.0 - 5.0 * free)
    for column in range(3):
        alone, _ = condensed.solve(right[:, column], 0.7, lambda free: 2.0 - 5.0 * free)
        np.testing.assert_allclose(together[:, column], alone, atol=1e-11 * np.abs(alone).max())
