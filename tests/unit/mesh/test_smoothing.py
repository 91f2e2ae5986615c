"""Badly shaped quadrilaterals are repaired; good ones and fixed nodes are left alone."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.mesh.repair import scaled_jacobians, smooth


def patch():
    """Return nodes and cells of three by three unit squares, and which nodes are on the border."""
    x, y = np.meshgrid(np.arange(4.0), np.arange(4.0))
    points = np.column_stack([x.ravel(), y.ravel()])
    cells = np.array([[r * 4 + c, r * 4 + c + 1, r * 4 + c + 5, r * 4 + c + 4] for r in range(3) for c in range(3)])
    return points, cells, (points == 0).any(axis=1) | (points == 3).any(axis=1)


def worst_at_nodes(points, cells):
    worst = np.ones(len(points))
    for cell, value in zip(cells, scaled_jacobians(points, cells), strict=True):
        worst[cell] = np.minimum(worst[cell], value)
    return worst


def test_smoothing_mends_a_bad_patch_and_leaves_the_border():
    points, cells, fixed = patch()
    points[5] = [1.7, 1.6]
    result = smooth(points, cells, fixed)
    assert scaled_jacobians(points, cells).min() < 0.4
    assert scaled_jacobians(result, cells).min() > 0.7
    assert np.array_equal(result[fixed], points[fixed])


@given(moves=st.lists(st.floats(-0.6, 0.6), min_size=8, max_size=8))
def test_smoothing_makes_no_node_worse(moves):
    points, cells, fixed = patch()
    points[~fixed] += np.reshape(moves, (4, 2))
    result = smooth(points, cells, fixed)
    assert np.all(worst_at_nodes(result, cells) >= worst_at_nodes(points, cells) - 1e-15)
    assert np.array_equal(result[fixed], points[fixed])


def test_smoothing_leaves_its_argument_alone():
    points, cells, fixed = patch()
    points[5] = [1.7, 1.6]
    before = points.copy()
    smooth(points, cells, fixed)
    assert np.array_equal(points, before)


@pytest.mark.parametrize(
    ("corners", "expected"),
    [
        ([(0, 0), (3, 0), (3, 1), (0, 1)], 1.0),
        ([(0, 0), (1, 0), (1.5, np.sqrt(3) / 2), (0.5, np.sqrt(3) / 2)], np.sqrt(3) / 2),
        ([(0, 0), (0, 1), (1, 1), (1, 0)], -1.0),
        ([(0, 0), (1, 0), (0.5, 0.5), (0, 1)], 0.0),
        ([(0, 0), (0, 0), (1, 1), (0, 1)], 0.0),
        ([(0, 0), (1, 0), (0.5, np.sqrt(3) / 2)], np.sqrt(3) / 2),
    ],
    ids=["rectangle", "rhombus", "clockwise", "straight corner", "two corners in one", "equilateral triangle"],
)
def test_scaled_jacobian_of_known_cells(corners, expected):
    points = np.array(corners, dtype=float)
    assert scaled_jacobians(points, np.arange(len(points))[None]) == pytest.approx(expected, abs=1e-15)


def test_smoothing_leaves_good_cells_alone():
    mesh = skfem.MeshQuad1().refined(2)
    fixed = np.zeros(mesh.p.shape[1], dtype=bool)
    assert np.array_equal(smooth(mesh.p.T, mesh.t.T, fixed), mesh.p.T)
