"""Frames show markers where they truly are, and are the same for the same seed."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.cameras.camera import true_tracks
from fingerslip.vision.cameras.looks import DARK_ON_BRIGHT, Lighting, MarkerLook, PixelCamera, SensorNoise
from fingerslip.vision.cameras.pixel import film, frames_of
from fingerslip.vision.tracks import make_tracks
from fingerslip.vision.video import read_frames, video_info
from unit.vision.cameras.scenes import camera, middle, sliding, taken


@pytest.mark.parametrize("look", [MarkerLook(), DARK_ON_BRIGHT])
@pytest.mark.parametrize("exposure", [0.0, 0.02])
def test_markers_are_where_they_truly_are(look, exposure):
    """Within what 8 bits hold: 0.03 px for a marker that is smeared over 2 px in an exposure."""
    pixel_camera = taken(camera=camera(exposure=exposure), look=look)
    tracks = sliding(speed=10e-3)
    truth = true_tracks(pixel_camera.camera, tracks)["position"].values
    for frame, places in zip(frames_of(pixel_camera, tracks), truth, strict=True):
        assert frame.dtype == np.uint8
        for place in places:
            np.testing.assert_allclose(middle(frame, place), place, atol=0.03)


def test_a_longer_exposure_smears_a_moving_marker_along_its_way():
    tracks = sliding(speed=100e-3, seconds=0.03)

    def variance(exposure: float, axis: int) -> float:
        frame = next(frames_of(taken(camera=camera(exposure=exposure)), tracks))
        weights = frame[45:75, 65:95].astype(float).sum(axis=1 - axis) - 30 * 40
        places = np.arange(30)
        middle = (weights * places).sum() / weights.sum()
        return float((weights * (places - middle) ** 2).sum() / weights.sum())

    # 100 mm/s at 10 px/mm in 10 ms are 10 px: an even spread over a length L adds the variance L²/12.
    assert variance(10e-3, 1) - variance(0.0, 1) == pytest.approx(100 / 12, rel=0.03)
    assert variance(10e-3, 0) == pytest.approx(variance(0.0, 0), rel=0.03)


def test_a_part_of_the_frames_is_as_in_the_whole():
    pixel_camera = PixelCamera(camera(), lighting=Lighting(drift=0.1, texture=3.0), seed=7)
    tracks = sliding(seconds=3.0)
    whole = list(frames_of(pixel_camera, tracks))
    assert len(whole) == 91
    np.testing.assert_array_equal(list(frames_of(pixel_camera, tracks, start=60, stop=70)), whole[60:70])
    other = next(frames_of(PixelCamera(camera(), seed=8), tracks))
    assert (other != whole[0]).mean() > 0.5


def test_a_marker_that_is_not_known_is_not_drawn():
    tracks = sliding()
    tracks["position"].values[:, 0] = np.nan
    tracks["quality"].values[:, 0] = 0.0
    frame = next(frames_of(taken(), tracks))
    assert frame[60, 80] == 40
    assert frame.max() == 200


def test_a_marker_outside_reaches_into_the_image():
    tracks = make_tracks([[[8.2e-3, 0.0, 0.0]]], [0.0], units="m")
    frame = next(frames_of(taken(), tracks))
    assert frame[:, -1].max() > 100
    assert np.isnan(true_tracks(taken().camera, tracks)["position"].values).all()


def test_markers_of_the_section_lie_in_its_plane():
    tracks = make_tracks([[[0.0, 0.0]]], [0.0], units="m")
    assert next(frames_of(taken(), tracks))[60, 80] == 200


def test_closer_markers_are_larger():
    areas = []
    for height in (0.0, 0.025):
        tracks = make_tracks([[[0.0, 0.0, height]]], [0.0], units="m")
        areas.append(int((next(frames_of(taken(), tracks)) > 120).sum()))
    assert areas[1] == pytest.approx(4 * areas[0], rel=0.05)


def test_compression_leaves_its_artefacts():
    frames = [next(frames_of(taken(jpeg_quality=quality), sliding())).astype(int) for quality in (None, 95, 30)]
    errors = [np.abs(frame - frames[0]).mean() for frame in frames]
    assert 0 == errors[0] < errors[1] < errors[2] < 3


def test_a_film_is_written_with_its_truth(tmp_path):
    pixel_camera = PixelCamera(camera(frame_rate=60.0), noise=SensorNoise(3.0, 0.02), seed=3)
    truth = film(pixel_camera, sliding(), tmp_path / "slide.mkv")
    assert video_info(tmp_path / "slide.mkv").frame_rate == 60.0
    np.testing.assert_array_equal(list(read_frames(tmp_path / "slide.mkv")), list(frames_of(pixel_camera, sliding())))
    assert truth.sizes["time"] == 13
    assert truth.attrs["source"] == "truth of slide.mkv"


def test_tracks_without_a_time_give_no_film(tmp_path):
    empty = make_tracks(np.empty((0, 1, 3)), [], units="m")
    assert list(frames_of(taken(), empty)) == []
    with pytest.raises(InputError, match="frames: got none"):
        film(taken(), empty, tmp_path / "a.avi")
