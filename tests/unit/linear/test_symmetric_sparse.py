"""Products of sparse symmetric matrices are those of SciPy, whatever is on their diagonal."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from fingerslip.linear.symmetric import symmetric_parts, write_symmetric_products


def symmetric(size, density=0.3):
    matrix = sparse.random_array((size, size), density=density, rng=np.random.default_rng(size), format="csr")
    return sparse.csr_matrix(matrix + matrix.T)


@pytest.mark.parametrize("size", [1, 2, 25])
@pytest.mark.parametrize("count", [1, 2, 3, 9])
def test_products_are_those_of_scipy(count, size):
    matrix, rows = symmetric(size), np.random.default_rng(count).normal(size=(count, size))
    found = np.full_like(rows, np.nan)
    write_symmetric_products(symmetric_parts(matrix), rows, found)
    np.testing.assert_allclose(found, (matrix @ rows.T).T, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("count", [1, 2])
def test_a_rigid_motion_has_no_force(count):
    """Springs between neighbours: what cancels in a row does so but for rounding, however far the motion goes."""
    stiff = 1e6 * sparse.diags([-1.0, 2.0, -1.0], [-1, 0, 1], shape=(200, 200)).tolil()
    stiff[0, 0] = stiff[-1, -1] = 1e6
    rows, found = np.full((count, 200), 1e3), np.empty((count, 200))
    write_symmetric_products(symmetric_parts(stiff.tocsr()), rows, found)
    assert np.abs(found).max() <= 1e-15 * 1e6 * 1e3


def test_a_matrix_without_entries_gives_zeros():
    found = np.full((1, 3), np.nan)
    write_symmetric_products(symmetric_parts(sparse.csr_matrix((3, 3))), np.ones((1, 3)), found)
    assert not found.any()
