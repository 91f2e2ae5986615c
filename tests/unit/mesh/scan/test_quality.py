"""Quality of tetrahedra and distance of a mesh from a surface, where both are known."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from fingerslip.mesh.scan.quality import deviation, layer_quality, skin_range
from unit.ellipsoids import ellipsoid


def test_quality_of_a_known_tetrahedron():
    regular = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    (row,) = layer_quality(skfem.MeshTet1(regular.T, np.arange(4)[:, None]))
    assert row.least_radius_ratio == pytest.approx(1.0)
    assert row.volume == pytest.approx(8 / 3)
    assert row.shortest_edge == pytest.approx(np.sqrt(8))
    corner = np.vstack([np.zeros(3), np.eye(3)])
    (row,) = layer_quality(skfem.MeshTet1(corner.T, np.arange(4)[:, None]))
    assert row.mean_radius_ratio == pytest.approx(3 * (3 - np.sqrt(3)) / 6 / (np.sqrt(3) / 2))


def test_deviation_of_a_box_from_a_shifted_sphere():
    sphere = ellipsoid((5e-3, 5e-3, 5e-3), points=400)
    points = np.vstack([sphere.points * 1.1, np.zeros((1, 3))])
    cells = np.column_stack([sphere.triangles, np.full(len(sphere.triangles), 400)])
    ball = skfem.MeshTet1(points.T.copy(), cells.T.copy())
    found = deviation(ball.with_boundaries({"skin": ball.boundary_facets()}), "skin", sphere)
    assert found.mean == pytest.approx(0.5e-3, rel=0.02)
    assert found.largest == pytest.approx(0.5e-3, rel=0.05)


def test_a_mesh_without_an_inside_of_the_skin_has_no_thickness():
    mesh = skfem.MeshTet1()
    assert skin_range(mesh.with_boundaries({"skin": mesh.boundary_facets()}), ellipsoid()) == (0.0, 0.0, 0.0)
