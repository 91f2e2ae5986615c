"""Refused tetrahedra are repaired, and regions and outside stay where they are."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import Delaunay

from fingerslip.mesh.gmsh_session import Fragments
from fingerslip.mesh.quality import tetrahedron_margins
from fingerslip.mesh.repair import repair_tetrahedra

NONE = np.empty((0, 3))


def cube(*more):
    """Return a cube of 1 mm, whose halves below and above z = 0.5 mm are two regions, with a few more nodes."""
    grid = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 3)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    points = np.vstack([grid, *more])
    # Delaunay's tetrahedra of a grid are not unique: a little noise chooses, and flat ones at the faces go.
    chosen = points + np.random.default_rng(0).normal(0.0, 1e-6, points.shape)
    cells = Delaunay(chosen).simplices.astype(np.int64)
    cells = cells[np.abs(np.linalg.det(points[cells][:, 1:] - points[cells][:, :1])) > 1e-4]
    region = (points[cells][..., 2].mean(axis=1) > 0.5).astype(np.int64)
    return Fragments(1e-3 * points, cells, region)


def volumes(found):
    corners = found.points[found.cells]
    return np.bincount(found.region, np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0)


def margins(found):
    return tetrahedron_margins(found.points[found.cells])


# Beside a node of the grid, in the upper half: edges fifty times shorter than the others.
NEAR = np.array([[0.5, 0.5, 0.51]])


def test_a_short_edge_becomes_a_node_and_no_region_loses_volume():
    found = cube(NEAR)
    assert margins(found).min() <= 1.0
    mended = repair_tetrahedra(found, NONE)
    assert margins(mended).min() > 1.0
    assert len(mended.points) == len(found.points) - 1
    assert volumes(mended) == pytest.approx(volumes(found), rel=1e-9)


def test_nodes_that_are_to_stay_do():
    found = cube(NEAR)
    mended = repair_tetrahedra(found, 1e-3 * NEAR)
    assert np.linalg.norm(mended.points - 1e-3 * NEAR, axis=1).min() == 0.0


def test_good_cells_stay_as_they_are():
    found = cube()
    same = repair_tetrahedra(found, NONE)
    assert np.array_equal(same.points, found.points)
    assert np.array_equal(same.cells, found.cells)


def test_margins_of_a_regular_and_a_flat_tetrahedron():
    regular = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
    flat = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    found = tetrahedron_margins(np.stack([regular, flat]))
    assert found[0] > 5.0
    assert found[1] == 0.0
