"""Each fault of the light does what it says."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.vision.cameras.looks import BrightRing, Glare, Lighting
from fingerslip.vision.cameras.pixel import brightness, empty_picture, marker_picture, ring_mask
from unit.vision.cameras.scenes import camera, taken


def test_even_light_is_even():
    assert np.unique(empty_picture(taken())).tolist() == [40.0]
    assert np.unique(marker_picture(taken())).tolist() == [200.0]
    assert empty_picture(taken()).shape == (120, 160)


def test_vignetting_takes_its_share_from_the_corners():
    picture = marker_picture(taken(lighting=Lighting(vignetting=0.4)))
    assert picture[0, 0] == pytest.approx(120.0)
    assert picture[60, 80] == pytest.approx(200.0, rel=1e-3)


@pytest.mark.parametrize(("angle", "axis"), [(0.0, 1), (np.pi / 2, 0)])
def test_a_gradient_brightens_in_its_direction(angle, axis):
    picture = marker_picture(taken(camera=camera(120, 120), lighting=Lighting(gradient=0.5, gradient_angle=angle)))
    ends = picture.take([0, -1], axis=axis).mean(axis=1 - axis)
    np.testing.assert_allclose(ends, [150.0, 250.0], rtol=0.01)


def test_glare_and_ring_are_where_they_should_be():
    picture = empty_picture(taken(lighting=Lighting(glare=(Glare(0.25, 0.75, 0.02, 100.0),))))
    assert np.unravel_index(picture.argmax(), picture.shape) in {(89, 39), (89, 40), (90, 39), (90, 40)}
    assert picture.max() == pytest.approx(140.0, rel=0.02)
    ring = empty_picture(taken(lighting=Lighting(ring=BrightRing(0.4, 0.02, 100.0))))
    assert ring[60, 80 + 48] == pytest.approx(140.0, rel=0.05)
    assert ring[60, 80] == pytest.approx(40.0)


def test_the_mask_is_inside_the_ring():
    assert ring_mask(taken()).all()
    mask = ring_mask(taken(lighting=Lighting(ring=BrightRing(0.4, 0.02, 100.0))))
    assert mask.sum() == pytest.approx(np.pi * (0.34 * 120) ** 2, rel=0.01)
    assert mask[60, 80]


def test_texture_is_of_the_background_alone_and_seeded():
    lighting = Lighting(texture=5.0)
    pictures = [empty_picture(taken(lighting=lighting, seed=seed)) for seed in (1, 1, 2)]
    np.testing.assert_array_equal(pictures[0], pictures[1])
    assert np.abs(pictures[0] - pictures[2]).max() > 1
    assert pictures[0].std() == pytest.approx(5.0, rel=1e-5)
    assert np.unique(marker_picture(taken(lighting=lighting))).tolist() == [200.0]


def test_brightness_drifts_and_flickers_and_is_never_negative():
    times = np.array([0.0, 0.25, 10.0, 1e6])
    np.testing.assert_allclose(
        brightness(Lighting(drift=-0.01, flicker=0.1, flicker_rate=1.0), times), [1, 1.0975, 0.9, 0]
    )
