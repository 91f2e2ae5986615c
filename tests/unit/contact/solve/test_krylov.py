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


def problem(seed, count, dim=3, friction=0.5, precision=np.float64):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(count * dim, count * dim))
    block = (root @ root.T / (count * dim) + 0.3 * np.eye(count * dim)).astype(precision)
    scale = step_lengths(np.diag(block).astype(float).reshape(count, dim))
    working_set = gather(Compliance(block, np.zeros((count, dim))), scale, rng.permutation(count), None)
    free = rng.normal(size=(count, dim)) - np.eye(1, dim)
    order = working_set.nodes
    ordered = block.reshape(count, dim, count, dim)[order][:, :, order].reshape(block.shape).astype(float)
    return Problem(ordered, free, np.full(count, friction)), working_set


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


@pytest.mark.parametrize("precision", [np.float32, np.float64])
@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("dim", [2, 3])
def test_solutions_are_those_of_the_compiled_solver(seed, dim, precision):
    given, working_set = problem(seed, 20, dim, precision=precision)
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


def test_a_compliance_of_single_precision_needs_no_caller_to_be_solved_to_the_end():
    """What directions did is computed among the nodes in double precision, so that the residual is known."""
    given, working_set = problem(0, 40, precision=np.float32)
    forces = np.zeros_like(given.free)
    start = Start(forces, given.trial(working_set, forces), 1e-13)
    forces, _, solved, _ = newton_krylov(working_set, given.friction, start)
    assert solved
    assert given.residual(forces) <= 1e-12
    rough, working_set = problem(0, 40)
    forces = np.zeros_like(rough.free)
    start = Start(forces, rough.trial(working_set, forces), 1e-13)
    forces, _, solved, _ = newton_krylov(working_set, rough.friction, start)
    assert solved
    assert 1e-12 < rough.residual(forces) <= 1e-5


@pytest.mark.parametrize("dense", [False, True])
def test_directions_are_newtons_own_and_tell_what_they_do_to_the_trial_forces(dense, monkeypatch):
    if dense:
        monkeypatch.setattr(krylov, "_KRYLOV_LIMIT", 3)
    given, working_set = problem(3, 15)
    forces = np.abs(np.random.default_rng(1).normal(size=(15, 3)))
    trial = given.trial(working_set, forces)
    residual = forces - project(trial, given.friction)
    nodes = krylov._Nodes.of(working_set, given.friction)
    direction, moved = krylov._direction(nodes, working_set.inverse.copy(), trial, residual, 1e-6)
    exact = np.linalg.solve(newton_matrix(given, working_set, trial), -residual.ravel())
    np.testing.assert_allclose(direction.ravel(), exact, atol=1e-4 * np.abs(exact).max())
    difference = given.trial(working_set, forces + direction) - trial
    np.testing.assert_allclose(direction - moved, difference, atol=1e-5 * np.abs(difference).max())


def newton_matrix(given, working_set, trial):
    size = trial.size
    slopes = krylov._slopes(trial, given.friction)
    matrix, scaled = np.eye(size), working_set.scale.reshape(-1, 1) * given.block
    for node in range(len(trial)):
        rows = slice(3 * node, 3 * node + 3)
        matrix[rows] -= slopes[node] @ (np.eye(size) - scaled)[rows]
    return matrix


def test_nodes_behind_the_last_one_that_acts_are_not_looked_at():
    trial, residual = np.full((6, 3), -1.0), np.zeros((6, 3))
    assert krylov._acting(trial, residual) == 0
    trial[2, 0] = 1.0
    assert krylov._acting(trial, residual) == 3
    residual[4, 1] = 1e-30
    assert krylov._acting(trial, residual) == 5


def count_factors(monkeypatch):
    made, matrix = [], krylov._newton_matrix
    monkeypatch.setattr(krylov, "_newton_matrix", lambda *given: made.append(None) or matrix(*given))
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


def test_a_singular_matrix_ends_the_search_without_an_error(monkeypatch):
    monkeypatch.setattr(krylov, "_KRYLOV_LIMIT", 1)
    monkeypatch.setattr(krylov, "_newton_matrix", lambda *_: np.zeros((60, 60), dtype=np.float32))
    given, working_set = problem(0, 20)
    forces, _, solved, _ = given.solve(working_set)
    assert not solved
    assert np.isfinite(forces).all()


@pytest.mark.parametrize("unit", [1e-12, 1e9])
def test_the_size_of_forces_does_not_matter_though_directions_are_single_precision(unit):
    given, working_set = problem(0, 20)
    forces = given.solve(working_set)[0]
    scaled = replace(given, free=unit * given.free).solve(working_set)[0]
    np.testing.assert_allclose(scaled / unit, forces, atol=1e-8 * np.abs(forces).max())
