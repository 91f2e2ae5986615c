"""Statistics of errors are those that were put in, trackers are measured, and the point camera errs as frames do."""

import numpy as np
import pytest
import xarray as xr

from fingerslip.errors import InputError
from fingerslip.vision.cameras.camera import external_camera, internal_camera, true_tracks
from fingerslip.vision.cameras.pixel import DARK_ON_BRIGHT, PixelCamera, SensorNoise, frames_of
from fingerslip.vision.cameras.point import (
    MEASURED_ERRORS,
    CameraPair,
    PointCamera,
    following,
    measure_errors,
    pair_tracks,
    point_tracks,
    window_centroids,
)
from fingerslip.vision.comparison import PositionErrors, position_errors
from fingerslip.vision.tracks import make_tracks
from unit.vision.scenes import camera, hide, sliding

SLIDE = sliding(6.0, 3e-4)
SECOND = sliding(1.0, 3e-4)
LOCATE = following(window_centroids)


def test_errors_of_dark_and_of_default_markers_are_measured():
    found = measure_errors(PixelCamera(camera(), look=DARK_ON_BRIGHT), SECOND, LOCATE)
    assert found.rms < 0.01
    assert found.lost == 0.0
    measured = measure_errors(PixelCamera(camera()), SLIDE, LOCATE)
    assert measured.noise == pytest.approx(MEASURED_ERRORS.noise, rel=0.05)
    assert measured.bias == pytest.approx(MEASURED_ERRORS.bias, abs=5e-4)
    assert measured.correlation == pytest.approx(MEASURED_ERRORS.correlation, abs=0.05)


def test_a_marker_that_vanishes_is_found_again_and_windows_at_the_edge_or_without_a_marker_give_nothing():
    moving = hide(SECOND, slice(5, 10), 3)
    whole, broken = (measure_errors(PixelCamera(camera()), one, LOCATE) for one in (SECOND, moving))
    assert broken.noise == pytest.approx(whole.noise, rel=0.05), "what is not drawn has no truth to be missed"
    frame = np.full((60, 60), 40, dtype=np.uint8)
    assert np.isnan(window_centroids(frame, np.array([[30.0, 30.0], [3.0, 30.0], [np.nan, 30.0]]))).all()


def correlations(found, truth, lags):
    errors = found["position"].values - truth["position"].values
    errors -= errors.mean(axis=0)
    return [float((errors[lag:] * errors[:-lag]).mean() / (errors**2).mean()) for lag in lags]


@pytest.mark.parametrize(
    "changes", [{}, {"noise": SensorNoise(5.0)}, {"jpeg_quality": 60}], ids=["default", "noisy", "compressed"]
)
def test_both_cameras_have_the_same_statistics(changes):
    """Calibrated on one seed and compared on another: size and whiteness in time, of positions and of speeds."""
    errors = measure_errors(PixelCamera(camera(), seed=1, **changes), SLIDE, LOCATE)
    point = point_tracks(PointCamera(camera(), errors, seed=2), SLIDE)
    truth = true_tracks(camera(), SLIDE)
    frames = frames_of(PixelCamera(camera(), seed=2, **changes), SLIDE)
    pixel = make_tracks(LOCATE(frames, truth["position"].values[0]), truth["time"].values, units="px")
    by_point, by_pixel = position_errors(point, truth), position_errors(pixel, truth)
    assert by_point.noise == pytest.approx(by_pixel.noise, rel=0.1)
    assert by_point.rms == pytest.approx(by_pixel.rms, rel=0.15)
    lags = (1, 2, 3)
    np.testing.assert_allclose(correlations(point, truth, lags), correlations(pixel, truth, lags), atol=0.1)
    speeds = [float(np.diff(one["position"].values - truth["position"].values, axis=0).std()) for one in (point, pixel)]
    assert speeds[0] == pytest.approx(speeds[1], rel=0.1)


def test_tracks_have_the_errors_that_were_asked_for():
    asked, still = PositionErrors(noise=0.05, bias=0.2, correlation=0.6, lost=0.1), sliding(60.0, 0.0)
    found = point_tracks(PointCamera(camera(), asked), still)
    measured = position_errors(found, true_tracks(camera(), still))
    assert measured.noise == pytest.approx(0.05, rel=0.05)
    assert measured.bias == pytest.approx(0.2, rel=0.5), "nine markers"
    assert measured.correlation == pytest.approx(0.6, abs=0.03)
    assert measured.lost == pytest.approx(0.1, rel=0.1)
    np.testing.assert_array_equal(found["ring"], still["ring"])
    first, again, other = (point_tracks(PointCamera(camera(), seed=seed), SLIDE) for seed in (4, 4, 5))
    xr.testing.assert_identical(first, again)
    assert not np.allclose(first["position"], other["position"], atol=1e-3)
    exact = point_tracks(PointCamera(camera(), PositionErrors(0.0)), SLIDE)
    np.testing.assert_array_equal(exact["position"], true_tracks(camera(), SLIDE)["position"])


INSIDE = internal_camera(50e-3, 45e-3, target=5e-3, frame_rate=20.0)
OUTSIDE = external_camera(60e-3, 60e-3, frame_rate=20.0)


def test_each_camera_of_a_pair_has_pixels_and_errors_of_its_own_and_internal_markers_come_first():
    position = np.zeros((2, 3, 3))
    position[:, 1:, 1], position[1, :, 0] = 5e-3, 1e-3
    position[:, 2] = np.nan
    labels = {"kind": ["external", "internal", "internal"], "ring": [0, 0, 1], "angle": [0.0] * 3}
    markers = make_tracks(position, [0.0, 1.0], units="m", **labels)
    found = pair_tracks(CameraPair(INSIDE, OUTSIDE, PositionErrors(0.0)), markers)
    assert found["kind"].values.tolist() == ["internal", "internal", "external"]
    assert found["marker"].values.tolist() == [1, 2, 0]
    assert found["ring"].values.tolist() == [0, 1, 0]
    moved = found["position"].values[-1, :, 0] - found["position"].values[0, :, 0]
    assert moved[[0, 2]] == pytest.approx([640 / 45, 640 / 60], abs=2e-3)
    assert np.isnan(moved[1])
    assert found.attrs["metres_per_pixel_x"] == pytest.approx(60e-3 / 640)
    assert found.attrs["frame_rate"] == 20.0
    both = make_tracks(np.zeros((400, 2, 3)), np.arange(400) / 20.0, units="m", kind=["internal", "external"])
    first, again, other = (
        pair_tracks(CameraPair(INSIDE, OUTSIDE, PositionErrors(0.05), seed), both)["position"].values
        for seed in (1, 1, 2)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert abs(np.corrcoef(first[:, 0, 0], first[:, 1, 0])[0, 1]) < 0.2


FAST = external_camera(60e-3, 60e-3, frame_rate=60.0)


def lost(*_):
    return np.empty(0)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: measure_errors(PixelCamera(camera()), sliding(), lost), r"returned shape \(0,\), needs \(7, 9, 2\)"),
        (lambda: CameraPair(INSIDE, FAST), "cameras: frame_rate: got 20 and 60 frames a second, needs one rate"),
        (lambda: CameraPair(INSIDE, INSIDE), "cameras: external: sees internal markers"),
    ],
)
def test_what_cannot_be_compared_or_paired_is_refused(call, said):
    with pytest.raises(InputError, match=said):
        call()
