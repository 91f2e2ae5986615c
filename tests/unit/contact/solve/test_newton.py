"""The frictional contact problem: every condition is checked, and a wrong solution is never passed off."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerslip.contact.solve import newton, projection
from fingerslip.contact.solve.newton import solve_friction
from problems.contact import TOLERANCE, assert_conditions, friction_residual, random_problem

problems = st.builds(
    random_problem,
    seed=st.integers(0, 2**31),
    dim=st.sampled_from([2, 3]),
    count=st.integers(1, 25),
    decades=st.floats(0.0, 6.0),
    friction=st.sampled_from([0.0, 0.1, 0.3, 0.6, 1.0, 1.5]) | st.floats(0.0, 1.5),
)
hard_problems = st.builds(
    random_problem,
    seed=st.integers(0, 2**31),
    dim=st.sampled_from([2, 3]),
    count=st.integers(1, 12),
    decades=st.floats(0.0, 6.0),
    friction=st.floats(1.5, 5.0),
)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(problems)
def test_random_problems_are_solved(problem):
    compliance, free, friction = problem.arguments
    solution = solve_friction(compliance, free, friction, np.zeros_like(free), TOLERANCE)
    assert solution.residual <= TOLERANCE
    assert_conditions(problem, solution)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(hard_problems)
def test_great_friction_is_solved_or_the_residual_says_that_it_is_not(problem):
    """Beyond mu of about 1.5 with arbitrary coupling a solution need not be found, but never may a wrong one pass."""
    compliance, free, friction = problem.arguments
    solution = solve_friction(compliance, free, friction, np.zeros_like(free), TOLERANCE)
    own = np.abs(friction_residual(compliance, free, friction, solution.forces)).max()
    assert solution.residual * np.abs(solution.forces).max() == pytest.approx(own, rel=1e-6, abs=1e-13)
    if solution.residual <= TOLERANCE:
        assert_conditions(problem, solution)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(problems, st.floats(-9.0, 9.0), st.floats(-9.0, 9.0))
def test_the_units_of_length_and_force_do_not_matter(problem, length, force):
    compliance, free, friction = problem.arguments
    metre, newton = 10.0**length, 10.0**force
    start = np.zeros_like(free)
    one = solve_friction(compliance, free, friction, start, TOLERANCE)
    other = solve_friction(compliance * metre / newton, free * metre, friction, start, TOLERANCE)
    assert other.residual <= TOLERANCE
    scale = np.abs(one.forces).max()
    np.testing.assert_allclose(other.forces / newton, one.forces, atol=1e-7 * scale)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.integers(0, 2**31), st.integers(1, 15), st.sampled_from([2, 3]), st.floats(0.0, 0.2))
def test_small_friction_has_one_solution_whatever_the_start(seed, count, dim, friction):
    """Coulomb's problem is a contraction for small friction: every start must lead to the same forces."""
    compliance, free, mu = random_problem(seed, dim, count, 0.0, friction).arguments
    compliance += np.eye(count * dim)
    rng = np.random.default_rng(seed)
    starts = [np.zeros_like(free), rng.normal(size=free.shape), 100 * np.abs(rng.normal(size=free.shape))]
    found = [solve_friction(compliance, free, mu, start, TOLERANCE) for start in starts]
    for other in found[1:]:
        np.testing.assert_allclose(other.forces, found[0].forces, atol=1e-7 * np.abs(found[0].forces).max() + 1e-300)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("decades", range(8))
def test_a_nearly_free_body_is_solved(dim, decades):
    """Rigid motions of an unsupported body are many decades more compliant than its penalties."""
    rng = np.random.default_rng(decades)
    count = 15
    modes = np.zeros((count * dim, 3))
    modes[0::dim, 0], modes[1::dim, 1], modes[0::dim, 2] = 1.0, 1.0, rng.uniform(-1, 1, count)
    compliance = 10.0**decades * modes @ modes.T + np.eye(count * dim)
    free = 0.1 * rng.normal(size=(count, dim)) - np.eye(1, dim)
    friction = np.full(count, 0.6)
    solution = solve_friction(compliance, free, friction, np.zeros_like(free), TOLERANCE)
    assert solution.residual <= TOLERANCE


@pytest.mark.parametrize("dim", [2, 3])
def test_all_open_gives_exact_zeros(dim):
    compliance, free, friction = random_problem(3, dim, 10, 2.0, 0.6).arguments
    free[:, 0] = np.abs(free[:, 0]) + 0.1
    start = np.ones_like(free)
    solution = solve_friction(compliance, free, friction, start, TOLERANCE)
    assert solution.residual == 0.0
    assert not solution.forces.any()


@pytest.mark.parametrize("dim", [2, 3])
def test_all_sliding_in_one_direction_reaches_the_cone(dim):
    compliance, free, friction = random_problem(4, dim, 10, 0.0, 0.4).arguments
    compliance = 0.01 * compliance + np.eye(10 * dim)
    free[:, 0], free[:, 1:] = -1.0, 0.0
    free[:, 1] = 50.0
    forces = solve_friction(compliance, free, friction, np.zeros_like(free), TOLERANCE).forces
    np.testing.assert_allclose(np.linalg.norm(forces[:, 1:], axis=1), 0.4 * forces[:, 0], rtol=1e-12)
    assert (forces[:, 1] < 0.0).all()


def test_one_node_in_closed_form_in_3d():
    """Uncoupled node: r_n = -q_n k_n; it sticks while |q_t k_t| <= mu r_n and else slips along q_t."""
    normal, tangential = 4.0, 2.0
    compliance = np.diag([1 / normal, 1 / tangential, 1 / tangential])
    mu = np.array([0.5])
    stuck = solve_friction(compliance, np.array([[-1.0, 0.3, -0.4]]), mu, np.zeros((1, 3)), 1e-13).forces[0]
    np.testing.assert_allclose(stuck, [4.0, -0.6, 0.8], rtol=1e-12)
    slipped = solve_friction(compliance, np.array([[-1.0, 3.0, -4.0]]), mu, np.zeros((1, 3)), 1e-13).forces[0]
    np.testing.assert_allclose(slipped, [4.0, -1.2, 1.6], rtol=1e-12)


def test_a_singular_newton_matrix_is_left_to_the_sweeps():
    """Sliding to one side with mu W_nt / W_nn = -1 has no Newton direction; the node sticks, with r = -W^-1 q."""
    compliance, free = np.array([[1.0, 0.5], [0.5, 1.0]]), np.array([[-1.0, 10.0]])
    solution = solve_friction(compliance, free, np.array([2.0]), np.zeros((1, 2)), TOLERANCE)
    assert solution.residual <= TOLERANCE
    np.testing.assert_allclose(solution.forces, [[8.0, -14.0]], rtol=1e-9)


def test_frictionless_normal_problem_is_the_quadratic_programme():
    """Without friction the forces minimise r W r / 2 + q r over r_n >= 0: no other feasible point is lower."""
    compliance, free, friction = random_problem(11, 2, 12, 1.0, 0.0).arguments
    forces = solve_friction(compliance, free, friction, np.zeros_like(free), TOLERANCE).forces[:, 0]
    rows = np.arange(0, 24, 2)
    normal = compliance[np.ix_(rows, rows)]
    rng = np.random.default_rng(5)

    def energy(r):
        return 0.5 * r @ normal @ r + free[:, 0] @ r

    others = np.maximum(forces + rng.normal(scale=0.1, size=(500, 12)), 0.0)
    assert min(energy(r) for r in others) > energy(forces)


def test_the_first_guess_is_left_as_it_was():
    compliance, free, friction = random_problem(1, 2, 8, 1.0, 0.6).arguments
    start, before = np.ones_like(free), (compliance.copy(), free.copy())
    solve_friction(compliance, free, friction, start, TOLERANCE)
    np.testing.assert_array_equal(start, 1.0)
    np.testing.assert_array_equal(compliance, before[0])
    np.testing.assert_array_equal(free, before[1])


def test_a_good_first_guess_needs_no_iterations():
    compliance, free, friction = random_problem(1, 2, 20, 3.0, 0.6).arguments
    forces = solve_friction(compliance, free, friction, np.zeros_like(free), TOLERANCE).forces
    assert solve_friction(compliance, free, friction, forces, TOLERANCE).iterations == 0


def test_no_candidates_need_no_solution():
    solution = solve_friction(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros(0), np.zeros((0, 2)), TOLERANCE)
    assert solution.forces.shape == (0, 2)
    assert solution.residual == 0.0


def test_residual_of_a_wrong_force_is_not_zero():
    compliance, free, friction = random_problem(2, 2, 6, 1.0, 0.6).arguments
    free[:, 0] = -1.0
    right = solve_friction(compliance, free, friction, np.zeros_like(free), TOLERANCE).forces
    wrong = right.copy()
    wrong[np.argmax(right[:, 0]), 0] *= 1.01
    assert np.abs(friction_residual(compliance, free, friction, right)).max() <= 1e-9 * right.max()
    assert np.abs(friction_residual(compliance, free, friction, wrong)).max() >= 1e-3 * right.max()


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("tangential", [0.3, 5.0])
@pytest.mark.parametrize("mu", [0.0, 0.6, 3.0])
def test_the_derivative_of_the_projection_is_that_of_finite_differences(dim, tangential, mu):
    """On both sides of stick/slip, away from the kink itself; the projection has no smoothing."""
    trial = np.array([1.2, tangential, -0.4 * tangential][:dim])
    exact = np.zeros((dim, dim))
    projection.derivative(trial, mu, exact)
    step, numeric = 1e-6, np.zeros((dim, dim))
    for column in range(dim):
        out = [np.zeros(dim), np.zeros(dim)]
        for side, sign in zip(out, (1, -1), strict=True):
            projection.project_node(trial + sign * step * np.eye(dim)[column], mu, side)
        numeric[:, column] = (out[0] - out[1]) / (2 * step)
    np.testing.assert_allclose(exact, numeric, atol=1e-8)


def test_an_interrupt_inside_compiled_code_stays_an_interrupt(monkeypatch):
    def interrupted(*_):
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    monkeypatch.setattr(newton, "_solve", interrupted)
    with pytest.raises(KeyboardInterrupt):
        solve_friction(np.eye(2), np.array([[-1.0, 0.1]]), np.array([0.5]), np.zeros((1, 2)), 1e-12)
