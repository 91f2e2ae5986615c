"""GMRES in compiled code: solutions are as exact as they should be, and so is what they are said to do."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.contact.frames import contact_frames
from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.gmres import Preconditioner, ScaledCompliance, new_space, solve, write_motion
from fingerslip.contact.solve.local_inverse import renew_rows
from fingerslip.contact.solve.projection import step_lengths
from fingerslip.contact.solve.working_set import gather

COUNT, DIM = 30, 3


def working_set(count=COUNT):
    rng = np.random.default_rng(count)
    root = rng.normal(size=(count * DIM, count * DIM))
    block = root @ root.T / (count * DIM) + 0.3 * np.eye(count * DIM)
    scale = step_lengths(np.diag(block).reshape(count, DIM))
    return gather(Compliance(block, np.zeros((count, DIM))), scale, np.arange(count), None)


def slopes(count=COUNT):
    """Return derivatives of the projection of nodes that stick, slip and are open, in turns."""
    found = np.tile(np.eye(DIM, dtype=np.float32), (count, 1, 1))
    found[1::3] = [[1.0, 0.0, 0.0], [0.5, 0.3, 0.1], [0.2, 0.1, 0.4]]
    found[2::3] = 0.0
    return found


def matrices(given, scaled):
    """Return rho W of a working set and the Newton matrix J = I - G (I - rho W), from their definitions."""
    size = given.size // DIM
    lower = np.tril(scaled.body[: given.size // DIM, : given.size // DIM].astype(float))
    whole, turn, gradient = lower + np.tril(lower, -1).T, np.zeros((size, size)), np.zeros((size, size))
    for node, (frame, slope) in enumerate(zip(scaled.frames, given, strict=True)):
        rows = slice(node * DIM, node * DIM + DIM)
        turn[rows, rows], gradient[rows, rows] = frame, slope
    response = scaled.of_body.reshape(-1, 1) * (turn @ whole @ turn.T) + np.diag(scaled.of_penalty.ravel())
    return response, np.eye(size) - gradient @ (np.eye(size) - response)


def no_help(count=COUNT):
    """Return the preconditioner that changes nothing: no groups, and unit matrices of single nodes."""
    size = count * DIM
    near, rows = np.arange(count)[:, None], np.tile(np.eye(DIM, dtype=np.float32), (count, 1, 1))
    none = np.zeros((size, 1), np.float32), np.zeros((1, 1), np.float32)
    return Preconditioner(np.zeros(size, dtype=np.int64), *none, near, rows)


def two_levels(nodes, given):
    inverse, weights = nodes.inverse.copy(), (nodes.scale * nodes.factor, nodes.scale * nodes.penalty)
    of_nodes = inverse.near, inverse.rows, inverse.marks, given, nodes.frames, weights
    assert renew_rows(*of_nodes, nodes.coupling.body, np.arange(len(given))) == len(given)
    return Preconditioner.of(given, nodes.coarse, inverse)


def right_side(size=COUNT * DIM):
    right = np.random.default_rng(5).normal(size=size).astype(np.float32)
    return right / np.linalg.norm(right)


def test_what_forces_do_is_the_compliance_in_the_frames_of_the_nodes():
    rng = np.random.default_rng(2)
    normals = rng.normal(size=(COUNT, DIM))
    frames = contact_frames(normals / np.linalg.norm(normals, axis=1, keepdims=True), np.array([1.0, 0.0, 0.0]))
    body = rng.normal(size=(COUNT * DIM, COUNT * DIM))
    scaled = ScaledCompliance(body, frames, *rng.uniform(0.5, 1.0, (2, COUNT, DIM)))
    for part in (scaled, scaled.of_first(COUNT // 2)):
        forces = rng.normal(size=part.of_body.size)
        moved = np.empty_like(forces)
        write_motion(part, forces, moved)
        whole, _ = matrices(np.zeros((len(part.frames), DIM, DIM)), part)
        np.testing.assert_allclose(moved, whole @ forces, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("exactness", [1e-1, 1e-3, 1e-5])
@pytest.mark.parametrize("helped", [True, False])
def test_directions_solve_as_exactly_as_they_should(helped, exactness):
    nodes, given, right = working_set(), slopes(), right_side()
    scaled = ScaledCompliance.of(nodes, np.float32)
    help_given = two_levels(nodes, given) if helped else no_help()
    found, moved, reached = solve(given, scaled, help_given, right, exactness, new_space(right.size, right.size))
    response, matrix = matrices(given, scaled)
    assert reached
    assert np.linalg.norm(matrix @ found - right) <= 1.1 * exactness + 1e-6
    np.testing.assert_allclose(moved, response @ found, atol=1e-5 * np.abs(moved).max())


def test_too_few_directions_are_said_to_be():
    nodes, given, right = working_set(), slopes(), right_side()
    scaled = ScaledCompliance.of(nodes, np.float32)
    residuals = [1.0]
    for limit in (1, 3, 9):
        found, _, reached = solve(given, scaled, no_help(), right, 1e-6, new_space(right.size, limit))
        assert not reached
        residuals.append(np.linalg.norm(matrices(given, scaled)[1] @ found - right))
    assert residuals == sorted(residuals, reverse=True)


def test_a_space_serves_for_fewer_nodes_too():
    nodes, given, right = working_set(), slopes()[:8], right_side(8 * DIM)
    scaled = ScaledCompliance.of(nodes, np.float32).of_first(8)
    found, _, reached = solve(given, scaled, no_help(8), right, 1e-5, new_space(COUNT * DIM, 60))
    assert reached
    np.testing.assert_allclose(matrices(given, scaled)[1] @ found, right, atol=3e-5)


def test_a_matrix_without_an_image_ends_with_finite_numbers():
    right = right_side()
    nothing = np.zeros((COUNT * DIM, COUNT * DIM), np.float32)
    frames = np.tile(np.eye(DIM, dtype=np.float32), (COUNT, 1, 1))
    scaled = ScaledCompliance(nothing, frames, *np.zeros((2, COUNT, DIM), np.float32))
    stuck = np.tile(np.eye(DIM, dtype=np.float32), (COUNT, 1, 1))
    found, _, reached = solve(stuck, scaled, no_help(), right, 1e-5, new_space(right.size, 10))
    assert not reached
    assert np.isfinite(found).all()
