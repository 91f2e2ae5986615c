"""Factors: two half substitutions are a solution, with either solver."""

from __future__ import annotations

import gc

import numpy as np
import pytest

from fingerslip.errors import FingerslipError
from fingerslip.linear import solver as factorisation
from fingerslip.linear.solver import factorise, factorise_around
from problems.matrices import SOLVERS, positive_definite


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("columns", [(), (1,), (3,), (40,)])
def test_two_halves_are_a_solution(solver, columns):
    matrix = positive_definite(60)
    right = np.random.default_rng(2).normal(size=(60, *columns))
    factors = factorise(matrix, solver)
    exact = np.linalg.solve(matrix.toarray(), right)
    found = factors.backward(factors.forward(right))
    np.testing.assert_allclose(found, exact, atol=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize("solver", SOLVERS)
def test_the_halves_are_dual(solver):
    """b . A^-1 c is the product of the two half solutions: on this the condensation stands."""
    matrix = positive_definite(50)
    b, c = np.random.default_rng(3).normal(size=(2, 50))
    factors = factorise(matrix, solver)
    exact = b @ np.linalg.solve(matrix.toarray(), c)
    assert factors.transposed_backward(b) @ factors.forward(c) == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("solver", SOLVERS)
def test_right_hand_sides_are_left_as_they_were(solver):
    right = np.random.default_rng(2).normal(size=60)
    before = right.copy()
    factors = factorise(positive_definite(60), solver)
    factors.backward(factors.forward(right))
    np.testing.assert_array_equal(right, before)


@pytest.mark.parametrize("solver", SOLVERS)
def test_many_factors_live_side_by_side(solver):
    matrices = [positive_definite(30, seed) for seed in range(5)]
    factors = [factorise(matrix, solver) for matrix in matrices]
    right = np.arange(30.0)
    del factors[2], matrices[2]
    gc.collect()
    for matrix, one in zip(matrices, factors, strict=True):
        np.testing.assert_allclose(matrix @ one.backward(one.forward(right)), right, atol=1e-9)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("count", [1, 7, 59, 300])
def test_the_inverse_among_some_unknowns_is_that_of_the_whole(solver, count, monkeypatch):
    """300 of 700 unknowns, or all but one of 60, in kept that are spread over the matrix."""
    monkeypatch.setattr(factorisation, "_MIRRORED_AT_ONCE", 64)
    size = 700 if count == 300 else 60
    matrix = positive_definite(size)
    kept = np.sort(np.random.default_rng(1).permutation(size)[:count])
    exact = np.linalg.inv(matrix.toarray())[np.ix_(kept, kept)]
    _, found = factorise_around(matrix, kept, solver)
    np.testing.assert_allclose(found, exact, atol=1e-11 * np.abs(exact).max())
    np.testing.assert_array_equal(found, found.T)
    assert found.flags.c_contiguous


@pytest.mark.parametrize("solver", SOLVERS)
def test_the_inverse_has_the_precision_of_the_factors(solver):
    rough, matrix, kept = solver.rough(), positive_definite(60), np.arange(3, 60, 5)
    factor, found = factorise_around(matrix, kept, rough)
    assert found.dtype == (np.float32 if factor.is_single else np.float64)
    np.testing.assert_array_equal(found, found.T)
    exact = np.linalg.inv(matrix.toarray())[np.ix_(kept, kept)]
    np.testing.assert_allclose(found, exact, atol=1e-5 * np.abs(exact).max())


@pytest.mark.parametrize("solver", SOLVERS)
def test_schur_complement_is_that_of_dense_elimination(solver):
    matrix, kept = positive_definite(80), np.array([3, 4, 17, 40, 79])
    dense, others = matrix.toarray(), np.setdiff1d(np.arange(80), kept)
    coupling = dense[np.ix_(others, kept)]
    exact = dense[np.ix_(kept, kept)] - coupling.T @ np.linalg.solve(dense[np.ix_(others, others)], coupling)
    _, found = solver.factorise_around(matrix, kept)
    np.testing.assert_allclose(found, exact, atol=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("columns", [(), (1,), (3,)])
def test_halves_around_some_unknowns_are_a_solution(solver, columns):
    """Between them stands the dense problem: whatever is put in for its unknowns, the others follow."""
    matrix, kept = positive_definite(80), np.array([3, 4, 17, 40, 79])
    right = np.random.default_rng(2).normal(size=(80, *columns))
    given = right.copy()
    factors, schur = solver.factorise_around(matrix, kept)
    halfway = factors.forward(given)
    np.testing.assert_array_equal(given, right)
    exact = np.linalg.solve(matrix.toarray(), right)
    np.testing.assert_allclose(np.linalg.solve(schur, halfway[kept]), exact[kept], atol=1e-11)
    halfway[kept] += 1.0
    moved = factors.backward(halfway)
    others = np.setdiff1d(np.arange(80), kept)
    np.testing.assert_allclose((matrix @ moved)[others], right[others], atol=1e-11)
    np.testing.assert_array_equal(moved[kept], halfway[kept])


def test_an_indefinite_schur_complement_is_refused():
    with pytest.raises(FingerslipError, match="contact nodes is not positive definite"):
        factorisation._invert(np.diag([1.0, -1.0]))
