"""Dense factors: those of the matrix, made by threads side by side."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from fingerslip.contact.solve.dense import factorise_dense, solve_by_factors


def solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    factor, found = factorise_dense(matrix.copy()), right.copy()
    solve_by_factors(factor.factors, factor.pivots, found)
    return found


@pytest.mark.parametrize("size", [0, 1, 2, 7, 150])
def test_solutions_are_those_of_the_matrix(size: int) -> None:
    rng = np.random.default_rng(size)
    # Rows have to be swapped.
    matrix, wanted = rng.normal(size=(size, size)), rng.normal(size=size)
    np.testing.assert_allclose(solved(matrix, matrix @ wanted), wanted, rtol=1e-9, atol=1e-10)


def test_factors_take_the_place_of_the_matrix() -> None:
    matrix = np.random.default_rng(0).normal(size=(20, 20))
    assert factorise_dense(matrix).factors is matrix


def test_threads_that_factorise_side_by_side_find_the_same() -> None:
    matrices = np.random.default_rng(2).normal(size=(40, 120, 120))
    with ThreadPoolExecutor(4) as pool:
        beside = list(pool.map(lambda matrix: solved(matrix, np.ones(120)), matrices))
    for matrix, found in zip(matrices, beside, strict=True):
        np.testing.assert_array_equal(found, solved(matrix, np.ones(120)))


def test_a_singular_matrix_leaves_finite_solutions() -> None:
    """What they solve is checked."""
    matrix = np.random.default_rng(1).normal(size=(6, 6))
    matrix[:, 2] = 0.0
    assert np.isfinite(solved(matrix, np.ones(6))).all()
