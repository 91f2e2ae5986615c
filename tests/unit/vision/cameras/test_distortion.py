"""Distortion has an inverse up to the radius at which it folds back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.vision.cameras.intrinsics import (
    distort_pinhole,
    fisheye_angles,
    fisheye_distances,
    largest_angle,
    largest_radius,
    undistort_pinhole,
)

POINTS = np.random.default_rng(0).uniform(-0.5, 0.5, (200, 2))


def test_no_coefficients_change_nothing():
    np.testing.assert_array_equal(distort_pinhole(POINTS, ()), POINTS)
    assert largest_radius(()) == largest_angle(()) == np.inf
    np.testing.assert_array_equal(fisheye_distances(POINTS[:, 0], ()), POINTS[:, 0])


@given(st.tuples(st.floats(-0.2, 0.2), st.floats(-0.05, 0.05), st.floats(-0.01, 0.01), st.floats(-0.01, 0.01)))
def test_a_pinhole_is_undone(coefficients):
    back = undistort_pinhole(distort_pinhole(POINTS, coefficients), coefficients)
    np.testing.assert_allclose(back, POINTS, atol=1e-9)


@given(st.tuples(*[st.floats(-0.02, 0.02)] * 4))
def test_a_fisheye_is_undone(coefficients):
    angles = np.linspace(0, min(largest_angle(coefficients), 1.8), 50)
    back = fisheye_angles(fisheye_distances(angles, coefficients), coefficients)
    # The slope vanishes at the largest angle itself.
    np.testing.assert_allclose(back[:-1], angles[:-1], atol=1e-6)


def test_barrel_distortion_folds_back_where_its_slope_vanishes():
    assert largest_radius((-0.3, 0.0, 0.0, 0.0)) == pytest.approx(np.sqrt(1 / 0.9))
    assert largest_angle((-0.1, 0.0, 0.0, 0.0)) == pytest.approx(np.sqrt(1 / 0.3))
    assert largest_radius((0.0, 0.0, 0.0, 0.0, 0.0, -0.25, 0.0, 0.0)) == pytest.approx(2.0), "a pole of the denominator"


def test_what_no_lens_images_has_no_ray():
    furthest = fisheye_distances(np.sqrt(1 / 0.3), (-0.1, 0.0, 0.0, 0.0))
    assert np.isnan(fisheye_angles(np.array([furthest + 1e-3]), (-0.1, 0.0, 0.0, 0.0))).all()
    assert np.isnan(undistort_pinhole(np.array([[5.0, 0.0]]), (-0.3, 0.0, 0.0, 0.0))).all()
