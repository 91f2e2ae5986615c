"""Products for which a matrix is read once are those of SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from fingerslip.linear.symmetric import add_columns, compiled_parts, long_product, write_products


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


@pytest.mark.parametrize("shape", [(40, 30), (0, 3)])
@pytest.mark.parametrize("count", [0, 1, 3, 7, 8, 9, 16, 19])
def test_products_with_many_vectors_are_those_of_scipy_to_the_last_digit(shape, count):
    rng = np.random.default_rng(3)
    matrix = sparse.csr_matrix(sparse.random_array(shape, density=0.2, rng=rng))
    rows = rng.normal(size=(count, shape[1]))
    found = np.full((count, shape[0]), np.nan)
    write_products(compiled_parts(matrix), rows, found)
    np.testing.assert_array_equal(found, (matrix @ rows.T).T)
