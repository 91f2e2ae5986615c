"""MKL PARDISO through its own interface: the Schur complement, and matrices that it refuses."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from fingerslip.errors import FingerslipError
from fingerslip.linear.pardiso import PardisoFactor, PardisoSchurFactor, pardiso_schur_bytes
from unit.dynamics.matrices import needs_mkl, positive_definite

pytestmark = needs_mkl


def test_a_factor_is_unchanged_by_a_schur_complement_beside_it():
    matrix = positive_definite(60)
    factor, right = PardisoFactor(matrix), np.arange(60.0)
    PardisoSchurFactor(matrix, np.arange(20), np.zeros((20, 20)))
    np.testing.assert_allclose(matrix @ factor.backward(factor.forward(right)), right, atol=1e-9)


@pytest.mark.parametrize("coupling", [0.0, 2.0])
def test_an_indefinite_matrix_has_no_schur_complement(coupling):
    """One has a negative entry on the diagonal, without neighbours; the other is indefinite by its coupling."""
    ends = -1.0 if coupling == 0.0 else 1.0
    matrix = np.array([[1.0, coupling, 0, 0], [coupling, ends, 0, 0], [0, 0, 2.0, 0.5], [0, 0, 0.5, 3.0]])
    with pytest.raises(FingerslipError, match="the matrix is not positive definite"):
        PardisoSchurFactor(sparse.csr_matrix(matrix), np.array([3]), np.zeros((1, 1)))


def test_the_analysis_tells_the_memory():
    """At least the entries of a dense lower triangle, for a dense matrix of 600 unknowns, and not ten times that."""
    matrix = sparse.csr_matrix(np.eye(600) + 0.001)
    assert 8 * 600**2 / 2 < pardiso_schur_bytes(matrix, np.arange(100)) < 80 * 600**2
