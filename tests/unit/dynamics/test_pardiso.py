"""MKL PARDISO through its own interface: the Schur complement, and matrices that it refuses."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from fingerslip.dynamics.pardiso import PardisoFactor, pardiso_bytes, pardiso_schur
from fingerslip.errors import FingerslipError
from unit.dynamics.matrices import needs_mkl, positive_definite

pytestmark = needs_mkl


def test_schur_complement_is_that_of_dense_elimination():
    matrix, places = positive_definite(80), np.array([3, 4, 17, 40, 79])
    dense, others = matrix.toarray(), np.setdiff1d(np.arange(80), places)
    coupling = dense[np.ix_(others, places)]
    exact = dense[np.ix_(places, places)] - coupling.T @ np.linalg.solve(dense[np.ix_(others, others)], coupling)
    np.testing.assert_allclose(pardiso_schur(matrix, places), exact, atol=1e-12 * np.abs(exact).max())


def test_a_factor_is_unchanged_by_a_schur_complement_beside_it():
    matrix = positive_definite(60)
    factor, right = PardisoFactor(matrix), np.arange(60.0)
    pardiso_schur(matrix, np.arange(20))
    np.testing.assert_allclose(matrix @ factor.backward(factor.forward(right)), right, atol=1e-9)


def test_an_indefinite_matrix_has_no_schur_complement():
    with pytest.raises(FingerslipError, match="the matrix is not positive definite"):
        pardiso_schur(sparse.csr_matrix(np.diag([1.0, -1.0, 2.0, 3.0])), np.array([3]))


def test_the_analysis_tells_the_memory():
    """At least the entries of a dense lower triangle, for a dense matrix of 600 unknowns, and not ten times that."""
    matrix = sparse.csr_matrix(np.eye(600) + 0.001)
    plain, schur = pardiso_bytes(matrix, np.arange(100))
    assert 8 * 600**2 / 2 < plain < 80 * 600**2
    assert schur > 0
