"""Dense factors and products: those of the matrix, shared by threads."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from fingerslip.contact.solve.dense import factorise_dense, solve_factorised, symmetric_product


def well_conditioned(size: int, seed: int = 0) -> np.ndarray:
    """Return an unsymmetric matrix whose rows have to be swapped."""
    rng = np.random.default_rng(seed)
    matrix = 0.3 * rng.normal(size=(size, size)) / np.sqrt(size) + np.roll(np.eye(size), 1, axis=0)
    return matrix.astype(np.float32)


@pytest.mark.parametrize("size", [1, 2, 7, 150])
def test_solutions_are_those_of_double_precision(size: int) -> None:
    matrix, right = well_conditioned(size), np.random.default_rng(1).normal(size=size).astype(np.float32)
    given = right.copy()
    found = factorise_dense(matrix.copy()).solve(given)
    exact = np.linalg.solve(matrix.astype(float), right.astype(float))
    np.testing.assert_allclose(found, exact, atol=1e-4 * np.abs(exact).max())
    np.testing.assert_array_equal(given, right)


@pytest.mark.parametrize("size", [0, 1, 7, 150])
def test_compiled_code_solves_as_lapack_does(size: int) -> None:
    rng = np.random.default_rng(size)
    # Rows have to be swapped.
    matrix, wanted = rng.normal(size=(size, size)), rng.normal(size=size)
    factor = factorise_dense(matrix.copy())
    found = matrix @ wanted
    solve_factorised(factor.factors, factor.pivots, found)
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-10)


def test_factors_take_the_place_of_the_matrix() -> None:
    matrix = well_conditioned(20)
    assert factorise_dense(matrix).factors is matrix


def test_threads_that_share_a_factor_find_the_same() -> None:
    factor = factorise_dense(well_conditioned(200))
    sides = np.random.default_rng(2).normal(size=(400, 200)).astype(np.float32)
    with ThreadPoolExecutor(4) as pool:
        beside = list(pool.map(factor.solve, sides))
    for side, found in zip(sides, beside, strict=True):
        np.testing.assert_array_equal(found, factor.solve(side))


def test_a_singular_matrix_leaves_finite_solutions() -> None:
    """They precondition badly, but an iteration can go on with them."""
    matrix = well_conditioned(6)
    matrix[:, 2] = 0.0
    assert np.isfinite(factorise_dense(matrix).solve(np.ones(6, dtype=np.float32))).all()


@pytest.mark.parametrize("precision", [np.float32, np.float64])
@pytest.mark.parametrize("size", [1, 3, 150])
def test_a_symmetric_product_reads_the_lower_triangle_alone(size: int, precision: type) -> None:
    rng = np.random.default_rng(size)
    root = rng.normal(size=(size, size))
    matrix, vector = (root + root.T).astype(precision), rng.normal(size=2 * size)[::2].astype(precision)
    half = np.where(np.tri(size, dtype=bool), matrix, np.nan).astype(precision)
    found = symmetric_product(half, vector)
    assert found.dtype == precision
    np.testing.assert_allclose(found, matrix @ vector, rtol=1e-4 if precision is np.float32 else 1e-11, atol=1e-5)


def test_a_product_of_nothing_is_nothing_and_prints_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    """BLAS writes to standard error where a matrix has no rows."""
    assert symmetric_product(np.zeros((0, 0)), np.zeros(0)).shape == (0,)
    assert capfd.readouterr() == ("", "")
