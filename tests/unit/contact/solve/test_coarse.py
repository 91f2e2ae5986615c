"""Coarse spaces: groups of coupled nodes, and the inverse of the Newton matrix on forces that these bear as one."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.contact.solve.coarse import coarse_inverse, group_columns, groups, images_of, unit_forces

DIM = 3


def line(count):
    """Return a compliance that falls with the distance along a line."""
    distance = np.abs(np.arange(count)[:, None] - np.arange(count))
    return np.kron(1.0 / (1.0 + distance), np.eye(DIM) + 0.1)


def test_groups_are_neighbours_and_all_nodes_are_in_one():
    nodes = np.arange(5, 65)
    group = groups(line(70), nodes, DIM)
    assert set(group) == set(range(6))
    assert np.count_nonzero(np.diff(group)) == 5
    assert np.bincount(group).min() >= 4


@pytest.mark.parametrize(("count", "expected"), [(0, 0), (1, 1), (19, 1), (20, 2), (500, 12), (1000, 20)])
def test_few_nodes_make_few_groups(count, expected):
    found = groups(np.eye(count * DIM) + 0.1, np.arange(count), DIM)
    assert found.size == count
    assert len(set(found)) <= expected
    assert unit_forces(group_columns(found, DIM)).shape == (count * DIM, DIM * (max(found, default=-1) + 1))


def test_what_the_space_can_solve_is_solved_and_nothing_of_it_is_left():
    rng = np.random.default_rng(0)
    columns = group_columns(np.repeat(np.arange(3), 4), DIM)
    forces = unit_forces(columns)
    scaled = (line(12) + 0.5 * np.eye(36)).astype(np.float32)
    slopes = np.tile(np.eye(DIM, dtype=np.float32), (12, 1, 1))
    slopes[::3] = [[1.0, 0.0, 0.0], [0.5, 0.3, 0.1], [0.2, 0.1, 0.4]]
    slopes[5] = 0.0
    gradient = np.zeros((36, 36))
    for node in range(12):
        gradient[3 * node : 3 * node + 3, 3 * node : 3 * node + 3] = slopes[node]
    matrix = np.eye(36) - gradient @ (np.eye(36) - scaled)
    images = images_of(slopes, columns, scaled @ forces)
    np.testing.assert_allclose(images, matrix @ forces, atol=1e-5)
    inverse = coarse_inverse(columns, images)
    np.testing.assert_allclose(inverse @ (forces.T @ images), np.eye(9), atol=1e-4)
    inside = forces @ rng.normal(size=9).astype(np.float32)
    shares = inverse @ (forces.T @ matrix @ inside)
    np.testing.assert_allclose(forces @ shares, inside, atol=1e-4)


def test_the_space_of_the_first_nodes_alone():
    columns = group_columns(np.repeat(np.arange(3), 4), DIM)
    scaled = (line(12) + 0.5 * np.eye(36)).astype(np.float32) @ unit_forces(columns)
    slopes = np.tile(np.eye(DIM, dtype=np.float32), (12, 1, 1))
    whole, part = (images_of(slopes[:count], columns, scaled) for count in (12, 5))
    np.testing.assert_array_equal(part, whole[:15])


def test_forces_that_act_on_nothing_are_left_out():
    """The last group has no nodes among the first: its rows and columns are zero, and the others are inverted."""
    columns = group_columns(np.repeat(np.arange(3), 4), DIM)
    scaled = (line(12) + 0.5 * np.eye(36)).astype(np.float32) @ unit_forces(columns)
    slopes = np.tile(np.eye(DIM, dtype=np.float32), (8, 1, 1))
    images = images_of(slopes, columns, scaled)
    images[:, 6:] = 0.0
    inverse = coarse_inverse(columns, images)
    assert not inverse[6:].any()
    matrix = unit_forces(columns)[:24, :6].T @ images[:, :6]
    np.testing.assert_allclose(inverse[:6, :6] @ matrix, np.eye(6), atol=1e-4)


@pytest.mark.parametrize("size", [1, 5, 40])
def test_rows_are_swapped_where_they_have_to_be(size):
    matrix = np.random.default_rng(size).normal(size=(size, size))
    matrix[0, 0] = 0.0 if size > 1 else 2.0
    inverse = coarse_inverse(np.arange(size), matrix)
    np.testing.assert_allclose(inverse @ matrix, np.eye(size), atol=1e-9)
