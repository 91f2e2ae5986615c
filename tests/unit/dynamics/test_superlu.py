"""The fallback: its own order for large matrices, and the Schur complement from the ends of its factors."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.dynamics import superlu
from fingerslip.dynamics.superlu import SuperLUFactor, superlu_schur
from unit.dynamics.matrices import positive_definite


@pytest.mark.parametrize("count", [1, 5, 40, 79])
def test_schur_complement_is_that_of_dense_elimination(count):
    matrix = positive_definite(80, seed=count)
    places = np.sort(np.random.default_rng(count).permutation(80)[:count])
    dense, others = matrix.toarray(), np.setdiff1d(np.arange(80), places)
    coupling = dense[np.ix_(others, places)]
    exact = dense[np.ix_(places, places)] - coupling.T @ np.linalg.solve(dense[np.ix_(others, others)], coupling)
    np.testing.assert_allclose(superlu_schur(matrix, places), exact, atol=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize("columns", [(), (3,)])
def test_an_order_of_elimination_changes_nothing_in_the_solution(columns, monkeypatch):
    monkeypatch.setattr(superlu, "_LARGE", 10)
    matrix = positive_definite(150)
    right = np.random.default_rng(0).normal(size=(150, *columns))
    factor = SuperLUFactor(matrix)
    np.testing.assert_allclose(matrix @ factor.backward(factor.forward(right)), right, atol=1e-9)
