"""Short edges go, and everything else stays."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.mesh.fragments import Fragments
from fingerslip.mesh.short_edges import without_short_edges


def test_the_ends_of_a_short_edge_are_one_node():
    points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.001, 1.0]])
    cells = np.array([[0, 1, 2], [0, 2, 4], [0, 4, 3]])
    found = without_short_edges(Fragments(points, cells, np.array([0, 1, 1])), 0.01)
    assert found.region.tolist() == [0, 1]
    assert len(found.points) == 4
    a, b, c = found.points[found.cells].transpose(1, 2, 0)
    area = 0.5 * ((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0])
    assert area.sum() == pytest.approx(1.0, rel=2e-3)


def test_a_mesh_without_short_edges_stays_as_it_is():
    found = Fragments(np.eye(3, 2), np.array([[0, 1, 2]]), np.array([2]))
    same = without_short_edges(found, 0.1)
    assert np.array_equal(same.points, found.points)
    assert np.array_equal(same.cells, found.cells)
