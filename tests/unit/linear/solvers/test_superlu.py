"""SuperLU: an order of its own for large matrices, and the Schur complement from the ends of its factors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from fingerslip.errors import FingerslipError
from fingerslip.linear.solvers import superlu
from fingerslip.linear.solvers.superlu import SuperLU
from problems.matrices import positive_definite

SOLVER = SuperLU()


def test_a_singular_matrix_is_refused():
    with pytest.raises(FingerslipError, match=r"SuperLU: .*singular; the matrix is not positive definite"):
        SOLVER.factorise(sparse.csr_matrix(np.zeros((3, 3))))


@pytest.mark.parametrize("columns", [(), (3,)])
def test_an_order_of_elimination_changes_nothing_in_the_solution(columns, monkeypatch):
    monkeypatch.setattr(superlu, "_LARGE", 10)
    matrix = positive_definite(150)
    right = np.random.default_rng(0).normal(size=(150, *columns))
    factor = SOLVER.factorise(matrix)
    np.testing.assert_allclose(matrix @ factor.backward(factor.forward(right)), right, atol=1e-9)


def test_separate_bodies_have_a_schur_complement_too():
    """SuperLU then takes the unknowns of one body after the other, whatever order it is given."""
    blocks = [positive_definite(40, seed) for seed in (1, 2)]
    matrix, kept = sparse.block_diag(blocks, format="csr"), np.array([3, 20, 45, 70])
    exact = np.linalg.inv(np.linalg.inv(matrix.toarray())[np.ix_(kept, kept)])
    _, found = SOLVER.factorise_around(matrix, kept)
    np.testing.assert_allclose(found, exact, atol=1e-10 * np.abs(exact).max())


@pytest.mark.parametrize("seed", range(5))
def test_entries_are_counted_as_in_a_dense_factorisation(seed):
    """A few of the counted entries may cancel out."""
    matrix = positive_definite(50, seed)
    exact = np.count_nonzero(np.abs(np.linalg.cholesky(matrix.toarray())) > 1e-14)
    assert exact <= superlu._count_entries(matrix.indptr, matrix.indices) <= 1.03 * exact


def test_the_estimate_grows_with_what_is_kept_for_the_end():
    matrix = sparse.csr_matrix(sparse.kronsum(*[sparse.diags([-1.0, 3.0, -1.0], [-1, 0, 1], shape=(40, 40))] * 2))
    few, many = (SOLVER.bytes_around(matrix, np.arange(count)) for count in (10, 400))
    assert 16 * 1600 < few < many
