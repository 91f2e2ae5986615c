"""Contact in 2D, piece by piece: what the compiled solver finds, with matrices that serve over steps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerslip.contact.solve import pieces as module
from fingerslip.contact.solve.newton import solve_friction
from fingerslip.contact.solve.pieces import solve_by_pieces
from fingerslip.contact.states import OPEN, SLIP, STICK
from problems.contact import TOLERANCE, assert_conditions, friction_residual, random_problem

problems = st.builds(
    random_problem,
    seed=st.integers(0, 2**31),
    dim=st.just(2),
    count=st.integers(1, 25),
    decades=st.floats(0.0, 6.0),
    friction=st.sampled_from([0.0, 0.3, 0.6, 1.0, 1.5]) | st.floats(0.0, 1.5),
)


def pressed_row(count, slide, mu=0.6):
    """Return a shallow arch of nodes on an elastic row, pressed and pulled sideways."""
    x = np.linspace(-1.0, 1.0, count)
    body = np.kron(0.1 / (np.abs(x[:, None] - x) + 0.5 / count), np.eye(2) + 0.1 * (np.eye(2, k=1) + np.eye(2, k=-1)))
    free = np.column_stack([x**2 - 0.5, np.full(count, slide)])
    return body + 0.1 * np.eye(2 * count), free, np.full(count, mu)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(problems)
def test_random_problems_are_solved(problem):
    compliance, free, friction = problem.arguments
    solution, _ = solve_by_pieces(compliance, free, friction, np.zeros_like(free), TOLERANCE)
    assert solution.residual <= TOLERANCE
    assert_conditions(problem, solution)
    own = np.abs(friction_residual(compliance, free, friction, solution.forces)).max()
    assert solution.residual * np.abs(solution.forces).max() == pytest.approx(own, rel=1e-6, abs=1e-13)


def test_no_step_of_a_path_takes_more_factors_than_the_compiled_solver_and_most_take_none(monkeypatch):
    """Pulled in small steps, most steps change no state: their matrices are those of the step before."""
    made = []
    factorise = module.factorise_dense
    monkeypatch.setattr(module, "factorise_dense", lambda matrix: made.append(len(matrix)) or factorise(matrix))
    forces, other, piece, iterations = np.zeros((60, 2)), np.zeros((60, 2)), None, 0
    before = 0
    compliance, free, friction = pressed_row(60, 0.0)
    for slide in np.linspace(0.0, 1.0, 401):
        given_ = compliance, free + np.array([0.0, slide]), friction
        exact = solve_friction(*given_, other, 1e-12)
        found, piece = solve_by_pieces(*given_, forces, 1e-12, piece=piece)
        np.testing.assert_allclose(found.forces, exact.forces, atol=1e-10 * np.abs(exact.forces).max())
        np.testing.assert_allclose(piece.product.ravel(), given_[0] @ found.forces.ravel(), rtol=1e-10, atol=1e-13)
        # The compiled solver makes a matrix in every iteration; one more solution in the last piece needs none.
        assert len(made) - before <= exact.iterations
        assert found.iterations <= exact.iterations + 1
        forces, other, iterations, before = found.forces, exact.forces, iterations + exact.iterations, len(made)
    assert len(made) < 0.2 * iterations


def test_the_unknowns_are_the_normal_forces_and_those_that_stick():
    compliance, free, friction = pressed_row(60, 0.2)
    solution, piece = solve_by_pieces(compliance, free, friction, np.zeros_like(free), 1e-12)
    counts = [np.count_nonzero(piece.states == state) for state in (OPEN, STICK, SLIP)]
    assert min(counts) > 0
    assert piece.unknowns.size == 2 * counts[1] + counts[2]
    slides = piece.states == SLIP
    np.testing.assert_array_equal(solution.forces[slides, 1], piece.slopes[slides] * solution.forces[slides, 0])


def test_a_piece_of_another_compliance_is_not_used():
    compliance, free, friction = pressed_row(20, 0.2)
    first, piece = solve_by_pieces(compliance, free, friction, np.zeros_like(free), 1e-12)
    again, _ = solve_by_pieces(2.0 * compliance, 2.0 * free, friction, first.forces, 1e-12, piece=piece)
    np.testing.assert_allclose(again.forces, first.forces, rtol=1e-9, atol=1e-12)


def test_the_compiled_solver_takes_over_where_no_step_helps(monkeypatch):
    def stuck(*given_):
        return module._STUCK, 0, given_[6], given_[7], None, None, None, None, np.inf, 0

    monkeypatch.setattr(module, "_newton", stuck)
    compliance, free, friction = pressed_row(20, 0.2)
    exact = solve_friction(compliance, free, friction, np.zeros_like(free), 1e-12)
    found, _ = solve_by_pieces(compliance, free, friction, np.zeros_like(free), 1e-12)
    np.testing.assert_array_equal(found.forces, exact.forces)
    assert found.iterations == exact.iterations


def test_a_residual_that_is_no_number_is_not_below_the_tolerance():
    compliance, free, friction = pressed_row(5, 0.2)
    free[2, 0] = np.nan
    solution, _ = solve_by_pieces(compliance, free, friction, np.zeros_like(free), 1e-12)
    assert not solution.residual <= TOLERANCE


def test_no_candidates_are_no_problem():
    none = np.zeros((0, 2))
    solution, piece = solve_by_pieces(np.zeros((0, 0)), none, np.zeros(0), none, 1e-12)
    assert solution.forces.shape == (0, 2)
    assert piece is None


def test_factors_serve_while_few_nodes_change_their_states(monkeypatch):
    """Pulled to and fro, nodes stick and slip: what the factors of one piece give is what those of each would."""
    made = []
    factorise = module.factorise_dense
    monkeypatch.setattr(module, "factorise_dense", lambda matrix: made.append(len(matrix)) or factorise(matrix))
    compliance, free, friction = pressed_row(40, 0.0)
    counts = {}
    for most in (0, module._MOST_BORDERS):
        monkeypatch.setattr(module, "_MOST_BORDERS", most)
        made.clear()
        forces, piece, found = np.zeros((40, 2)), None, []
        for slide in np.concatenate([np.linspace(0.0, 0.5, 60), np.linspace(0.5, -0.5, 120)]):
            given_ = compliance, free + np.array([0.0, slide]), friction, forces, 1e-12
            solution, piece = solve_by_pieces(*given_, piece=piece)
            forces = solution.forces
            found.append(forces)
        counts[most] = len(made), np.stack(found)
    (each, exact), (few, found) = counts.values()
    np.testing.assert_allclose(found, exact, atol=1e-11 * np.abs(exact).max())
    assert few < 0.25 * each
