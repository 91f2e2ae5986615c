"""Factors: two half substitutions are a solution, with either library."""

from __future__ import annotations

import gc

import numpy as np
import pytest
from scipy import sparse

from fingerslip.errors import FingerslipError
from fingerslip.linear import factorisation as factor_module
from fingerslip.linear.factorisation import (
    PardisoFactor,
    PardisoSchurFactor,
    SuperLUFactor,
    SuperLUSchurFactor,
    factorise,
    factorise_around,
)
from unit.dynamics.matrices import FACTORS, needs_mkl, positive_definite

SCHUR_FACTORS = [pytest.param(PardisoSchurFactor, marks=needs_mkl), SuperLUSchurFactor]


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


@pytest.mark.parametrize("available", [pytest.param(True, marks=needs_mkl), False])
@pytest.mark.parametrize("count", [1, 7, 59, 300])
def test_the_inverse_among_some_unknowns_is_that_of_the_whole(available, count, monkeypatch):
    """300 of 700 unknowns, or all but one of 60, in places that are spread over the matrix."""
    monkeypatch.setattr(factor_module, "pardiso_available", lambda: available)
    monkeypatch.setattr(factor_module, "_MIRRORED_AT_ONCE", 64)
    size = 700 if count == 300 else 60
    matrix = positive_definite(size)
    places = np.sort(np.random.default_rng(1).permutation(size)[:count])
    exact = np.linalg.inv(matrix.toarray())[np.ix_(places, places)]
    _, found = factorise_around(matrix, places)
    np.testing.assert_allclose(found, exact, atol=1e-11 * np.abs(exact).max())
    np.testing.assert_array_equal(found, found.T)
    assert found.flags.c_contiguous


@pytest.mark.parametrize("factor", SCHUR_FACTORS)
def test_schur_complement_is_that_of_dense_elimination(factor):
    matrix, places = positive_definite(80), np.array([3, 4, 17, 40, 79])
    dense, others = matrix.toarray(), np.setdiff1d(np.arange(80), places)
    coupling = dense[np.ix_(others, places)]
    exact = dense[np.ix_(places, places)] - coupling.T @ np.linalg.solve(dense[np.ix_(others, others)], coupling)
    found = np.zeros((5, 5))
    factor(matrix, places, found)
    np.testing.assert_allclose(found, exact, atol=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize("factor", SCHUR_FACTORS)
@pytest.mark.parametrize("columns", [(), (1,), (3,)])
def test_halves_around_some_unknowns_are_a_solution(factor, columns):
    """Between them stands the dense problem: whatever is put in for its unknowns, the others follow."""
    matrix, places, schur = positive_definite(80), np.array([3, 4, 17, 40, 79]), np.zeros((5, 5))
    right = np.random.default_rng(2).normal(size=(80, *columns))
    given = right.copy()
    factors = factor(matrix, places, schur)
    halfway = factors.forward(given)
    np.testing.assert_array_equal(given, right)
    exact = np.linalg.solve(matrix.toarray(), right)
    np.testing.assert_allclose(np.linalg.solve(schur, halfway[places]), exact[places], atol=1e-11)
    halfway[places] += 1.0
    moved = factors.backward(halfway)
    others = np.setdiff1d(np.arange(80), places)
    np.testing.assert_allclose((matrix @ moved)[others], right[others], atol=1e-11)
    np.testing.assert_array_equal(moved[places], halfway[places])


def test_an_indefinite_schur_complement_is_refused():
    with pytest.raises(FingerslipError, match="contact nodes is not positive definite"):
        factor_module._inverted(np.diag([1.0, -1.0]))
