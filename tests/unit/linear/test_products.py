"""Products for which a matrix is read once are those of SciPy."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from fingerslip.linear.products import two_products


def test_two_products_are_those_of_scipy():
    rng = np.random.default_rng(0)
    matrix = sparse.random_array((40, 30), density=0.2, rng=rng, format="csr")
    first, second = rng.normal(size=(2, 30))
    one, other = two_products(matrix, first, second)
    np.testing.assert_allclose(one, matrix @ first, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(other, matrix @ second, rtol=1e-14, atol=1e-15)


def test_a_matrix_without_rows_gives_nothing():
    one, other = two_products(sparse.csr_matrix((0, 3)), np.ones(3), np.ones(3))
    assert one.shape == other.shape == (0,)
