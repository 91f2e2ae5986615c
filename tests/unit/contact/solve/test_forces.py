"""Many candidates: what is found on the touching nodes holds on all, and equals what compiled code finds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fingerslip.contact.frames import contact_frames
from fingerslip.contact.solve import forces as module
from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.forces import solve_contact
from fingerslip.contact.solve.newton import ContactSolution, solve_friction
from problems.contact import friction_residual

TOLERANCE = 1e-10


@pytest.fixture(autouse=True)
def always_on_a_working_set(monkeypatch):
    monkeypatch.setattr(module, "_FEW", 0)


def half_space(side, depth, slide, dim=3):
    """Return a paraboloid of side x side nodes pressed on a half-space (1/r compliance) and pulled sideways."""
    x, y = (part.ravel() for part in np.meshgrid(*[np.linspace(-1.0, 1.0, side)] * 2))
    distance = np.hypot(x[:, None] - x, y[:, None] - y) + 0.5 / side * np.eye(side**2)
    body = np.kron(0.05 / distance, np.eye(dim) + 0.1 * (np.eye(dim, k=1) + np.eye(dim, k=-1)))
    free = np.column_stack([x**2 + 0.7 * y**2 - depth, np.full((side**2, dim - 1), 0.0)])
    free[:, 1] = slide
    return Compliance(body, np.full((side**2, dim), 0.1)), free, np.full(side**2, 0.6)


@pytest.mark.parametrize("slide", [0.0, 0.05, 0.2, 2.0])
@pytest.mark.parametrize("depth", [0.1, 0.5, 2.5])
def test_forces_are_those_of_the_compiled_solver_on_all_candidates(depth, slide):
    compliance, free, friction = half_space(14, depth, slide)
    start = np.zeros_like(free)
    exact = solve_friction(compliance.matrix, free, friction, start, TOLERANCE)
    found, working_set = solve_contact(compliance, free, friction, start, TOLERANCE)
    np.testing.assert_allclose(found.response, compliance.response(found.forces), rtol=1e-12, atol=0.0)
    assert found.residual <= TOLERANCE
    np.testing.assert_allclose(found.forces, exact.forces, atol=1e-8 * np.abs(exact.forces).max())
    assert working_set.nodes.size < len(free) or depth > 1.0


def test_a_path_is_followed_with_what_the_step_before_left():
    """Pressed, then pulled in small steps: the working set and its factor are taken along, and grow where they must."""
    forces, working_set, sizes = np.zeros((196, 3)), None, []
    for depth, slide in [*((0.1 * k, 0.0) for k in range(1, 7)), *((0.6, 0.02 * k) for k in range(1, 9))]:
        compliance, free, friction = half_space(14, depth, slide)
        found, working_set = solve_contact(compliance, free, friction, forces, TOLERANCE, working_set=working_set)
        own = np.abs(friction_residual(compliance.matrix, free, friction, found.forces)).max()
        assert own <= TOLERANCE * np.abs(found.forces).max()
        forces = found.forces
        sizes.append(working_set.nodes.size)
        assert np.isin(np.flatnonzero(forces[:, 0]), working_set.nodes).all()
    assert sizes[-1] > sizes[0]


def test_forces_that_grow_steadily_are_foreseen():
    """In sticking contact forces are linear in the slide: two steps tell the third, which then needs no iteration."""
    forces, working_set, iterations = np.zeros((196, 3)), None, []
    for slide, goal in ((0.0, 1e-10), (1e-4, 1e-10), (2e-4, 1e-10), (3e-4, 1e-8)):
        compliance, free, _ = half_space(14, 0.5, slide)
        found, working_set = solve_contact(compliance, free, np.full(196, 10.0), forces, goal, working_set=working_set)
        forces = found.forces
        iterations.append(found.iterations)
    assert iterations[-1] == 0 < iterations[1]


def test_a_search_from_an_earlier_solution_of_the_step_foresees_nothing():
    """It begins where it ended, and the next step extrapolates from the start of this one."""
    compliance, free, friction = half_space(14, 0.5, 1e-4)
    origin = np.zeros_like(free)
    found, used = solve_contact(compliance, free, friction, origin, TOLERANCE)
    given = {"working_set": used, "origin": origin}
    again, used = solve_contact(compliance, free, friction, found.forces, 100.0 * TOLERANCE, **given)
    assert again.iterations == 0
    assert used.past.before is origin


def test_a_working_set_that_is_too_large_is_made_smaller():
    compliance, free, friction = half_space(14, 2.5, 0.0)
    _, large = solve_contact(compliance, free, friction, np.zeros_like(free), TOLERANCE)
    _, free, _ = half_space(14, 0.1, 0.0)
    start = np.zeros_like(free)
    start[98] = 1.0
    _, small = solve_contact(compliance, free, friction, start, TOLERANCE, working_set=large)
    assert small.nodes.size < large.nodes.size / 2


def test_nothing_that_touches_gives_exact_zeros():
    compliance, free, friction = half_space(14, -0.1, 0.3)
    found, _ = solve_contact(compliance, free, friction, np.ones_like(free), TOLERANCE)
    assert found.residual == 0.0
    assert not found.forces.any()


def test_frames_that_turn_are_followed():
    compliance, free, friction = half_space(14, 0.4, 0.1)
    normals = np.tile([0.0, 0.6, 0.8], (196, 1))
    turning = Compliance(compliance.body, compliance.penalty, contact_frames(normals, np.array([1.0, 0.0, 0.0])))
    found, working_set = solve_contact(turning, free, friction, np.zeros_like(free), TOLERANCE)
    exact = solve_friction(turning.matrix, free, friction, np.zeros_like(free), TOLERANCE)
    np.testing.assert_allclose(found.forces, exact.forces, atol=1e-8 * np.abs(exact.forces).max())
    again, _ = solve_contact(
        turning, free, friction, found.forces, TOLERANCE, working_set=replace(working_set, past=None)
    )
    assert again.iterations <= 1  # at the tolerance itself, rounding decides whether one more is due


def test_where_newton_stalls_the_robust_solver_goes_on(monkeypatch):
    monkeypatch.setattr(module, "newton_krylov", lambda own, _, start: (start.forces, own, False, 3))
    compliance, free, friction = half_space(10, 0.5, 0.2)
    found, _ = solve_contact(compliance, free, friction, np.zeros_like(free), TOLERANCE)
    assert found.residual <= TOLERANCE
    assert found.iterations > 3


def test_a_wrong_answer_is_never_passed_off(monkeypatch):
    """If all fails the residual, over all candidates, says so."""
    monkeypatch.setattr(module, "newton_krylov", lambda own, _, start: (start.forces + 1.0, own, False, 1))
    monkeypatch.setattr(module, "solve_friction", lambda *given: ContactSolution(0 * given[1] + 1.0, 0.0, 1, 0))
    compliance, free, friction = half_space(10, 0.5, 0.2)
    found, _ = solve_contact(compliance, free, friction, np.zeros_like(free), TOLERANCE)
    own = np.abs(friction_residual(compliance.matrix, free, friction, found.forces)).max(axis=1)
    assert found.residual == pytest.approx(own.max() / np.abs(found.forces).max())
    assert found.residual > 1e-3
    assert found.worst == np.argmax(own)


def test_few_candidates_are_solved_all_together(monkeypatch):
    monkeypatch.setattr(module, "_FEW", 900)
    compliance, free, friction = half_space(5, 0.5, 0.2)
    found, working_set = solve_contact(compliance, free, friction, np.zeros_like(free), TOLERANCE)
    assert working_set is None
    assert found.residual <= TOLERANCE
