"""The point camera's tracks have the statistics of tracks from frames, and are the same for the same seed."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fingerslip.vision.cameras.camera import true_tracks
from fingerslip.vision.cameras.looks import PixelCamera, SensorNoise
from fingerslip.vision.cameras.pixel import frames_of
from fingerslip.vision.cameras.point import (
    MEASURED_ERRORS,
    PointCamera,
    PositionErrors,
    following,
    measure_errors,
    point_tracks,
    position_errors,
    window_centroids,
)
from fingerslip.vision.tracks import make_tracks, seen
from unit.vision.cameras.scenes import camera, sliding

SLIDE = sliding(6.0, 3e-4)
LOCATE = following(window_centroids)


def found_in_frames(pixel_camera: PixelCamera) -> xr.Dataset:
    truth = true_tracks(pixel_camera.camera, SLIDE)
    found = LOCATE(frames_of(pixel_camera, SLIDE), truth["position"].values[0])
    return make_tracks(found, truth["time"].values, units="px")


def correlations(found: xr.Dataset, truth: xr.Dataset, lags: tuple[int, ...]) -> list[float]:
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
    pixel = found_in_frames(PixelCamera(camera(), seed=2, **changes))
    truth = true_tracks(camera(), SLIDE)
    by_point, by_pixel = position_errors(point, truth), position_errors(pixel, truth)
    assert by_point.noise == pytest.approx(by_pixel.noise, rel=0.1)
    assert by_point.rms == pytest.approx(by_pixel.rms, rel=0.15)
    lags = (1, 2, 3)
    np.testing.assert_allclose(correlations(point, truth, lags), correlations(pixel, truth, lags), atol=0.1)
    speeds = [float(np.diff(one["position"].values - truth["position"].values, axis=0).std()) for one in (point, pixel)]
    assert speeds[0] == pytest.approx(speeds[1], rel=0.1)


def test_the_default_errors_are_those_of_the_default_pixel_camera():
    measured = measure_errors(PixelCamera(camera()), SLIDE, LOCATE)
    assert measured.noise == pytest.approx(MEASURED_ERRORS.noise, rel=0.05)
    assert measured.bias == pytest.approx(MEASURED_ERRORS.bias, abs=5e-4)
    assert measured.correlation == pytest.approx(MEASURED_ERRORS.correlation, abs=0.05)


def test_tracks_have_the_errors_that_were_asked_for():
    asked = PositionErrors(noise=0.05, bias=0.2, correlation=0.6, lost=0.1)
    tracks = point_tracks(PointCamera(camera(), asked), sliding(60.0, 0.0))
    measured = position_errors(tracks, true_tracks(camera(), sliding(60.0, 0.0)))
    assert measured.noise == pytest.approx(0.05, rel=0.05)
    assert measured.bias == pytest.approx(0.2, rel=0.5), "nine markers"
    assert measured.correlation == pytest.approx(0.6, abs=0.03)
    assert measured.lost == pytest.approx(0.1, rel=0.1)
    assert seen(tracks).mean() == pytest.approx(0.9, abs=0.01)
    np.testing.assert_array_equal(tracks["ring"], sliding()["ring"])


def test_the_same_seed_gives_the_same_tracks():
    tracks = [point_tracks(PointCamera(camera(), seed=seed), SLIDE) for seed in (4, 4, 5)]
    xr.testing.assert_identical(tracks[0], tracks[1])
    assert not np.allclose(tracks[0]["position"], tracks[2]["position"], atol=1e-3)


def test_no_errors_give_the_truth():
    tracks = point_tracks(PointCamera(camera(), PositionErrors(0.0)), SLIDE)
    np.testing.assert_array_equal(tracks["position"], true_tracks(camera(), SLIDE)["position"])
