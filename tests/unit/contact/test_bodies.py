"""The rigid plane: its frame, its distance from points, and where it just touches."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.contact.bodies import Plane
from fingerslip.errors import InputError


def test_the_tangent_of_a_plate_below_points_along_x():
    np.testing.assert_array_equal(Plane().tangent, [1.0, 0.0])
    np.testing.assert_array_equal(Plane(normal=(0.0, -2.0)).tangent, [-1.0, 0.0])


@pytest.mark.parametrize("normal", [(0.0, 0.0), (1.0,), (0.0, 0.0, 0.0, 1.0)])
def test_a_plane_needs_a_direction(normal):
    with pytest.raises(InputError, match=r"normal: got .*, needs two or three components, not all zero"):
        Plane(normal=normal)


def test_gap_is_the_signed_distance_along_the_normal():
    plane = Plane(normal=(3.0, 4.0))
    assert plane.gap(np.array([[3.0, 4.0]]), 2.0)[0] == pytest.approx(3.0)
    assert plane.touching_offset(np.array([[3.0, 4.0], [0.0, 0.0]])) == 0.0


directions = st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0)).filter(lambda n: np.hypot(*n) > 1e-3)


@given(normal=directions, length=st.floats(0.1, 10.0))
def test_the_frame_is_orthonormal_right_handed_and_knows_no_length(normal, length):
    plane = Plane(normal=normal)
    frame = np.array([plane.tangent, plane.unit_normal])
    np.testing.assert_allclose(frame @ frame.T, np.eye(2), atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    longer = Plane(normal=(length * normal[0], length * normal[1]))
    np.testing.assert_allclose(longer.unit_normal, plane.unit_normal, atol=1e-12)


@given(normal=directions, way=st.floats(-2.0, 2.0), aside=st.floats(-2.0, 2.0))
def test_a_point_that_moves_along_the_plane_keeps_its_gap(normal, way, aside):
    plane, point = Plane(normal=normal), np.array([0.3, -0.7])
    moved = point + way * plane.unit_normal + aside * plane.tangent
    before, after = plane.gap(np.array([point, moved]), 0.1)
    assert after - before == pytest.approx(way, abs=1e-12)


@given(normal=directions)
def test_at_the_touching_offset_the_nearest_point_has_no_gap(normal):
    points = np.random.default_rng(0).normal(size=(20, 2))
    plane = Plane(normal=normal)
    gaps = plane.gap(points, plane.touching_offset(points))
    assert gaps.min() == pytest.approx(0.0, abs=1e-12)
    assert (gaps > 1e-9).sum() == 19


def test_a_plane_in_space_has_a_unit_normal():
    np.testing.assert_allclose(Plane(normal=(2.0, 3.0, 6.0)).unit_normal, np.array([2.0, 3.0, 6.0]) / 7.0)
