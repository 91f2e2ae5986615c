"""Products for which a matrix is read once are those of SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from fingerslip.linear.products import add_columns, long_product, products


def test_a_matrix_without_rows_gives_nothing():
    assert products(sparse.csr_matrix((0, 3)), np.ones((2, 3))).shape == (2, 0)


def test_a_product_with_long_rows_is_that_of_scipy():
    rng = np.random.default_rng(1)
    matrix = sparse.random_array((20, 300), density=0.5, rng=rng, format="csr")
    vector = rng.normal(size=300)
    np.testing.assert_allclose(long_product(matrix, vector), matrix @ vector, rtol=1e-13, atol=1e-13)


def test_columns_are_added_to_a_copy():
    rng = np.random.default_rng(2)
    matrix = sparse.random_array((30, 12), density=0.3, rng=rng, format="csc")
    vector, weights = rng.normal(size=30), np.where(np.arange(12) % 3, rng.normal(size=12), 0.0)
    before = vector.copy()
    np.testing.assert_allclose(add_columns(vector, matrix, weights), vector + matrix @ weights, rtol=1e-14, atol=1e-14)
    np.testing.assert_array_equal(vector, before)


@pytest.mark.parametrize("count", [0, 1, 2, 3, 7, 8, 9, 16, 19])
def test_products_of_any_number_of_vectors_are_those_of_scipy(count):
    rng = np.random.default_rng(3)
    matrix = sparse.random_array((40, 30), density=0.2, rng=rng, format="csr")
    rows = rng.normal(size=(count, 30))
    found = products(matrix, rows)
    np.testing.assert_allclose(found, (matrix @ rows.T).T, rtol=1e-13, atol=1e-14)
    assert found.flags.c_contiguous


@pytest.mark.parametrize("count", [3, 8, 13])
def test_many_products_add_up_in_the_order_of_scipy(count):
    rng = np.random.default_rng(4)
    matrix = sparse.random_array((20, 30), density=0.2, rng=rng, format="csr")
    columns = rng.normal(size=(30, count))
    np.testing.assert_array_equal(products(matrix, columns.T), (matrix @ columns).T)
