"""Products for which a matrix is read once, or half of it, are those of NumPy and SciPy."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from fingerslip.linear.symmetric import symmetric_product, write_symmetric_product

SIZES = [0, 1, 2, 3, 4, 5, 7, 8, 150, 151]


def example(size: int, precision: type) -> np.ndarray:
    root = np.random.default_rng(size).normal(size=(size, size))
    return (root + root.T).astype(precision)


@pytest.mark.parametrize("of_matrix", [np.float32, np.float64])
@pytest.mark.parametrize("of_vector", [np.float32, np.float64])
def test_a_product_reads_the_lower_triangle_alone(of_vector: type, of_matrix: type) -> None:
    for size in SIZES:
        matrix = example(size, of_matrix)
        vector = np.random.default_rng(1).normal(size=2 * size)[::2].astype(of_vector)
        half = np.where(np.tri(size, dtype=bool), matrix, np.nan).astype(of_matrix)
        found, exact = symmetric_product(half, vector), matrix.astype(float) @ vector.astype(float)
        assert found.dtype == of_vector
        allowed = 3e-6 if of_vector is np.float32 else 1e-14
        np.testing.assert_allclose(found, exact, atol=allowed * size, rtol=0.0, err_msg=f"{size}")


def test_entries_of_single_precision_are_taken_as_they_are_and_the_leading_ones_of_a_shorter_vector() -> None:
    """The product is that of the rounded matrix to double precision, not to single precision."""
    matrix, vector = example(200, np.float64), np.random.default_rng(1).normal(size=200)
    rounded = matrix.astype(np.float32)
    exact = rounded.astype(np.longdouble) @ vector.astype(np.longdouble)
    size = float(np.abs(exact).max())
    assert np.abs(symmetric_product(rounded, vector) - exact).max() < 1e-14 * size
    assert np.abs(matrix @ vector - exact).max() > 1e-9 * size
    for count in (1, 6, 149):
        found = np.full(count, np.nan)
        write_symmetric_product(rounded, vector[:count], found)
        np.testing.assert_allclose(found, rounded[:count, :count].astype(float) @ vector[:count], atol=1e-12)


@pytest.mark.parametrize("precision", [np.float32, np.float64])
@pytest.mark.parametrize("shape", [(0, 3), (1, 1), (5, 2), (700, 8)])
def test_columns_are_multiplied_as_vectors_are(shape: tuple[int, int], precision: type) -> None:
    matrix, columns = example(shape[0], precision), np.random.default_rng(1).normal(size=shape)
    found = symmetric_product(matrix, columns)
    assert found.dtype == np.float64
    expected = [symmetric_product(matrix, column) for column in columns.T]
    np.testing.assert_allclose(found.T, np.reshape(expected, shape[::-1]), atol=1e-11)


def test_threads_that_share_a_matrix_find_the_same() -> None:
    matrix, vectors = example(300, np.float32), np.random.default_rng(2).normal(size=(100, 300))
    with ThreadPoolExecutor(4) as pool:
        beside = list(pool.map(lambda vector: symmetric_product(matrix, vector), vectors))
    for vector, found in zip(vectors, beside, strict=True):
        np.testing.assert_array_equal(found, symmetric_product(matrix, vector))
