"""The frictional contact problem: every solver meets the conditions, and none passes a wrong solution off."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerslip.contact.counterfaces import contact_frames
from fingerslip.contact.solve import forces as module
from fingerslip.contact.solve import krylov, newton
from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.forces import solve_contact
from fingerslip.contact.solve.newton import ContactSolution, solve_friction
from fingerslip.contact.solve.projection import derivative, project, step_lengths
from problems.contact import TOLERANCE, assert_conditions, friction_residual, pressed_row, random_problem

ORDINARY = st.sampled_from([0.0, 0.1, 0.3, 0.6, 1.0, 1.5]) | st.floats(0.0, 1.5)


def random_problems(dims=(2, 3), friction=ORDINARY, most=25):
    return st.builds(
        random_problem,
        seed=st.integers(0, 2**31),
        dim=st.sampled_from(dims),
        count=st.integers(1, most),
        decades=st.floats(0.0, 6.0),
        friction=friction,
    )


def compliance_of(problem, precision=np.float64, frames=None):
    """Return the compliance of a problem, its penalties beside the body."""
    return Compliance(problem.body.astype(precision), problem.penalty, frames)


def solved(compliance, free, friction, start=None, tolerance=TOLERANCE, **past):
    """Return the solution of a step, and what it leaves for the next one."""
    start = np.zeros_like(free) if start is None else start
    return solve_contact(compliance, free, friction, start, tolerance, **past)


def exact_forces(compliance, free, friction, tolerance=TOLERANCE):
    """Return the forces that the compiled solver finds on all nodes."""
    return solve_friction(compliance.matrix, free, friction, np.zeros_like(free), tolerance).forces


def assert_same_forces(found, expected, share=1e-8):
    np.testing.assert_allclose(found, expected, atol=share * np.abs(expected).max())


@pytest.fixture
def working_set(monkeypatch):
    """Have few nodes solved as many are: on a working set, by Newton's method with GMRES."""
    monkeypatch.setattr(module, "_FEW", 0)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(random_problems())
def test_random_problems_are_solved(problem):
    solution = problem.solution()
    assert solution.residual <= TOLERANCE
    assert_conditions(problem, solution)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(random_problems(dims=(2,)), st.integers(0, 2**31))
def test_any_step_in_2d_is_solved_from_any_other(problem, seed):
    """A step begins with the forces and the factors of the one before, whose states may all be others."""
    compliance, rng, past, start = compliance_of(problem), np.random.default_rng(seed), None, None
    for _ in range(3):
        solution, past = solved(compliance, problem.free, problem.friction, start, working_set=past)
        assert solution.residual <= TOLERANCE
        assert_conditions(problem, solution)
        residual = np.abs(friction_residual(compliance.matrix, problem.free, problem.friction, solution.forces)).max()
        stated = solution.residual * np.abs(solution.forces).max()
        assert stated == pytest.approx(residual, rel=1e-6, abs=1e-13)
        if solution.response is not None:
            np.testing.assert_allclose(solution.response, compliance.response(solution.forces), atol=1e-9)
        start, problem = solution.forces, replace(problem, free=rng.normal(size=problem.free.shape))


@settings(max_examples=50, deadline=None, derandomize=True)
@given(random_problems(), st.floats(-9.0, 9.0), st.floats(-9.0, 9.0))
def test_the_units_of_length_and_force_do_not_matter(problem, length, force):
    compliance, free, friction = problem.arguments
    metre, newton = 10.0**length, 10.0**force
    start = np.zeros_like(free)
    expected = solve_friction(compliance, free, friction, start, TOLERANCE)
    other = solve_friction(compliance * metre / newton, free * metre, friction, start, TOLERANCE)
    assert other.residual <= TOLERANCE
    assert_same_forces(other.forces / newton, expected.forces, 1e-7)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.integers(0, 2**31), st.integers(1, 15), st.sampled_from([2, 3]), st.floats(0.0, 0.2))
def test_small_friction_has_one_solution_whatever_the_start(seed, count, dim, friction):
    """Coulomb's problem is a contraction for small friction: every start must lead to the same forces."""
    compliance, free, mu = random_problem(seed, dim, count, 0.0, friction).arguments
    compliance += np.eye(count * dim)
    rng = np.random.default_rng(seed)
    starts = [np.zeros_like(free), rng.normal(size=free.shape), 100 * np.abs(rng.normal(size=free.shape))]
    first, *others = (solve_friction(compliance, free, mu, start, TOLERANCE).forces for start in starts)
    for other in others:
        np.testing.assert_allclose(other, first, atol=1e-7 * np.abs(first).max() + 1e-300)


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
    solution = solve_friction(compliance, free, np.full(count, 0.6), np.zeros_like(free), TOLERANCE)
    assert solution.residual <= TOLERANCE


def test_the_projection_and_its_step_lengths():
    """Forces inside the cone stay, others come to its wall or vanish; both tangents have one step length."""
    trial = np.array([[2.0, 0.3, 0.4], [2.0, 3.0, 4.0], [-1.0, 5.0, 5.0], [0.0, 1.0, 0.0]])
    expected = [[2.0, 0.3, 0.4], [2.0, 0.6, 0.8], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    np.testing.assert_allclose(project(trial, np.full(4, 0.5)), expected)
    np.testing.assert_allclose(step_lengths(np.array([[2.0, 4.0, 12.0]])), [[0.5, 0.125, 0.125]])


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("tangential", [0.2, 5.0])
@pytest.mark.parametrize("mu", [0.0, 0.6, 3.0])
def test_the_derivative_of_the_projection_is_its_slope(dim, tangential, mu):
    """In sticking and in slipping contact, by central differences."""
    trial, slope = np.array([1.2, tangential, -0.4 * tangential][:dim]), np.zeros((dim, dim))
    derivative(trial, mu, slope)
    sides = (project(trial + sign * 1e-6 * np.eye(dim), np.full(dim, mu)) for sign in (1, -1))
    np.testing.assert_allclose(slope, np.subtract(*sides).T / 2e-6, atol=1e-8)


@pytest.fixture(params=["few", "many"])
def few_or_many(request):
    if request.param == "many":
        request.getfixturevalue("working_set")


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.usefixtures("few_or_many")
class TestAnyNumber:
    def test_all_open_gives_exact_zeros(self, dim):
        problem = random_problem(3, dim, 10, 2.0, 0.6)
        problem.free[:, 0] = np.abs(problem.free[:, 0]) + 0.1
        solution, _ = solved(compliance_of(problem), problem.free, problem.friction, np.ones_like(problem.free))
        assert solution.residual == 0.0
        assert not solution.forces.any()

    def test_a_solution_needs_no_iterations_and_the_inputs_are_left_as_they_were(self, dim):
        problem = random_problem(1, dim, 20, 1.0, 0.6)
        compliance = compliance_of(problem)
        copies = [array.copy() for array in (compliance.body, problem.free, problem.friction)]
        solution, past = solved(compliance, problem.free, problem.friction)
        again, _ = solved(
            compliance, problem.free, problem.friction, solution.forces, working_set=past, origin=solution.forces
        )
        assert again.iterations == 0 < solution.iterations
        for array, copy in zip((compliance.body, problem.free, problem.friction), copies, strict=True):
            np.testing.assert_array_equal(array, copy)

    def test_a_step_of_another_compliance_is_another_problem(self, dim):
        problem = random_problem(2, dim, 15, 1.0, 0.5)
        first, past = solved(compliance_of(problem), problem.free, problem.friction)
        other = Compliance(3.0 * problem.body, problem.penalty, edition=(0.1, 2))
        again, _ = solved(other, problem.free, problem.friction, first.forces, working_set=past)
        alone, _ = solved(other, problem.free, problem.friction, first.forces)
        assert_same_forces(again.forces, exact_forces(other, problem.free, problem.friction))
        assert again.iterations <= alone.iterations + 2

    def test_a_factor_scales_the_body_alone(self, dim):
        problem = random_problem(5, dim, 12, 1.0, 0.5)
        whole, scaled = compliance_of(problem), Compliance(problem.body / 8.0, problem.penalty, factor=8.0)
        expected, _ = solved(whole, problem.free, problem.friction)
        found, _ = solved(scaled, problem.free, problem.friction)
        assert_same_forces(found.forces, expected.forces)


@pytest.mark.usefixtures("few_or_many")
def test_a_singular_newton_matrix_is_left_to_the_sweeps():
    """Sliding to one side with mu W_nt / W_nn = -1 has no Newton direction; the node sticks, with r = -W^-1 q."""
    compliance = Compliance(np.array([[0.9, 0.5], [0.5, 0.9]]), np.full((1, 2), 0.1))
    solution, _ = solved(compliance, np.array([[-1.0, 10.0]]), np.array([2.0]))
    assert solution.residual <= TOLERANCE
    np.testing.assert_allclose(solution.forces, [[8.0, -14.0]], rtol=1e-9)


def test_no_candidates_need_no_solution_and_a_residual_that_is_no_number_is_not_below_the_tolerance():
    for dim in (2, 3):
        none = np.zeros((0, dim))
        solution, _ = solved(Compliance(np.zeros((0, 0)), none), none, np.zeros(0))
        assert solution.forces.shape == (0, dim)
        assert solution.residual == 0.0
    problem = random_problem(0, 2, 5, 1.0, 0.6)
    problem.free[2, 0] = np.nan
    assert not solved(compliance_of(problem), problem.free, problem.friction)[0].residual <= TOLERANCE


def pulled(row, slides):
    """Yield the solution of each step of a row that is pulled sideways, with what the step before leaves."""
    (compliance, penalty, free, friction), start, past = row, None, None
    body = Compliance(compliance - np.diag(penalty.ravel()), penalty)
    for slide in slides:
        moved = free + np.array([0.0, slide])
        solution, past = solved(body, moved, friction, start, 1e-12, working_set=past)
        start = solution.forces
        yield solution


def test_threads_side_by_side_find_the_same():
    rows, slides = [pressed_row(count) for count in range(40, 60)], np.linspace(0.0, 1.0, 10)
    with ThreadPoolExecutor(4) as pool:
        beside = list(pool.map(lambda row: list(pulled(row, slides)), rows))
    for row, solutions in zip(rows, beside, strict=True):
        for solution, alone in zip(solutions, pulled(row, slides), strict=True):
            np.testing.assert_array_equal(solution.forces, alone.forces)


def half_space(side, depth, slide, dim=3):
    """Return a paraboloid of side x side nodes pressed on a half-space (1/r compliance) and pulled sideways."""
    x, y = (part.ravel() for part in np.meshgrid(*[np.linspace(-1.0, 1.0, side)] * 2))
    distance = np.hypot(x[:, None] - x, y[:, None] - y) + 0.5 / side * np.eye(side**2)
    body = np.kron(0.05 / distance, np.eye(dim) + 0.1 * (np.eye(dim, k=1) + np.eye(dim, k=-1)))
    free = np.column_stack([x**2 + 0.7 * y**2 - depth, np.full((side**2, dim - 1), 0.0)])
    free[:, 1] = slide
    return Compliance(body, np.full((side**2, dim), 0.1)), free, np.full(side**2, 0.6)


def turned_frames(count):
    normals = np.random.default_rng(3).normal((0.0, 0.0, 3.0), size=(count, 3))
    return contact_frames(normals / np.linalg.norm(normals, axis=1, keepdims=True), np.array([1.0, 0.0, 0.0]))


def count_robust_solutions(monkeypatch):
    """Count how often Newton's method with GMRES does not get there, so that the compiled solver goes on."""
    calls, solve = [], module.solve_friction
    monkeypatch.setattr(module, "solve_friction", lambda *problem: calls.append(1) or solve(*problem))
    return calls


@pytest.mark.parametrize("slide", [0.0, 0.05, 0.2, 2.0])
@pytest.mark.parametrize("depth", [0.1, 0.5, 2.5])
@pytest.mark.usefixtures("working_set")
def test_forces_on_a_working_set_are_those_on_all_candidates(depth, slide, monkeypatch):
    robust = count_robust_solutions(monkeypatch)
    compliance, free, friction = half_space(14, depth, slide)
    solution, working_set = solved(compliance, free, friction)
    assert solution.residual <= TOLERANCE
    assert solution.iterations < 30
    assert not robust, "GMRES gets there"
    assert_same_forces(solution.forces, exact_forces(compliance, free, friction))
    np.testing.assert_allclose(solution.response, compliance.response(solution.forces), rtol=1e-12, atol=0.0)
    assert working_set.nodes.size < len(free) or depth > 1.0


@pytest.mark.usefixtures("working_set")
def test_six_directions_of_gmres_suffice(monkeypatch):
    """Without the coarse space or the local inverses of the preconditioner they do not."""
    robust = count_robust_solutions(monkeypatch)
    monkeypatch.setattr(krylov, "_KRYLOV_LIMIT", 6)
    for depth, slide in ((0.5, 0.05), (2.5, 0.2), (2.5, 2.0)):
        compliance, free, friction = half_space(22, depth, slide)
        assert solved(compliance, free, friction)[0].residual <= TOLERANCE
    assert not robust


@pytest.mark.parametrize("precision", [np.float32, np.float64])
@pytest.mark.parametrize("few_directions", [False, True])
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.usefixtures("working_set")
def test_random_problems_are_solved_on_a_working_set(dim, few_directions, precision, monkeypatch):
    """Directions of GMRES that are cut short still lead there: the compiled solver never has to go on."""
    robust = count_robust_solutions(monkeypatch)
    if few_directions:
        monkeypatch.setattr(krylov, "_KRYLOV_LIMIT", 3)
    for seed in range(15):
        problem = random_problem(seed, dim, 20, 1.0, 0.5)
        compliance = compliance_of(problem, precision, turned_frames(20) if dim == 3 and seed % 2 else None)
        solution, _ = solved(compliance, problem.free, problem.friction)
        residual = np.abs(friction_residual(compliance.matrix, problem.free, problem.friction, solution.forces)).max()
        assert residual <= 1.01 * TOLERANCE * np.abs(solution.forces).max()
        touching = solution.forces[:, 0] > 0.0
        assert not solution.forces[~touching].any()
        share = np.linalg.norm(solution.forces[touching, 1:], axis=1) / (0.5 * solution.forces[touching, 0])
        assert ((share < 0.999) | (np.abs(share - 1.0) < 1e-12)).all(), "sliding nodes are on the cone"
    assert not robust


@pytest.mark.parametrize("unit", [1e-12, 1e9])
@pytest.mark.usefixtures("working_set")
def test_the_size_of_forces_does_not_matter_though_directions_are_of_single_precision(unit):
    problem = random_problem(0, 3, 20, 1.0, 0.5)
    compliance = compliance_of(problem)
    expected, _ = solved(compliance, problem.free, problem.friction)
    scaled, _ = solved(compliance, unit * problem.free, problem.friction)
    assert_same_forces(scaled.forces / unit, expected.forces)


@pytest.mark.parametrize("turning", [False, True])
@pytest.mark.usefixtures("working_set")
def test_a_path_is_followed_with_what_the_step_before_left(turning):
    """Pressed, then pulled in small steps: the working set grows where it must, in frames that stay and that turn."""
    forces, working_set, sizes, iterations = np.zeros((196, 3)), None, [], []
    for depth, slide in [*((0.1 * k, 0.0) for k in range(1, 7)), *((0.6, 0.02 * k) for k in range(1, 9))]:
        compliance, free, friction = half_space(14, depth, slide)
        if turning:
            normals = np.tile([0.0, 0.6 + 2.0 * slide, 0.8], (196, 1))
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
            compliance = replace(compliance, frames=contact_frames(normals, np.array([1.0, 0.0, 0.0])))
        solution, working_set = solved(compliance, free, friction, forces, working_set=working_set)
        residual = np.abs(friction_residual(compliance.matrix, free, friction, solution.forces)).max()
        assert residual <= TOLERANCE * np.abs(solution.forces).max()
        forces = solution.forces
        sizes.append(working_set.nodes.size)
        iterations.append(solution.iterations)
        assert np.isin(np.flatnonzero(forces[:, 0]), working_set.nodes).all()
    assert sizes[-1] > sizes[0]
    assert np.median(iterations) <= 4
    assert max(iterations) <= 12


@pytest.mark.usefixtures("working_set")
def test_forces_that_grow_steadily_are_foreseen_and_a_search_within_a_step_foresees_nothing():
    """In sticking contact forces are linear in the slide: two steps tell the third, which then needs no iteration."""
    start, past, iterations = np.zeros((196, 3)), None, []
    for slide, goal in ((0.0, 1e-10), (1e-4, 1e-10), (2e-4, 1e-10), (3e-4, 1e-8)):
        compliance, free, _ = half_space(14, 0.5, slide)
        solution, after = solved(compliance, free, np.full(196, 10.0), start, goal, working_set=past)
        iterations.append(solution.iterations)
        within, _ = solved(compliance, free, np.full(196, 10.0), solution.forces, goal, working_set=after, origin=start)
        assert within.iterations <= 1, "it begins where the first search ended"
        assert_same_forces(within.forces, solution.forces)
        start, past = solution.forces, after
    assert iterations[-1] == 0 < iterations[1]


@pytest.mark.usefixtures("working_set")
def test_a_working_set_that_is_too_large_is_made_smaller():
    compliance, free, friction = half_space(14, 2.5, 0.0)
    _, large = solved(compliance, free, friction)
    _, free, _ = half_space(14, 0.1, 0.0)
    start = np.zeros_like(free)
    start[98] = 1.0
    _, small = solved(compliance, free, friction, start, working_set=large)
    assert small.nodes.size < large.nodes.size / 2


@pytest.mark.usefixtures("working_set")
def test_where_newton_stalls_the_robust_solver_goes_on_and_a_wrong_answer_is_never_passed_off(monkeypatch):
    """If all fails the residual, over all candidates, says so."""
    compliance, free, friction = half_space(10, 0.5, 0.2)
    monkeypatch.setattr(module, "newton_krylov", lambda *given, **_: (given[2], False, 3))
    robust, _ = solved(compliance, free, friction)
    assert robust.residual <= TOLERANCE
    assert robust.iterations > 3
    monkeypatch.setattr(module, "newton_krylov", lambda *given, **_: (given[2] + 1.0, False, 1))
    monkeypatch.setattr(module, "solve_friction", lambda *given: ContactSolution(0 * given[1] + 1.0, 0.0, 1, 0))
    solution, _ = solved(compliance, free, friction)
    residual = np.abs(friction_residual(compliance.matrix, free, friction, solution.forces)).max(axis=1)
    assert solution.residual == pytest.approx(residual.max() / np.abs(solution.forces).max())
    assert solution.residual > 1e-3
    assert solution.worst == np.argmax(residual)


def test_an_interrupt_inside_compiled_code_stays_an_interrupt(monkeypatch):
    def interrupted(*_):
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    monkeypatch.setattr(newton, "compiled_solve", interrupted)
    with pytest.raises(KeyboardInterrupt):
        solve_friction(np.eye(2), np.array([[-1.0, 0.1]]), np.array([0.5]), np.zeros((1, 2)), 1e-12)
