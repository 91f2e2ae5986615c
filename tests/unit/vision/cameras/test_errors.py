"""Statistics of errors are those that were put in, and trackers are measured on frames with known truth."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.cameras.looks import DARK_ON_BRIGHT, PixelCamera, SensorNoise
from fingerslip.vision.cameras.point import (
    PositionErrors,
    following,
    measure_errors,
    position_errors,
    window_centroids,
)
from fingerslip.vision.tracks import make_tracks
from unit.vision.cameras.scenes import camera, sliding


def tracks(position) -> object:
    return make_tracks(position, np.arange(len(position)) / 30.0, units="px")


def test_noise_bias_and_losses_are_told_apart():
    random = np.random.default_rng(0)
    truth = random.uniform(0, 100, (500, 80, 2))
    found = truth + 0.03 * random.standard_normal((80, 2)) + 0.01 * random.standard_normal(truth.shape)
    found[random.random((500, 80)) < 0.02] = np.nan
    measured = position_errors(tracks(found), tracks(truth))
    assert measured.noise == pytest.approx(0.01, rel=0.02)
    assert measured.bias == pytest.approx(0.03, rel=0.2)
    assert measured.lost == pytest.approx(0.02, rel=0.1)
    assert abs(measured.correlation) < 0.02
    assert measured.rms == np.hypot(measured.noise, measured.bias)


def test_white_noise_of_few_frames_is_no_bias():
    random = np.random.default_rng(0)
    truth = np.zeros((10, 2000, 2))
    measured = position_errors(tracks(truth + random.standard_normal(truth.shape)), tracks(truth))
    assert measured.noise == pytest.approx(1.0, rel=0.02)
    assert measured.bias < 0.1


def test_no_errors_are_none():
    same = tracks(np.zeros((4, 2, 2)))
    assert position_errors(same, same) == PositionErrors(0.0)


def test_what_is_outside_the_image_does_not_count():
    truth = np.zeros((5, 2, 2))
    truth[:, 1] = np.nan
    assert position_errors(tracks(truth), tracks(truth)).lost == 0.0


def test_what_cannot_be_compared_is_refused():
    with pytest.raises(InputError, match="needs the same times and markers in both"):
        position_errors(tracks(np.zeros((5, 2, 2))), tracks(np.zeros((5, 3, 2))))
    with pytest.raises(InputError, match="has no marker in three frames"):
        position_errors(tracks(np.full((5, 2, 2), np.nan)), tracks(np.zeros((5, 2, 2))))


@pytest.mark.parametrize("look", [PixelCamera(camera()).look, DARK_ON_BRIGHT])
def test_centroids_of_frames_are_found_to_a_hundredth_of_a_pixel(look):
    found = measure_errors(PixelCamera(camera(), look=look), sliding(1.0, 3e-4), following(window_centroids))
    assert found.rms < 0.01
    assert found.lost == 0.0


def test_twice_the_noise_of_the_sensor_is_twice_the_error():
    measured = [
        measure_errors(PixelCamera(camera(), noise=SensorNoise(read)), sliding(2.0, 3e-4), following(window_centroids))
        for read in (3.0, 6.0)
    ]
    assert measured[1].noise / measured[0].noise == pytest.approx(2.0, rel=0.1)


def test_a_marker_that_vanishes_is_lost_and_found_again():
    moving = sliding(1.0, 3e-4)
    moving["position"].values[5:10, 3] = np.nan
    moving["quality"].values[5:10, 3] = 0.0
    whole, broken = (
        measure_errors(PixelCamera(camera()), one, following(window_centroids)) for one in (sliding(1.0, 3e-4), moving)
    )
    assert broken.noise == pytest.approx(whole.noise, rel=0.05), "what is not drawn has no truth to be missed"


def test_windows_at_the_edge_and_without_a_marker_give_nothing():
    frame = np.full((60, 60), 40, dtype=np.uint8)
    assert np.isnan(window_centroids(frame, np.array([[30.0, 30.0], [3.0, 30.0], [np.nan, 30.0]]))).all()


def test_a_tracker_must_return_a_place_for_each_marker_in_each_frame():
    with pytest.raises(InputError, match=r"locate: returned shape \(0,\), needs \(7, 9, 2\)"):
        measure_errors(PixelCamera(camera()), sliding(), lambda *_: np.empty(0))
