"""Newton with GMRES directions: the directions are Newton's, whatever the preconditioner is worth."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from fingerslip.contact.solve import krylov
from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.krylov import Start, newton_krylov
from fingerslip.contact.solve.newton import solve_friction
from fingerslip.contact.solve.projection import project, step_lengths
from fingerslip.contact.solve.working_set import gather
from problems.contact import friction_residual


def problem(seed, count, dim=3, friction=0.5):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(count * dim, count * dim))
    block = root @ root.T / (count * dim) + 0.3 * np.eye(count * dim)
    scale = step_lengths(np.diag(block).reshape(count, dim).copy())
    working_set = gather(Compliance(block, np.zeros((count, dim))), scale, np.arange(count), None)
    return Problem(block, rng.normal(size=(count, dim)) - np.eye(1, dim), np.full(count, friction)), working_set


@dataclass(frozen=True)
class Problem:
    block: np.ndarray
    free: np.ndarray
    friction: np.ndarray

    def trial(self, working_set, forces):
        return forces - working_set.scale * ((self.block @ forces.ravel()).reshape(forces.shape) + self.free)

    def solve(self, working_set, forces=None, goal=1e-10):
        """Come back with the residual in double precision until it is small enough, as the caller does."""
        forces, total = np.zeros_like(self.free) if forces is None else forces, 0
        for _ in range(4):
            start = Start(forces, self.trial(working_set, forces), goal)
            forces, working_set, solved, iterations = newton_krylov(working_set, self.friction, start)
            total += iterations
            if not solved or self.residual(forces) <= 10 * goal:
                break
        return forces, working_set, solved, total

    def residual(self, forces):
        own = friction_residual(self.block, self.free, self.friction, forces)
        return np.abs(own).max() / np.abs(forces).max()


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("dim", [2, 3])
def test_solutions_are_those_of_the_compiled_solver(seed, dim):
    given, working_set = problem(seed, 20, dim)
    forces, working_set, solved, iterations = given.solve(working_set)
    if solved:
        assert given.residual(forces) <= 1e-9
        exact = solve_friction(given.block, given.free, given.friction, np.zeros_like(given.free), 1e-10).forces
        np.testing.assert_allclose(forces, exact, atol=1e-7 * np.abs(exact).max())
        assert iterations > 0
    assert solved or seed not in {0, 1, 2}


def test_sliding_nodes_are_on_the_cone_and_open_ones_without_force_to_the_last_digit():
    given, working_set = problem(0, 40)
    forces, _, solved, _ = given.solve(working_set, np.ones((40, 3)))
    assert solved
    closed = forces[:, 0] > 0.0
    assert 0 < closed.sum() < 40
    assert not forces[~closed].any()
    share = np.linalg.norm(forces[closed, 1:], axis=1) / (0.5 * forces[closed, 0])
    assert ((share < 0.999) | (np.abs(share - 1.0) < 1e-14)).all()
    assert (share > 0.999).any()


def test_directions_are_newtons_own_and_tell_what_they_do_to_the_trial_forces():
    given, working_set = problem(3, 15)
    forces = np.abs(np.random.default_rng(1).normal(size=(15, 3)))
    trial = given.trial(working_set, forces)
    residual = forces - project(trial, given.friction)
    direction, change, _ = krylov._direction(working_set, given.friction, trial, residual, 1e-6)
    slopes = krylov._slopes(trial, given.friction)
    matrix, scaled = np.eye(45), working_set.scale.reshape(-1, 1) * given.block
    for node in range(15):
        rows = slice(3 * node, 3 * node + 3)
        matrix[rows] -= slopes[node] @ (np.eye(45) - scaled)[rows]
    exact = np.linalg.solve(matrix, -residual.ravel())
    np.testing.assert_allclose(direction.ravel(), exact, atol=1e-4 * np.abs(exact).max())
    difference = given.trial(working_set, forces + direction) - trial
    np.testing.assert_allclose(change, difference, atol=1e-5 * np.abs(difference).max())


def count_factors(monkeypatch):
    made, factorised = [], krylov.factorise_dense
    monkeypatch.setattr(krylov, "factorise_dense", lambda matrix: made.append(len(matrix)) or factorised(matrix))
    return made


def test_nothing_is_factorised_where_the_local_inverse_is_good(monkeypatch):
    made = count_factors(monkeypatch)
    given, working_set = problem(0, 30)
    assert given.solve(working_set)[2]
    assert not made


def test_where_gmres_does_not_get_there_the_matrix_is_factorised(monkeypatch):
    made = count_factors(monkeypatch)
    given, working_set = problem(0, 30)
    exact = given.solve(working_set)[0]
    monkeypatch.setattr(krylov, "_KRYLOV_LIMIT", 3)
    forces, _, solved, _ = given.solve(working_set)
    assert solved
    assert made
    np.testing.assert_allclose(forces, exact, atol=1e-8 * np.abs(exact).max())


def test_a_solution_needs_no_iterations():
    given, working_set = problem(0, 20)
    forces = given.solve(working_set, goal=1e-12)[0]
    again, _, solved, iterations = given.solve(working_set, forces)
    assert (solved, iterations) == (True, 0)
    np.testing.assert_allclose(again, forces, atol=1e-9 * np.abs(forces).max())


@pytest.mark.parametrize("unit", [1e-12, 1e9])
def test_the_size_of_forces_does_not_matter_though_directions_are_single_precision(unit):
    given, working_set = problem(0, 20)
    forces = given.solve(working_set)[0]
    scaled = replace(given, free=unit * given.free).solve(working_set)[0]
    np.testing.assert_allclose(scaled / unit, forces, atol=1e-8 * np.abs(forces).max())
