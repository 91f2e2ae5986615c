"""Local inverses: exact where all nodes are coupled, near where the strongest are, renewed where states change."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.contact.frames import contact_frames
from fingerslip.contact.solve import local_inverse as module
from fingerslip.contact.solve.local_inverse import LocalInverse, coupled_nodes


def example(count, turning=False):
    """Return a compliance that falls with the distance, with slopes of sticking, slipping and open nodes."""
    rng = np.random.default_rng(count)
    distance = np.abs(np.arange(count)[:, None] - np.arange(count))
    shape = np.eye(3) + 0.2 * np.ones((3, 3))
    body = np.kron(1.0 / (1.0 + distance) ** 2, shape)
    normals = rng.normal(size=(count, 3)) if turning else np.tile([0.0, 0.0, 1.0], (count, 1))
    frames = contact_frames(normals / np.linalg.norm(normals, axis=1, keepdims=True), np.array([1.0, 0.0, 0.0]))
    slopes = np.tile(np.eye(3), (count, 1, 1))
    slopes[1] = [[1.0, 0.0, 0.0], [0.5, 0.3, 0.0], [0.2, 0.0, 0.4]]
    slopes[4] = 0.0
    return body, frames, slopes, rng.uniform(0.5, 1.0, (count, 3)), np.full((count, 3), 0.3)


def newton_matrix(body, frames, slopes, *, scale, penalty, factor):
    count = len(slopes)
    turn, gradient = np.zeros_like(body), np.zeros_like(body)
    for i in range(count):
        rows = slice(3 * i, 3 * i + 3)
        turn[rows, rows], gradient[rows, rows] = frames[i], slopes[i]
    whole = factor * turn @ body @ turn.T + np.diag(penalty.ravel())
    unit = np.eye(3 * count)
    return unit - gradient @ (unit - scale.reshape(-1, 1) * whole)


def renewed(inverse, body, frames, slopes, *weights):
    marks = np.concatenate([slopes, frames], axis=1)
    scale, penalty = weights
    return inverse.renewed(marks, slopes, scale, (np.tril(body).astype(np.float32), frames, penalty, 2.0))


@pytest.mark.parametrize("turning", [True, False])
def test_among_all_nodes_it_is_the_inverse(turning):
    body, frames, slopes, scale, penalty = example(7, turning)
    slopes[4] = np.eye(3)
    near = coupled_nodes(body, 7)
    made = renewed(LocalInverse.empty(near, (7, 6, 3)), body, frames, slopes, scale, penalty)
    matrix = newton_matrix(body, frames, slopes, scale=scale, penalty=penalty, factor=2.0)
    vector = np.random.default_rng(0).normal(size=21)
    found = made.solve((matrix @ vector).astype(np.float32))
    np.testing.assert_allclose(found, vector, atol=1e-4)


def test_open_nodes_keep_their_part():
    body, frames, slopes, scale, penalty = example(7)
    made = renewed(LocalInverse.empty(coupled_nodes(body, 7), (7, 6, 3)), body, frames, slopes, scale, penalty)
    vector = np.random.default_rng(0).normal(size=21).astype(np.float32)
    np.testing.assert_array_equal(made.solve(vector)[12:15], vector[12:15])


def test_the_nearest_nodes_make_most_of_the_inverse(monkeypatch):
    monkeypatch.setattr(module, "_COUPLED", 9)
    body, frames, slopes, scale, penalty = example(60)
    near = coupled_nodes(body, 60)
    assert near.shape == (60, 9)
    np.testing.assert_array_equal(near[:, 0], np.arange(60))
    assert sorted(near[30]) == list(range(26, 35))
    made = renewed(LocalInverse.empty(near, (60, 6, 3)), body, frames, slopes, scale, penalty)
    matrix = newton_matrix(body, frames, slopes, scale=scale, penalty=penalty, factor=2.0)
    product = np.stack([made.solve(column.astype(np.float32)) for column in matrix.T], axis=1)
    values = np.linalg.eigvals(product)
    assert np.abs(values - 1.0).max() < 0.5 < np.abs(np.linalg.eigvals(matrix) - 1.0).max()


def test_only_rows_near_a_node_that_changed_are_made_again(monkeypatch):
    monkeypatch.setattr(module, "_COUPLED", 3)
    body, frames, slopes, scale, penalty = example(30)
    first = renewed(LocalInverse.empty(coupled_nodes(body, 30), (30, 6, 3)), body, frames, slopes, scale, penalty)
    assert renewed(first, body, frames, slopes, scale, penalty) is first
    slightly = slopes.copy()
    slightly[1, 1, 0] += 0.05
    assert renewed(first, body, frames, slightly, scale, penalty) is first
    later = slopes.copy()
    later[20] = slopes[1]
    again = renewed(first, body, frames, later, scale, penalty)
    changed = (again.rows != first.rows).any(axis=(1, 2))
    np.testing.assert_array_equal(np.flatnonzero(changed), [19, 20, 21])
    fresh = renewed(LocalInverse.empty(first.near, (30, 6, 3)), body, frames, later, scale, penalty)
    np.testing.assert_array_equal(again.rows, fresh.rows)


def test_nodes_beyond_the_working_set_are_left_out():
    body, frames, slopes, scale, penalty = example(7)
    near = coupled_nodes(body, 7)
    inside = np.where(near < 6, near, -1)[:6]
    kept = slice(0, 18)
    given = body[kept, kept], frames[:6], slopes[:6], scale[:6], penalty[:6]
    found = renewed(LocalInverse.empty(inside, (6, 6, 3)), *given)
    alone = renewed(LocalInverse.empty(coupled_nodes(given[0], 6), (6, 6, 3)), *given)
    vector = np.random.default_rng(0).normal(size=18).astype(np.float32)
    np.testing.assert_allclose(found.solve(vector), alone.solve(vector), atol=1e-5)
