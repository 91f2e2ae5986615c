"""Cameras project as OpenCV does, and back; what has no image is NaN."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.cameras.intrinsics import Fisheye, Pinhole, fisheye_for_view, pinhole_for_view
from fingerslip.vision.video import opencv

POINTS = np.random.default_rng(0).uniform((-0.4, -0.3, 0.8), (0.4, 0.3, 1.2), (100, 3))
PINHOLES = [
    (),
    (-0.2, 0.05, 1e-3, -2e-3),
    (-0.2, 0.05, 1e-3, -2e-3, 0.01),
    (0.3, -0.1, 1e-3, -2e-3, 0.02, 0.1, 0.05, 0.01),
    (0.3, -0.1, 1e-3, -2e-3, 0.02, 0.1, 0.05, 0.01, 1e-3, -2e-3, 3e-3, -4e-3),
]


@pytest.mark.parametrize("distortion", PINHOLES, ids=len)
def test_pinhole_projects_as_opencv(distortion):
    camera = Pinhole(640, 480, 500.0, 510.0, 320.0, 240.0, distortion)
    known, _ = opencv().projectPoints(
        POINTS, np.zeros(3), np.zeros(3), camera.camera_matrix, np.array(distortion or (0.0,) * 4)
    )
    np.testing.assert_allclose(camera.project(POINTS), known[:, 0], atol=1e-9)


def test_fisheye_projects_as_opencv():
    camera = Fisheye(640, 480, 300.0, 305.0, 320.0, 240.0, (-0.02, 0.003, -1e-3, 2e-4))
    known, _ = opencv().fisheye.projectPoints(
        POINTS[:, None], np.zeros(3), np.zeros(3), camera.camera_matrix, np.array(camera.distortion)
    )
    np.testing.assert_allclose(camera.project(POINTS), known[:, 0], atol=1e-9)


@pytest.mark.parametrize(
    "camera",
    [
        *[Pinhole(640, 480, 500.0, 510.0, 320.0, 240.0, one) for one in PINHOLES],
        Fisheye(640, 480, 300.0, 305.0, 320.0, 240.0, (-0.02, 0.003, -1e-3, 2e-4)),
        Fisheye(640, 480, 300.0, 305.0, 320.0, 240.0),
    ],
)
def test_rays_lead_back_to_the_points(camera):
    rays = camera.directions(camera.project(POINTS))
    np.testing.assert_allclose(rays, POINTS / np.linalg.norm(POINTS, axis=1)[:, None], atol=1e-8)


def test_the_axis_is_the_principal_point():
    for camera in (Pinhole(640, 480, 500.0, 500.0, 300.0, 200.0), Fisheye(640, 480, 500.0, 500.0, 300.0, 200.0)):
        assert camera.project(np.array([0.0, 0.0, 2.0])).tolist() == [300.0, 200.0]
        assert camera.directions(np.array([300.0, 200.0])).tolist() == [0.0, 0.0, 1.0]


def test_a_fisheye_sees_beside_itself_and_a_pinhole_does_not():
    beside = np.array([1.0, 0.0, 0.0])
    assert Fisheye(640, 480, 100.0, 100.0, 0.0, 0.0).project(beside)[0] == pytest.approx(50 * np.pi)
    assert np.isnan(Pinhole(640, 480, 100.0, 100.0, 0.0, 0.0).project(beside)).all()
    assert np.isnan(Pinhole(640, 480, 100.0, 100.0, 0.0, 0.0).project(-POINTS)).all()


def test_points_beyond_the_fold_of_the_lens_have_no_image():
    camera = Pinhole(640, 480, 500.0, 500.0, 320.0, 240.0, (-0.3, 0.0, 0.0, 0.0))
    assert np.isnan(camera.project(np.array([2.0, 0.0, 1.0]))).all()
    fisheye = Fisheye(640, 480, 500.0, 500.0, 320.0, 240.0, (-0.5, 0.0, 0.0, 0.0))
    assert np.isnan(fisheye.project(np.array([2.0, 0.0, 1.0]))).all()


@pytest.mark.parametrize("make", [pinhole_for_view, fisheye_for_view])
def test_a_lens_for_a_view_sees_it_from_edge_to_edge(make):
    ends = make(640, 480, 0.1, 0.03).project(np.array([[-0.05, 0.0, 0.03], [0.05, 0.0, 0.03]]))
    np.testing.assert_allclose(ends, [[-0.5, 239.5], [639.5, 239.5]], atol=1e-9)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Pinhole(640, 480, 1.0, 1.0, 0.0, 0.0, (0.1, 0.2)), "distortion: got 2 coefficients"),
        (lambda: Fisheye(640, 480, 1.0, 1.0, 0.0, 0.0, (0.1,) * 5), "distortion: got 5 coefficients"),
        (lambda: Pinhole(0, 480, 1.0, 1.0, 0.0, 0.0), "width"),
        (lambda: Pinhole(640, 480, -1.0, 1.0, 0.0, 0.0), "focal_x"),
        (lambda: pinhole_for_view(640, 480, 0.0, 1.0), "view_width"),
        (lambda: fisheye_for_view(640, 480, 0.1, -1.0), "view_width"),
    ],
)
def test_what_cannot_be_is_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()
