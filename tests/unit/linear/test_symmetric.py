"""Products for which a matrix is read once, or half of it, are those of NumPy and SciPy."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy import sparse

from fingerslip.linear.symmetric import (
    add_columns,
    compiled_parts,
    long_product,
    row_products,
    symmetric_parts,
    symmetric_product,
    symmetric_products,
    write_products,
    write_symmetric_product,
)

SIZES = [0, 1, 2, 3, 4, 5, 7, 8, 150, 151]


def example(size: int, precision: type) -> np.ndarray:
    root = np.random.default_rng(size).normal(size=(size, size))
    return (root + root.T).astype(precision)


@pytest.mark.parametrize("of_matrix", [np.float32, np.float64])
@pytest.mark.parametrize("of_vector", [np.float32, np.float64])
@pytest.mark.parametrize("size", SIZES)
def test_a_product_reads_the_lower_triangle_alone(size: int, of_vector: type, of_matrix: type) -> None:
    matrix = example(size, of_matrix)
    vector = np.random.default_rng(1).normal(size=2 * size)[::2].astype(of_vector)
    half = np.where(np.tri(size, dtype=bool), matrix, np.nan).astype(of_matrix)
    found, exact = symmetric_product(half, vector), matrix.astype(float) @ vector.astype(float)
    assert found.dtype == of_vector
    allowed = 3e-6 if of_vector is np.float32 else 1e-14
    np.testing.assert_allclose(found, exact, atol=allowed * size, rtol=0.0)


def test_entries_of_single_precision_are_taken_as_they_are() -> None:
    """The product is that of the rounded matrix to double precision, not to single precision."""
    matrix, vector = example(200, np.float64), np.random.default_rng(1).normal(size=200)
    rounded = matrix.astype(np.float32)
    exact = rounded.astype(np.longdouble) @ vector.astype(np.longdouble)
    size = float(np.abs(exact).max())
    assert np.abs(symmetric_product(rounded, vector) - exact).max() < 1e-14 * size
    assert np.abs(matrix @ vector - exact).max() > 1e-9 * size


@pytest.mark.parametrize("size", [1, 6, 149])
def test_the_leading_part_is_multiplied_where_the_vector_is_shorter(size: int) -> None:
    matrix, vector = example(150, np.float32), np.random.default_rng(1).normal(size=size)
    found = np.full(size, np.nan)
    write_symmetric_product(matrix, vector, found)
    np.testing.assert_allclose(found, matrix[:size, :size].astype(float) @ vector, atol=1e-12)


@pytest.mark.parametrize("precision", [np.float32, np.float64])
@pytest.mark.parametrize("shape", [(0, 3), (1, 1), (5, 2), (700, 8)])
def test_columns_are_multiplied_as_vectors_are(shape: tuple[int, int], precision: type) -> None:
    matrix, columns = example(shape[0], precision), np.random.default_rng(1).normal(size=shape)
    found = symmetric_products(matrix, columns)
    assert found.dtype == np.float64
    expected = [symmetric_product(matrix, column) for column in columns.T]
    np.testing.assert_allclose(found.T, np.reshape(expected, shape[::-1]), atol=1e-11)


def test_threads_that_share_a_matrix_find_the_same() -> None:
    matrix, vectors = example(300, np.float32), np.random.default_rng(2).normal(size=(100, 300))
    with ThreadPoolExecutor(4) as pool:
        beside = list(pool.map(lambda vector: symmetric_product(matrix, vector), vectors))
    for vector, found in zip(vectors, beside, strict=True):
        np.testing.assert_array_equal(found, symmetric_product(matrix, vector))


def symmetric(size, density=0.3):
    matrix = sparse.random_array((size, size), density=density, rng=np.random.default_rng(size), format="csr")
    return sparse.csr_matrix(matrix + matrix.T)


@pytest.mark.parametrize(("size", "density"), [(1, 0.3), (2, 0.3), (25, 0.3), (3, 0.0)])
@pytest.mark.parametrize("count", [1, 2, 3, 9])
def test_products_are_those_of_scipy(count, size, density):
    matrix, rows = symmetric(size, density), np.random.default_rng(count).normal(size=(count, size))
    found = row_products(symmetric_parts(matrix), rows)
    np.testing.assert_allclose(found, (matrix @ rows.T).T, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("count", [1, 2])
def test_a_rigid_motion_has_no_force(count):
    """Springs between neighbours: what cancels in a row does so but for rounding, however far the motion goes."""
    stiff = 1e6 * sparse.diags([-1.0, 2.0, -1.0], [-1, 0, 1], shape=(200, 200)).tolil()
    stiff[0, 0] = stiff[-1, -1] = 1e6
    found = row_products(symmetric_parts(stiff.tocsr()), np.full((count, 200), 1e3))
    assert np.abs(found).max() <= 1e-15 * 1e6 * 1e3


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
