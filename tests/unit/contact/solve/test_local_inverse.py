"""Local inverses: exact where all nodes are coupled, near where the strongest are, renewed where states change."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.contact.frames import contact_frames
from fingerslip.contact.solve import local_inverse as module
from fingerslip.contact.solve.local_inverse import Coupled, LocalInverse, renew_rows, write_local_product


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


def renewed(inverse, coupled, slopes, frames, *weights, nodes=None):
    """Return an inverse with new rows, and how many nodes have new ones."""
    scale, penalty = weights
    made = inverse.copy()
    given = made.near, made.rows, made.marks, slopes, frames, (2.0 * scale, scale * penalty)
    count = renew_rows(*given, coupled.body, np.arange(len(slopes)) if nodes is None else nodes)
    return made, count


def product(inverse, vector):
    found = np.full_like(vector, np.nan)
    write_local_product(inverse.near, inverse.rows, vector, found)
    return found


def fresh(count, turning=False):
    """Return the example with its coupled nodes, and an inverse of which no row is made."""
    body, *rest = example(count, turning)
    coupled = Coupled.of(body, count)
    return body, coupled, LocalInverse.empty(coupled.near, 3), *rest


@pytest.mark.parametrize("turning", [True, False])
def test_among_all_nodes_it_is_the_inverse(turning):
    body, coupled, empty, frames, slopes, scale, penalty = fresh(7, turning)
    slopes[4] = np.eye(3)
    made, count = renewed(empty, coupled, slopes, frames, scale, penalty)
    assert count == 7
    matrix = newton_matrix(body, frames, slopes, scale=scale, penalty=penalty, factor=2.0)
    vector = np.random.default_rng(0).normal(size=21)
    np.testing.assert_allclose(product(made, (matrix @ vector).astype(np.float32)), vector, atol=1e-4)


def test_open_nodes_keep_their_part():
    _, coupled, empty, *given = fresh(7)
    frames, slopes, scale, penalty = given
    made, _ = renewed(empty, coupled, slopes, frames, scale, penalty)
    vector = np.random.default_rng(0).normal(size=21).astype(np.float32)
    np.testing.assert_array_equal(product(made, vector)[12:15], vector[12:15])


def test_the_nearest_nodes_make_most_of_the_inverse(monkeypatch):
    monkeypatch.setattr(module, "_COUPLED", 9)
    body, coupled, empty, frames, slopes, scale, penalty = fresh(60)
    near = coupled.near
    assert near.shape == (60, 9)
    np.testing.assert_array_equal(near[:, 0], np.arange(60))
    assert sorted(near[30]) == list(range(26, 35))
    made, _ = renewed(empty, coupled, slopes, frames, scale, penalty)
    matrix = newton_matrix(body, frames, slopes, scale=scale, penalty=penalty, factor=2.0)
    columns = np.stack([product(made, column.astype(np.float32)) for column in matrix.T], axis=1)
    values = np.linalg.eigvals(columns)
    assert np.abs(values - 1.0).max() < 0.5 < np.abs(np.linalg.eigvals(matrix) - 1.0).max()


def test_only_rows_near_a_node_that_changed_are_made_again(monkeypatch):
    monkeypatch.setattr(module, "_COUPLED", 3)
    _, coupled, empty, frames, slopes, scale, penalty = fresh(30)
    first, _ = renewed(empty, coupled, slopes, frames, scale, penalty)
    again, count = renewed(first, coupled, slopes, frames, scale, penalty)
    assert count == 0
    np.testing.assert_array_equal(again.rows, first.rows)
    slightly = slopes.copy()
    slightly[1, 1, 0] += 0.05
    assert renewed(first, coupled, slightly, frames, scale, penalty)[1] == 0
    later = slopes.copy()
    later[20] = slopes[1]
    again, count = renewed(first, coupled, later, frames, scale, penalty)
    changed = (again.rows != first.rows).any(axis=(1, 2))
    np.testing.assert_array_equal(np.flatnonzero(changed), [19, 20, 21])
    assert count == 3
    np.testing.assert_array_equal(again.rows, renewed(empty, coupled, later, frames, scale, penalty)[0].rows)


def test_nodes_beyond_the_working_set_are_left_out():
    """Whether they are not in the set, or behind the part of it that is looked at, they count as open."""
    body, coupled, _, frames, slopes, scale, penalty = fresh(7)
    inside = np.where(coupled.near < 6, coupled.near, -1)[:6]
    given = slopes[:6], frames[:6], scale[:6], penalty[:6]
    found, _ = renewed(LocalInverse.empty(inside, 3), coupled, *given)
    alone = Coupled.of(np.ascontiguousarray(body[:18, :18]), 6)
    expected, _ = renewed(LocalInverse.empty(alone.near, 3), alone, *given)
    vector = np.random.default_rng(0).normal(size=18).astype(np.float32)
    np.testing.assert_allclose(product(found, vector), product(expected, vector), atol=1e-5)
    few = LocalInverse(found.near[:4], found.rows[:4], found.marks[:4])
    short = np.concatenate([vector[:12], np.zeros(6, dtype=np.float32)])
    np.testing.assert_allclose(product(few, vector[:12]), product(found, short)[:12], atol=1e-6)


def test_nodes_in_another_order_have_the_same_rows():
    """A working set names its nodes in any order; their local parts are those of the candidates."""
    _, coupled, empty, frames, slopes, scale, penalty = fresh(20)
    order = np.random.default_rng(0).permutation(20)
    made, _ = renewed(empty, coupled, slopes, frames, scale, penalty)
    position = np.argsort(order)
    other = LocalInverse.empty(position[coupled.near[order]], 3)
    given = slopes[order], frames[order], scale[order], penalty[order]
    found, _ = renewed(other, coupled, *given, nodes=order)
    np.testing.assert_array_equal(found.rows, made.rows[order])


def test_the_same_nodes_under_another_compliance():
    body, coupled, *_ = fresh(20)
    twice = coupled.under(2.0 * body)
    assert twice.near is coupled.near
    np.testing.assert_array_equal(twice.body, 2.0 * coupled.body)


def test_a_matrix_without_an_inverse_leaves_the_identity():
    _, coupled, empty, frames, slopes, scale, _ = fresh(7)
    nothing = Coupled(coupled.near, np.zeros_like(coupled.body))
    made, _ = renewed(empty, nothing, slopes, frames, scale, np.zeros_like(scale))
    vector = np.random.default_rng(0).normal(size=21).astype(np.float32)
    np.testing.assert_array_equal(product(made, vector), vector)
