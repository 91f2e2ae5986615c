"""Newton with GMRES directions: the directions are Newton's, and an old factor serves as well as a new one."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.contact import krylov
from fingerslip.contact.krylov import WorkSet, newton_krylov
from fingerslip.contact.projection import step_lengths
from fingerslip.contact.solver import friction_residual, solve_friction


def problem(seed, count, dim=3, friction=0.5):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(count * dim, count * dim))
    block = root @ root.T / (count * dim) + 0.3 * np.eye(count * dim)
    scale = step_lengths(np.diag(block).reshape(count, dim).copy())
    work = WorkSet(np.arange(count), block, scale, (scale.reshape(-1, 1) * block).astype(np.float32))
    return work, rng.normal(size=(count, dim)) - np.eye(1, dim), np.full(count, friction)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("dim", [2, 3])
def test_solutions_are_those_of_the_compiled_solver(seed, dim):
    work, free, friction = problem(seed, 20, dim)
    start = np.zeros_like(free)
    forces, work, solved, iterations = newton_krylov(work, free, friction, start, (1e-10, 0.0))
    if solved:
        assert np.abs(friction_residual(work.block, free, friction, forces)).max() <= 1e-10 * np.abs(forces).max()
        exact = solve_friction(work.block, free, friction, start, 1e-10).forces
        np.testing.assert_allclose(forces, exact, atol=1e-7 * np.abs(exact).max())
        assert iterations > 0
    assert solved or seed not in {0, 1, 2}


def test_sliding_nodes_are_on_the_cone_and_open_ones_without_force_to_the_last_digit():
    work, free, friction = problem(0, 40)
    forces, _, solved, _ = newton_krylov(work, free, friction, np.ones_like(free), (1e-10, 0.0))
    assert solved
    closed = forces[:, 0] > 0.0
    assert 0 < closed.sum() < 40
    assert not forces[~closed].any()
    share = np.linalg.norm(forces[closed, 1:], axis=1) / (0.5 * forces[closed, 0])
    assert ((share < 0.999) | (np.abs(share - 1.0) < 1e-14)).all()
    assert (share > 0.999).any()


def test_directions_are_newtons_own():
    work, free, friction = problem(3, 15)
    forces = np.abs(np.random.default_rng(1).normal(size=free.shape))
    trial, residual = krylov._evaluate(work, free, friction, forces)
    direction, _ = krylov._direction(work, friction, trial, residual, 1e-6)
    slopes = krylov._slopes(trial, friction)
    matrix = np.eye(45)
    scaled = work.scale.reshape(-1, 1) * work.block
    for node in range(15):
        rows = slice(3 * node, 3 * node + 3)
        matrix[rows] -= slopes[node] @ (np.eye(45) - scaled)[rows]
    exact = np.linalg.solve(matrix, -residual.ravel())
    np.testing.assert_allclose(direction.ravel(), exact, atol=1e-4 * np.abs(exact).max())


def test_a_factor_is_kept_while_it_serves_and_made_anew_when_it_does_not(monkeypatch):
    made, factorised = [], krylov._factorised
    monkeypatch.setattr(krylov, "_factorised", lambda *given: made.append(None) or factorised(*given))
    work, free, friction = problem(0, 30)
    _, work, _, _ = newton_krylov(work, free, friction, np.zeros_like(free), (1e-10, 0.0))
    first = len(made)
    newton_krylov(work, free + 1e-3, friction, np.zeros_like(free), (1e-10, 0.0))
    assert first >= 1
    assert len(made) == first
    monkeypatch.setattr(krylov, "_STALE_AFTER", 0)
    newton_krylov(work, free + 1e-3, friction, np.zeros_like(free), (1e-10, 0.0))
    assert len(made) > first


def test_a_solution_needs_no_iterations():
    work, free, friction = problem(0, 20)
    forces = newton_krylov(work, free, friction, np.zeros_like(free), (1e-11, 0.0))[0]
    again, _, solved, iterations = newton_krylov(work, free, friction, forces, (1e-10, 0.0))
    assert (solved, iterations) == (True, 0)
    np.testing.assert_allclose(again, forces, atol=1e-9 * np.abs(forces).max())


@pytest.mark.parametrize("unit", [1e-12, 1e9])
def test_the_size_of_forces_does_not_matter_though_directions_are_single_precision(unit):
    work, free, friction = problem(0, 20)
    forces = newton_krylov(work, free, friction, np.zeros_like(free), (1e-10, 0.0))[0]
    scaled = newton_krylov(work, unit * free, friction, np.zeros_like(free), (1e-10, 0.0))[0]
    np.testing.assert_allclose(scaled / unit, forces, atol=1e-8 * np.abs(forces).max())
