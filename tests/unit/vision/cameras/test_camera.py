"""A camera looks where it is pointed, at its own times, and sees only its own markers inside its image."""

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.cameras.camera import (
    Camera,
    Pose,
    aimed_camera,
    external_camera,
    frame_times,
    internal_camera,
    interpolate,
    pixels_of,
    pixels_per_metre,
    true_tracks,
)
from fingerslip.vision.cameras.intrinsics import Fisheye, pinhole_for_view
from fingerslip.vision.tracks import make_tracks
from unit.vision.scenes import moving_tracks

FROM_ABOVE = Pose((0.0, 0.0, 0.1), (0.0, 0.0, 0.0))
LENS = pinhole_for_view(640, 480, 0.064, 0.1)
ABOVE = Camera(LENS, FROM_ABOVE)


def test_cameras_above_and_below_see_the_picture_and_its_mirror_at_the_scale_of_the_view():
    np.testing.assert_allclose(ABOVE.pose.rotation @ ABOVE.pose.rotation.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(ABOVE.pose.rotation) == pytest.approx(1.0)
    pixels = pixels_of(ABOVE, [[1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0]])
    np.testing.assert_allclose(pixels, [[329.5, 239.5], [319.5, 229.5]])
    np.testing.assert_allclose(pixels_of(ABOVE, [[1e-3, 0.0]]), [[329.5, 239.5]])
    below = Camera(LENS, Pose((0.0, 0.0, -0.1), (0.0, 0.0, 0.0)))
    np.testing.assert_allclose(pixels_of(below, [[1e-3, 0.0, 0.0]]), [[309.5, 239.5]])
    points = np.array([[31.9e-3, 0.0, 0.0], [32.1e-3, 0.0, 0.0], [0.0, 24.1e-3, 0.0], [0.0, 0.0, 0.2]])
    assert np.isnan(pixels_of(ABOVE, points)).all(axis=1).tolist() == [False, True, True, True]
    assert pixels_per_metre(ABOVE, np.array([0.0, 0.0, 0.0])) == pytest.approx(1e4)
    fisheye = Camera(Fisheye(640, 480, 1000.0, 1000.0, 320.0, 240.0), FROM_ABOVE)
    assert pixels_per_metre(fisheye, np.zeros((2, 3))) == pytest.approx([1e4, 1e4])


def test_frames_cover_the_tracks_and_markers_move_straight_between_known_times():
    tracks = make_tracks(np.zeros((3, 1, 3)), [1.0, 1.4, 2.0], units="m")
    np.testing.assert_allclose(frame_times(Camera(LENS, FROM_ABOVE, frame_rate=10.0), tracks), 1.0 + np.arange(11) / 10)
    assert true_tracks(ABOVE, make_tracks(np.empty((0, 1, 3)), [], units="m")).sizes["time"] == 0
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
    tracks = moving_tracks(units="m", dim=3, kind=["internal"] * 20 + ["external"] * 5)
    tracks["position"].values[:, :, :2] -= (320.0, 240.0)
    seen = true_tracks(ABOVE, tracks)
    assert seen.sizes == {"time": 5, "marker": 20, "axis": 2}
    np.testing.assert_allclose(seen["position"].values[0], pixels_of(ABOVE, tracks["position"].values[0, :20]))
    assert np.isnan(seen["position"].values[1]).all(), "a metre away"
    np.testing.assert_array_equal(seen["ring"], tracks["ring"][:20])
    assert seen.attrs["image_width"] == 640
    outside = true_tracks(Camera(LENS, FROM_ABOVE, "external"), tracks)
    assert outside["marker"].values.tolist() == [20, 21, 22, 23, 24]


@pytest.mark.parametrize(("make", "down"), [(internal_camera, 10.0), (external_camera, -10.0)])
def test_cameras_of_a_sensor_look_along_its_axis_with_x_to_the_right(make, down):
    camera = make(50e-3, 64e-3, target=-5e-3)
    points = np.array([[0.0, -5e-3, 0.0], [1e-3, -5e-3, 0.0], [0.0, -5e-3, 1e-3]])
    expected = [[319.5, 239.5], [329.5, 239.5], [319.5, 239.5 + down]]
    np.testing.assert_allclose(pixels_of(camera, points), expected, atol=1e-9)
    assert camera.sees == ("internal" if make is internal_camera else "external")


def test_lens_size_times_and_aim_are_those_asked_for():
    camera = internal_camera(30e-3, 40e-3, size=(1920, 1080), lens="fisheye", frame_rate=60.0, exposure=5e-3)
    assert isinstance(camera.intrinsics, Fisheye)
    assert (camera.intrinsics.width, camera.frame_rate, camera.exposure) == (1920, 60.0, 5e-3)
    heights = [1e-3, 3e-3, np.nan]
    inside, outside = (aimed_camera(kind, heights, 50e-3, 45e-3) for kind in ("internal", "external"))
    assert (inside.pose.target[1], outside.pose.target[1]) == pytest.approx((2e-3, 1e-3))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Camera(LENS, FROM_ABOVE, exposure=0.05), "exposure: got 0.05 s, needs at most a frame, 0.03333 s"),
        (lambda: Pose((0.0, 0.1, 0.0), (0.0, 0.0, 0.0)), "pose: got a camera that looks along"),
        (lambda: Pose((0.0, 0.1, 0.0), (0.0, 0.1, 0.0)), "pose"),
        (lambda: true_tracks(ABOVE, moving_tracks()), "is in px, cameras need positions in m"),
        (lambda: true_tracks(Camera(LENS, FROM_ABOVE, "external"), moving_tracks(units="m")), "has no external marker"),
        (lambda: internal_camera(50e-3, 64e-3, lens="mirror"), "lens: got 'mirror', needs one of pinhole, fisheye"),
        (lambda: external_camera(50e-3, 0.0), "view_width"),
    ],
)
def test_what_cannot_be_is_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()
