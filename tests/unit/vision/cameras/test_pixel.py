"""Frames show markers where they truly are with the faults that were asked for, and are the same for the same seed."""

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.cameras import pixel
from fingerslip.vision.cameras.camera import true_tracks
from fingerslip.vision.tracks import make_tracks
from fingerslip.vision.video import read_frames, stated_rate
from unit.vision.scenes import camera, hide, middle, silent_camera, sliding


def first_frame(tracks, **more):
    return next(pixel.frames_of(silent_camera(**more), tracks))


def marker_at(*place):
    return make_tracks([[place]], [0.0], units="m")


@pytest.mark.parametrize("look", [pixel.MarkerLook(), pixel.DARK_ON_BRIGHT])
@pytest.mark.parametrize("exposure", [0.0, 0.02])
def test_markers_are_where_they_truly_are(look, exposure):
    """Within what 8 bits hold: 0.03 px for a marker that is smeared over 2 px in an exposure."""
    pixel_camera = silent_camera(camera=camera(exposure=exposure), look=look)
    tracks = sliding(speed=10e-3)
    truth = true_tracks(pixel_camera.camera, tracks)["position"].values
    for frame, places in zip(pixel.frames_of(pixel_camera, tracks), truth, strict=True):
        assert frame.dtype == np.uint8
        for place in places:
            np.testing.assert_allclose(middle(frame, place), place, atol=0.03)


def test_a_longer_exposure_smears_a_moving_marker_along_its_way():
    tracks = sliding(speed=100e-3, seconds=0.03)

    def variance(exposure, axis):
        frame = first_frame(tracks, camera=camera(exposure=exposure))
        weights = frame[45:75, 65:95].astype(float).sum(axis=1 - axis) - 30 * 40
        return float(np.cov(np.arange(30), aweights=weights, ddof=0))

    # 100 mm/s at 10 px/mm in 10 ms are 10 px: an even spread over a length L adds the variance L²/12.
    assert variance(10e-3, 1) - variance(0.0, 1) == pytest.approx(100 / 12, rel=0.03)
    assert variance(10e-3, 0) == pytest.approx(variance(0.0, 0), rel=0.03)


def test_a_part_of_the_frames_is_as_in_the_whole():
    pixel_camera = pixel.PixelCamera(camera(), lighting=pixel.Lighting(drift=0.1, texture=3.0), seed=7)
    tracks = sliding(seconds=3.0)
    whole = list(pixel.frames_of(pixel_camera, tracks))
    assert len(whole) == 91
    np.testing.assert_array_equal(list(pixel.frames_of(pixel_camera, tracks, start=60, stop=70)), whole[60:70])
    assert (next(pixel.frames_of(pixel.PixelCamera(camera(), seed=8), tracks)) != whole[0]).mean() > 0.5


def test_what_is_drawn_of_markers_unknown_outside_near_and_in_2d():
    frame = first_frame(hide(sliding(), slice(None), 0))
    assert (frame[60, 80], frame.max()) == (40, 200)
    outside = marker_at(8.2e-3, 0.0, 0.0)
    assert first_frame(outside)[:, -1].max() > 100, "it reaches into the image"
    assert np.isnan(true_tracks(silent_camera().camera, outside)["position"].values).all()
    assert first_frame(marker_at(0.0, 0.0))[60, 80] == 200
    far, near = (int((first_frame(marker_at(0.0, 0.0, z)) > 120).sum()) for z in (0.0, 0.025))
    assert near == pytest.approx(4 * far, rel=0.05)


def test_a_film_is_written_with_its_truth_and_compression_leaves_its_artefacts(tmp_path):
    pixel_camera = pixel.PixelCamera(camera(frame_rate=60.0), noise=pixel.SensorNoise(3.0, 0.02), seed=3)
    truth = pixel.film(pixel_camera, sliding(), tmp_path / "slide.mkv")
    assert stated_rate(tmp_path / "slide.mkv") == 60.0
    np.testing.assert_array_equal(
        list(read_frames(tmp_path / "slide.mkv")), list(pixel.frames_of(pixel_camera, sliding()))
    )
    assert (truth.sizes["time"], truth.attrs["source"]) == (13, "truth of slide.mkv")
    with pytest.raises(InputError, match="frames: got none"):
        pixel.film(silent_camera(), make_tracks(np.empty((0, 1, 3)), [], units="m"), tmp_path / "a.avi")
    frames = [first_frame(sliding(), jpeg_quality=quality).astype(int) for quality in (None, 95, 30)]
    errors = [np.abs(frame - frames[0]).mean() for frame in frames]
    assert 0 == errors[0] < errors[1] < errors[2] < 3


@pytest.mark.parametrize(("angle", "axis"), [(0.0, 1), (np.pi / 2, 0)])
def test_light_is_even_but_for_vignetting_and_a_gradient(angle, axis):
    even = silent_camera(camera=camera(120, 120))
    assert [np.unique(picture).tolist() for picture in pixel.pictures(even)] == [[40.0], [200.0]]
    _, dim = pixel.pictures(silent_camera(lighting=pixel.Lighting(vignetting=0.4)))
    assert (dim[0, 0], dim[60, 80]) == (pytest.approx(120.0), pytest.approx(200.0, rel=1e-3))
    lighting = pixel.Lighting(gradient=0.5, gradient_angle=angle)
    _, picture = pixel.pictures(silent_camera(camera=camera(120, 120), lighting=lighting))
    np.testing.assert_allclose(picture.take([0, -1], axis=axis).mean(axis=1 - axis), [150.0, 250.0], rtol=0.01)


def test_glare_and_ring_are_where_they_should_be():
    picture, _ = pixel.pictures(silent_camera(lighting=pixel.Lighting(glare=(pixel.Glare(0.25, 0.75, 0.02, 100.0),))))
    assert np.unravel_index(picture.argmax(), picture.shape) in {(89, 39), (89, 40), (90, 39), (90, 40)}
    assert picture.max() == pytest.approx(140.0, rel=0.02)
    ringed = silent_camera(lighting=pixel.Lighting(ring=pixel.BrightRing(0.4, 0.02, 100.0)))
    picture, _ = pixel.pictures(ringed)
    assert (picture[60, 80 + 48], picture[60, 80]) == (pytest.approx(140.0, rel=0.05), pytest.approx(40.0))


def test_moulded_pins_stand_on_a_dome_inside_a_white_mount_and_glue_touches_some_of_them():
    size = camera(320, 240)
    tracks = make_tracks([[(4e-3 * x, 4e-3 * y, 0.0) for x in (-1, 0, 1) for y in (-1, 0, 1)]], [0.0], units="m")
    looks = [pixel.MarkerLook(), pixel.MarkerLook(dome=8e-3), pixel.MarkerLook(dome=8e-3, glue=1.0)]
    flat, domed, glued = ((first_frame(tracks, camera=size, look=look) > 120).sum() for look in looks)
    assert flat > domed + 50
    assert glued > 1.2 * domed
    mounted, _ = pixel.pictures(silent_camera(camera=size, look=pixel.MOULDED, lighting=pixel.LAMPS))
    assert np.unique(mounted[[0, 0, -1, -1], [0, -1, 0, -1]]).tolist() == [pytest.approx(245.0)]
    assert mounted[120, 160] < 130.0
    saturated = mounted[:, :] > 255.0
    assert 0.003 < saturated.mean() < 0.05, "lamps and ring"


def test_texture_is_of_the_background_alone_and_brightness_drifts_and_flickers():
    lighting = pixel.Lighting(texture=5.0)
    first, again, other = (pixel.pictures(silent_camera(lighting=lighting, seed=seed))[0] for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 1
    assert first.std() == pytest.approx(5.0, rel=1e-5)
    assert np.unique(pixel.pictures(silent_camera(lighting=lighting))[1]).tolist() == [200.0]
    lighting = pixel.Lighting(drift=-0.01, flicker=0.1, flicker_rate=1.0)
    np.testing.assert_allclose(pixel.brightness(lighting, np.array([0.0, 0.25, 10.0, 1e6])), [1, 1.0975, 0.9, 0])


def drawn(place, half=(0.0, 0.0), radius=5.0, softness=0.7, tilt=(0.0, 0.0)):
    picture, top = np.zeros((64, 80), dtype=np.float32), np.full((64, 80), 1.0, dtype=np.float32)
    pixel.draw_spots(picture, top, np.array([place]), np.array([half]), np.array([radius]), np.array([tilt]), softness)
    return picture


def middle_of(picture):
    rows, columns = np.indices(picture.shape)
    return float((picture * columns).sum() / picture.sum()), float((picture * rows).sum() / picture.sum())


@pytest.mark.parametrize("radius", [1.0, 2.0, 9.0])
@pytest.mark.parametrize("softness", [0.5, 0.7, 2.0])
def test_the_middle_of_a_spot_is_exact(radius, softness):
    """To 0.0025 px for small and sharp spots, and to 0.0002 px for those of 2 px and the softness of cameras."""
    worst = 0.0
    for place in np.random.default_rng(0).uniform((30, 24), (50, 40), (30, 2)):
        error = np.subtract(middle_of(drawn(place, radius=radius, softness=softness)), place)
        worst = max(worst, *np.abs(error))
    assert worst < (2e-4 if radius >= 2 and softness > 0.5 else 2.5e-3)


@pytest.mark.parametrize("half", [(3.0, 0.0), (0.4, -2.2), (0.0, 0.05)])
def test_the_middle_of_a_smeared_spot_is_exact(half):
    picture = drawn((40.3, 31.8), half)
    np.testing.assert_allclose(middle_of(picture), (40.3, 31.8), atol=1e-3)
    assert picture.sum() == pytest.approx(drawn((40.3, 31.8)).sum(), rel=1e-3), "the light is spread, not lost"


@pytest.mark.parametrize("tilt", [(0.6, 0.0), (0.0, -0.8), (0.5, 0.5)])
def test_a_disc_that_leans_is_an_ellipse_around_the_same_middle(tilt):
    picture, sine = drawn((40.3, 31.8), radius=9.0, tilt=tilt), np.hypot(*tilt)
    np.testing.assert_allclose(middle_of(picture), (40.3, 31.8), atol=2e-3)
    assert picture.sum() == pytest.approx(np.pi * 81 * np.sqrt(1.0 - sine**2), rel=0.02)
    rows, columns = np.indices(picture.shape)
    along = (columns - 40.3) * tilt[0] / sine + (rows - 31.8) * tilt[1] / sine
    # The variance of an ellipse along a half axis a is a²/4, and the softness adds its own.
    width = np.sqrt(4.0 * ((picture * along**2).sum() / picture.sum() - 0.7**2))
    assert width == pytest.approx(9.0 * np.sqrt(1.0 - sine**2), rel=0.03)


def test_spots_cover_their_area_stay_within_the_grey_levels_and_do_no_harm_at_the_edge():
    assert drawn((40.3, 31.8), radius=8.0).sum() == pytest.approx(np.pi * 64, rel=0.01)
    assert drawn((-2.0, -1.0)).sum() > 0
    assert drawn((-200.0, 1e9)).sum() == 0
    assert drawn((np.nan, 3.0)).sum() == drawn((3.0, 3.0), (np.inf, 0.0)).sum() == 0
    picture, top = np.zeros((64, 64), dtype=np.float32), np.full((64, 64), 200.0, dtype=np.float32)
    pixel.draw_spots(picture, top, np.full((3, 2), 32.0), np.zeros((3, 2)), np.full(3, 6.0), np.zeros((3, 2)), 0.7)
    assert picture.max() <= 200.0, "over each other"


def exposed(light, factor=1.0, *, read=0.0, shot=0.0, seed=0, number=0):
    return pixel.expose(np.asarray(light, dtype=np.float32), factor, read, shot, seed, number, pixel.normal_table())


LEVEL = np.full((240, 320), 100.0)


def test_noise_has_its_deviation_and_is_white():
    frames = np.array([exposed(LEVEL, read=9.0, seed=5, number=number) for number in range(20)]).astype(float)
    errors, count = frames - frames.mean(), frames.size
    assert frames.mean() == pytest.approx(100.0, abs=5 * 3 / np.sqrt(count))
    # Rounding to whole levels adds a twelfth.
    assert errors.var() == pytest.approx(9.0 + 1 / 12, rel=5 * np.sqrt(2 / count))
    for axis in range(3):
        for lag in (1, 2, 4):
            size = errors.shape[axis]
            ahead, behind = (np.take(errors, range(start, start + size - lag), axis) for start in (lag, 0))
            assert abs((ahead * behind).mean() / errors.var()) < 5 / np.sqrt(count)
    table = pixel.normal_table().astype(float)
    assert (table.mean(), table.var(), (table**4).mean()) == pytest.approx((0.0, 1.0, 3.0), abs=3e-3)


def test_shot_noise_grows_with_the_light_and_seed_and_number_give_the_noise():
    frame = exposed(np.tile([20.0, 180.0], (200, 200)), read=1.0, shot=0.1).astype(float)
    assert frame[:, ::2].var() == pytest.approx(1 + 2 + 1 / 12, rel=0.05)
    assert frame[:, 1::2].var() == pytest.approx(1 + 18 + 1 / 12, rel=0.05)
    light = [[-5.0, 0.4, 0.6, 100.5, 254.7, 300.0]]
    assert exposed(light).tolist() == [[0, 0, 1, 101, 255, 255]]
    assert exposed(light, 2.0).tolist() == [[0, 1, 1, 201, 255, 255]]

    def one(seed, number):
        return exposed(LEVEL, read=4.0, seed=seed, number=number)

    np.testing.assert_array_equal(one(2**63 - 1, 3), one(2**63 - 1, 3))
    for first, second in (((1, 3), (1, 4)), ((1, 3), (2, 3)), ((0, 1), (1, 0))):
        assert (one(*first) != one(*second)).mean() > 0.5


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: pixel.MarkerLook(radius=0.0), "radius"),
        (lambda: pixel.MarkerLook(marker=256.0), "marker"),
        (lambda: pixel.MarkerLook(softness=0.3), "softness"),
        (lambda: pixel.Lighting(vignetting=1.5), "vignetting"),
        (lambda: pixel.Glare(2.0, 0.5), "x"),
        (lambda: pixel.SensorNoise(read=-1.0), "read"),
        (lambda: pixel.PixelCamera(camera(), jpeg_quality=0), "jpeg_quality"),
        (lambda: pixel.PixelCamera(camera(), seed=-1), "seed"),
        (lambda: pixel.PixelCamera(camera(), seed=2**63), "seed"),
    ],
)
def test_what_cannot_be_is_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()
