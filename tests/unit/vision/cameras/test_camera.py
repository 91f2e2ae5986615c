"""A camera looks where it is pointed, at its own times, and sees only its own markers inside its image."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.cameras.camera import (
    Camera,
    Pose,
    frame_times,
    interpolate,
    pixels_of,
    pixels_per_metre,
    true_tracks,
)
from fingerslip.vision.cameras.intrinsics import Fisheye, pinhole_for_view
from fingerslip.vision.tracks import make_tracks
from unit.vision.synthetic import moving_tracks

FROM_ABOVE = Pose((0.0, 0.0, 0.1), (0.0, 0.0, 0.0))
LENS = pinhole_for_view(640, 480, 0.064, 0.1)


def test_a_camera_above_sees_x_to_the_right_and_y_up():
    camera = Camera(LENS, FROM_ABOVE)
    np.testing.assert_allclose(camera.pose.rotation @ camera.pose.rotation.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(camera.pose.rotation) == pytest.approx(1.0)
    np.testing.assert_allclose(
        pixels_of(camera, [[1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0]]), [[329.5, 239.5], [319.5, 229.5]]
    )
    np.testing.assert_allclose(pixels_of(camera, [[1e-3, 0.0]]), [[329.5, 239.5]])


def test_a_camera_below_sees_the_mirrored_picture():
    camera = Camera(LENS, Pose((0.0, 0.0, -0.1), (0.0, 0.0, 0.0)))
    np.testing.assert_allclose(pixels_of(camera, [[1e-3, 0.0, 0.0]]), [[309.5, 239.5]])


def test_what_is_outside_the_image_is_not_seen():
    camera = Camera(LENS, FROM_ABOVE)
    points = np.array([[31.9e-3, 0.0, 0.0], [32.1e-3, 0.0, 0.0], [0.0, 24.1e-3, 0.0], [0.0, 0.0, 0.2]])
    assert np.isnan(pixels_of(camera, points)).all(axis=1).tolist() == [False, True, True, True]


def test_scale_is_that_of_the_view():
    camera = Camera(LENS, FROM_ABOVE)
    assert pixels_per_metre(camera, np.array([0.0, 0.0, 0.0])) == pytest.approx(1e4)
    fisheye = Camera(Fisheye(640, 480, 1000.0, 1000.0, 320.0, 240.0), FROM_ABOVE)
    assert pixels_per_metre(fisheye, np.zeros((2, 3))) == pytest.approx([1e4, 1e4])


def test_frames_cover_the_tracks_at_the_rate_of_the_camera():
    tracks = make_tracks(np.zeros((3, 1, 3)), [1.0, 1.4, 2.0], units="m")
    np.testing.assert_allclose(frame_times(Camera(LENS, FROM_ABOVE, frame_rate=10.0), tracks), 1.0 + np.arange(11) / 10)


def test_markers_move_straight_between_known_times():
    position = np.zeros((4, 2, 2))
    position[:, 0, 0] = [0.0, 1.0, 3.0, 4.0]
    position[2, 1] = np.nan
    tracks = make_tracks(position, [0.0, 1.0, 2.0, 3.0], units="m")
    found = interpolate(tracks, np.array([-1.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 9.0]))
    np.testing.assert_allclose(found[:, 0, 0], [0.0, 0.5, 1.0, 2.0, 3.0, 3.5, 4.0, 4.0])
    assert np.isnan(found[:, 1, 0]).tolist() == [False, False, False, True, True, True, False, False]
    still = make_tracks(np.ones((1, 1, 3)), [0.0], units="m")
    np.testing.assert_array_equal(interpolate(still, np.array([0.0, 1.0])), np.ones((2, 1, 3)))


def test_true_tracks_are_the_projection_with_names_and_attributes():
    kinds = ["internal"] * 20 + ["external"] * 5
    tracks = moving_tracks(units="m", dim=3, kind=kinds)
    tracks["position"].values[:, :, :2] -= (320.0, 240.0)
    seen = true_tracks(Camera(LENS, FROM_ABOVE, "internal"), tracks)
    assert seen.sizes == {"time": 5, "marker": 20, "axis": 2}
    np.testing.assert_allclose(
        seen["position"].values[0], pixels_of(Camera(LENS, FROM_ABOVE), tracks["position"].values[0, :20])
    )
    assert np.isnan(seen["position"].values[1]).all(), "a metre away"
    np.testing.assert_array_equal(seen["ring"], tracks["ring"][:20])
    assert seen.attrs["image_width"] == 640
    outside = true_tracks(Camera(LENS, FROM_ABOVE, "external"), tracks)
    assert outside["marker"].values.tolist() == [20, 21, 22, 23, 24]


def test_what_cannot_be_is_refused():
    with pytest.raises(InputError, match=r"exposure: got 0.05 s, needs at most a frame, 0.03333 s"):
        Camera(LENS, FROM_ABOVE, exposure=0.05)
    with pytest.raises(InputError, match="pose: got a camera that looks along"):
        Pose((0.0, 0.1, 0.0), (0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="pose"):
        Pose((0.0, 0.1, 0.0), (0.0, 0.1, 0.0))
    with pytest.raises(InputError, match="is in px, cameras need positions in m"):
        true_tracks(Camera(LENS, FROM_ABOVE), moving_tracks())
    with pytest.raises(InputError, match="has no external marker"):
        true_tracks(Camera(LENS, FROM_ABOVE, "external"), moving_tracks(units="m"))


def test_no_times_give_no_frames():
    empty = make_tracks(np.empty((0, 1, 3)), [], units="m")
    assert true_tracks(Camera(LENS, FROM_ABOVE), empty).sizes["time"] == 0
