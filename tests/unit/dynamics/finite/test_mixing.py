"""Mixing of iterates: a linear problem is solved in as many iterations as it has unknowns."""

from __future__ import annotations

import numpy as np

from fingerslip.dynamics.finite.mixing import Mixing


def residuals(matrix: np.ndarray, factors: np.ndarray, iterations: int, *, mixed: bool) -> list[float]:
    """Return the residuals of matrix x = b, iterated on with other factors."""
    right, unknown, mixing = np.arange(1.0, len(matrix) + 1.0), np.zeros(len(matrix)), Mixing()
    found = []
    for _ in range(iterations):
        residual = right - matrix @ unknown
        found.append(float(np.linalg.norm(residual)))
        end = unknown + np.linalg.solve(factors, residual)
        unknown = mixing.next(end, residual) if mixed else end
    return found


def test_the_first_iterate_is_the_end_of_the_iteration() -> None:
    end = np.array([1.0, 2.0])
    assert Mixing().next(end, np.array([1.0, 0.0])) is end


def test_a_linear_problem_is_solved_in_as_many_iterations_as_unknowns() -> None:
    chance = np.random.default_rng(3)
    matrix = chance.standard_normal((4, 4))
    matrix = matrix @ matrix.T + 4.0 * np.eye(4)
    factors = matrix + 0.3 * np.diag(np.diag(matrix))
    found = residuals(matrix, factors, 7, mixed=True)
    assert found[5] <= 1e-10 * found[0]
    assert residuals(matrix, factors, 7, mixed=False)[5] >= 1e-4 * found[0]


def test_an_iteration_that_diverges_by_itself_converges_when_mixed() -> None:
    matrix, factors = np.diag([1.0, 3.0, 5.0]), np.eye(3)
    assert residuals(matrix, factors, 6, mixed=False)[-1] > 1e2
    assert residuals(matrix, factors, 6, mixed=True)[-1] < 1e-9


def test_residuals_that_do_not_change_mix_nothing() -> None:
    mixing, residual = Mixing(), np.ones(3)
    for value in (1.0, 2.0, 3.0):
        assert np.isfinite(mixing.next(np.full(3, value), residual)).all()
