"""Winding numbers: 1 inside, 0 outside, the solid angle of a triangle where it is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.mesh.scan.winding import winding_numbers
from unit.ellipsoids import ellipsoid, together, with_hole

SPHERE = ellipsoid((1.0, 1.0, 1.0))
COORDINATE = st.floats(-2.0, 2.0)


@given(st.tuples(COORDINATE, COORDINATE, COORDINATE))
def test_closed_surface_winds_once_or_not_at_all(point):
    distance = np.linalg.norm(point)
    if abs(distance - 0.995) > 0.02:
        number = winding_numbers(SPHERE.corners, np.array([point]))[0]
        assert number == pytest.approx(1.0 if distance < 1 else 0.0, abs=1e-9)


def test_octant_is_an_eighth():
    corners = np.eye(3)[None]
    assert winding_numbers(corners, np.zeros((1, 3)))[0] == pytest.approx(1 / 8, rel=1e-12)


def test_turned_surface_winds_the_other_way():
    assert winding_numbers(SPHERE.corners[:, ::-1], np.zeros((1, 3)))[0] == pytest.approx(-1.0)


def test_nested_surfaces_add_up():
    both = together(SPHERE, ellipsoid((0.5, 0.5, 0.5)))
    assert winding_numbers(both.corners, np.array([[0.0, 0, 0], [0.8, 0, 0]])) == pytest.approx([2.0, 1.0])


def test_hole_takes_away_its_solid_angle():
    holed = with_hole(SPHERE, (0.0, 0.0, 1.0), 0.4)
    missing = len(SPHERE.triangles) - len(holed.triangles)
    number = winding_numbers(holed.corners, np.zeros((1, 3)))[0]
    assert number == pytest.approx(1 - missing / len(SPHERE.triangles), abs=2e-3)
