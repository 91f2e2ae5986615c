"""Curves and polygons in Gmsh."""

from __future__ import annotations

import gmsh
import numpy as np
import pytest

from fingerslip.mesh.gmsh_session import gmsh_session
from fingerslip.specimens.tactip.meshing.sizes import polygon, smooth_curves


def test_a_polygon_has_its_area():
    with gmsh_session():
        tag = polygon(1e-3 * np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]))
        assert gmsh.model.occ.getMass(2, tag) == pytest.approx(2.0)


def test_a_circle_in_two_pieces_has_its_length():
    angle = np.linspace(0.0, np.pi, 13)
    with gmsh_session():
        made = smooth_curves(1e-3 * np.column_stack([np.cos(angle), np.sin(angle)]), np.array([0, 6, 12]))
        assert len(made.points) == 3
        assert sum(gmsh.model.occ.getMass(1, tag) for tag in made.curves) == pytest.approx(np.pi, rel=1e-3)
