"""Cameras project as OpenCV does, and back; what has no image, or lies beyond the fold of the lens, is NaN."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.errors import InputError
from fingerslip.vision.cameras.intrinsics import Fisheye, Pinhole, lens_for_view, pinhole_for_view
from fingerslip.vision.video import opencv

POINTS = np.random.default_rng(0).uniform((-0.4, -0.3, 0.8), (0.4, 0.3, 1.2), (100, 3))
RAYS = POINTS / np.linalg.norm(POINTS, axis=1)[:, None]
PINHOLES = [
    (),
    (-0.2, 0.05, 1e-3, -2e-3),
    (-0.2, 0.05, 1e-3, -2e-3, 0.01),
    (0.3, -0.1, 1e-3, -2e-3, 0.02, 0.1, 0.05, 0.01),
    (0.3, -0.1, 1e-3, -2e-3, 0.02, 0.1, 0.05, 0.01, 1e-3, -2e-3, 3e-3, -4e-3),
]


def pinhole(*distortion: float) -> Pinhole:
    return Pinhole(640, 480, 500.0, 510.0, 320.0, 240.0, distortion)


def fisheye(*distortion: float) -> Fisheye:
    return Fisheye(640, 480, 300.0, 305.0, 320.0, 240.0, distortion)


@pytest.mark.parametrize("camera", [*[pinhole(*one) for one in PINHOLES], fisheye(-0.02, 0.003, -1e-3, 2e-4)])
def test_points_have_the_pixels_of_opencv_and_pixels_the_rays_of_points(camera):
    cv2 = opencv()
    project = cv2.projectPoints if isinstance(camera, Pinhole) else cv2.fisheye.projectPoints
    distortion = np.array(camera.distortion or (0.0,) * 4)
    known, _ = project(POINTS[:, None], np.zeros(3), np.zeros(3), camera.camera_matrix, distortion)
    np.testing.assert_allclose(camera.project(POINTS), known[:, 0], atol=1e-9)
    np.testing.assert_allclose(camera.directions(known[:, 0]), RAYS, atol=1e-8)


@given(st.tuples(st.floats(-0.2, 0.2), st.floats(-0.05, 0.05), st.floats(-0.01, 0.01), st.floats(-0.01, 0.01)))
def test_a_pinhole_is_undone(coefficients):
    camera = pinhole(*coefficients)
    np.testing.assert_allclose(camera.directions(camera.project(POINTS)), RAYS, atol=1e-9)


@given(st.tuples(*[st.floats(-0.02, 0.02)] * 4))
def test_a_fisheye_is_undone_also_beside_and_behind_the_camera(coefficients):
    camera = fisheye(*coefficients)
    angles = np.linspace(0, 1.8, 50)
    rays = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=1)
    pixels = camera.project(rays)
    # The slope vanishes at the largest angle itself.
    inside = np.isfinite(pixels[:, 0]) & np.isfinite(camera.project(np.roll(rays, -1, axis=0))[:, 0])
    np.testing.assert_allclose(camera.directions(pixels[inside]), rays[inside], atol=1e-6)


def test_the_axis_is_the_principal_point():
    for camera in (pinhole(), fisheye()):
        assert camera.project(np.array([0.0, 0.0, 2.0])).tolist() == [320.0, 240.0]
        assert camera.directions(np.array([320.0, 240.0])).tolist() == [0.0, 0.0, 1.0]


def test_a_fisheye_sees_beside_itself_and_a_pinhole_does_not():
    beside = np.array([1.0, 0.0, 0.0])
    assert Fisheye(640, 480, 100.0, 100.0, 0.0, 0.0).project(beside)[0] == pytest.approx(50 * np.pi)
    assert np.isnan(pinhole().project(beside)).all()
    assert np.isnan(pinhole().project(-POINTS)).all()


@pytest.mark.parametrize(
    ("camera", "largest"),
    [
        (pinhole(-0.3, 0.0, 0.0, 0.0), np.sqrt(1 / 0.9)),
        (pinhole(0.0, 0.0, 0.0, 0.0, 0.0, -0.25, 0.0, 0.0), 2.0),  # a pole of the denominator
        (fisheye(-0.5, 0.0, 0.0, 0.0), np.tan(np.sqrt(1 / 1.5))),
    ],
)
def test_points_beyond_the_fold_of_the_lens_have_no_image(camera, largest):
    seen = camera.project(np.array([[0.99 * largest, 0.0, 1.0], [1.01 * largest, 0.0, 1.0]]))
    assert np.isnan(seen[:, 0]).tolist() == [False, True]


def test_pixels_beyond_the_fold_of_the_lens_and_unknown_ones_have_no_ray():
    # Barrel distortion images at most 2/3 of the radius at which its slope vanishes.
    far = np.array([[320.0 + 500.0 * 0.71, 240.0], [2820.0, 240.0], [np.nan, 240.0]])
    assert np.isnan(pinhole(-0.3, 0.0, 0.0, 0.0).directions(far)).all()
    assert np.isnan(fisheye(-0.5, 0.0, 0.0, 0.0).directions(far)).all()
    assert pinhole(-0.3, 0.0, 0.0, 0.0).directions(np.empty((0, 2))).shape == (0, 3)


@pytest.mark.parametrize("make", [pinhole_for_view, functools.partial(lens_for_view, "fisheye")])
def test_a_lens_for_a_view_sees_it_from_edge_to_edge(make):
    ends = make(640, 480, 0.1, 0.03).project(np.array([[-0.05, 0.0, 0.03], [0.05, 0.0, 0.03]]))
    np.testing.assert_allclose(ends, [[-0.5, 239.5], [639.5, 239.5]], atol=1e-9)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: pinhole(0.1, 0.2), "distortion: got 2 coefficients, needs one of 0, 4, 5, 8, 12; leave zeros"),
        (lambda: fisheye(*[0.1] * 5), "distortion: got 5 coefficients, needs one of 0, 4;"),
        (lambda: Pinhole(0, 480, 1.0, 1.0, 0.0, 0.0), "Pinhole.width"),
        (lambda: Pinhole(640, 480, -1.0, 1.0, 0.0, 0.0), "Pinhole.focal_x"),
        (lambda: pinhole_for_view(640, 480, 0.0, 1.0), "view_width"),
        (lambda: lens_for_view("fisheye", 640, 480, 0.1, -1.0), "view_width"),
    ],
)
def test_what_cannot_be_is_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()
