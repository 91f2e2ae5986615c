from __future__ import annotations

import gc

import numpy as np
import pytest
from scipy import sparse

from fingerslip.dynamics import factor as factor_module
from fingerslip.dynamics.condensation import condense, condensed_solve
from fingerslip.dynamics.factor import PardisoFactor, SuperLUFactor, factorise, pardiso_available
from fingerslip.errors import FingerslipError

needs_mkl = pytest.mark.skipif(not pardiso_available(), reason="MKL is not installed")
FACTORS = [pytest.param(PardisoFactor, marks=needs_mkl), SuperLUFactor]


def positive_definite(size, seed=0):
    rng = np.random.default_rng(seed)
    root = sparse.random(size, size, density=0.05, rng=rng, format="csr") + sparse.diags(rng.uniform(1, 2, size))
    return sparse.csr_matrix(root @ root.T)


def operator(count, size, seed=1):
    """Return rows with two entries each, as contact frames have."""
    rng = np.random.default_rng(seed)
    columns = rng.permutation(size)[: 2 * count].reshape(count, 2).ravel()
    rows = np.repeat(np.arange(count), 2)
    return sparse.csr_matrix((rng.normal(size=2 * count), (rows, columns)), shape=(count, size))


@pytest.mark.parametrize("factor", FACTORS)
@pytest.mark.parametrize("columns", [(), (1,), (3,), (40,)])
def test_two_halves_are_a_solution(factor, columns):
    matrix = positive_definite(60)
    right = np.random.default_rng(2).normal(size=(60, *columns))
    factors = factor(matrix)
    exact = np.linalg.solve(matrix.toarray(), right)
    found = factors.backward(factors.forward(right))
    np.testing.assert_allclose(found, exact, atol=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize("factor", FACTORS)
def test_the_halves_are_dual(factor):
    """b . A^-1 c is the product of the two half solutions: on this the condensation stands."""
    matrix = positive_definite(50)
    b, c = np.random.default_rng(3).normal(size=(2, 50))
    factors = factor(matrix)
    exact = b @ np.linalg.solve(matrix.toarray(), c)
    assert factors.transposed_backward(b) @ factors.forward(c) == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("factor", FACTORS)
def test_right_hand_sides_are_left_as_they_were(factor):
    right = np.random.default_rng(2).normal(size=60)
    before = right.copy()
    factors = factor(positive_definite(60))
    factors.backward(factors.forward(right))
    np.testing.assert_array_equal(right, before)


@pytest.mark.parametrize("factor", FACTORS)
def test_many_factors_live_side_by_side(factor):
    matrices = [positive_definite(30, seed) for seed in range(5)]
    factors = [factor(matrix) for matrix in matrices]
    right = np.arange(30.0)
    del factors[2], matrices[2]
    gc.collect()
    for matrix, one in zip(matrices, factors, strict=True):
        np.testing.assert_allclose(matrix @ one.backward(one.forward(right)), right, atol=1e-9)


@needs_mkl
def test_an_indefinite_matrix_is_refused_by_cholesky():
    with pytest.raises(FingerslipError, match="the matrix is not positive definite"):
        PardisoFactor(sparse.csr_matrix(np.diag([1.0, -1.0, 2.0])))


def test_a_singular_matrix_is_refused_by_the_fallback():
    with pytest.raises(FingerslipError, match=r"SuperLU: .*singular; the matrix is not positive definite"):
        SuperLUFactor(sparse.csr_matrix(np.zeros((3, 3))))


def test_the_fallback_is_taken_where_pardiso_is_missing(monkeypatch):
    monkeypatch.setattr(factor_module, "pardiso_available", lambda: False)
    assert factorise(positive_definite(5)).name == "SuperLU"


@needs_mkl
def test_pardiso_is_taken_where_it_is_installed():
    assert factorise(positive_definite(5)).name == "MKL PARDISO"


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
