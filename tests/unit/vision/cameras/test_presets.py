"""Cameras of a sensor look along its axis, from inside and from below, with x to the right."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.cameras.camera import external_camera, internal_camera, pixels_of
from fingerslip.vision.cameras.intrinsics import Fisheye

POINTS = np.array([[0.0, -5e-3, 0.0], [1e-3, -5e-3, 0.0], [0.0, -5e-3, 1e-3]])


@pytest.mark.parametrize(("make", "down"), [(internal_camera, 10.0), (external_camera, -10.0)])
def test_x_is_to_the_right_in_both(make, down):
    camera = make(50e-3, 64e-3, target=-5e-3)
    np.testing.assert_allclose(
        pixels_of(camera, POINTS), [[319.5, 239.5], [329.5, 239.5], [319.5, 239.5 + down]], atol=1e-9
    )
    assert camera.sees == ("internal" if make is internal_camera else "external")


def test_lens_size_and_times_are_those_asked_for():
    camera = internal_camera(30e-3, 40e-3, size=(1920, 1080), lens="fisheye", frame_rate=60.0, exposure=5e-3)
    assert isinstance(camera.intrinsics, Fisheye)
    assert (camera.intrinsics.width, camera.frame_rate, camera.exposure) == (1920, 60.0, 5e-3)


def test_what_cannot_be_is_refused():
    with pytest.raises(InputError, match="lens: got 'mirror', needs one of pinhole, fisheye"):
        internal_camera(50e-3, 64e-3, lens="mirror")
    with pytest.raises(InputError, match="view_width"):
        external_camera(50e-3, 0.0)
