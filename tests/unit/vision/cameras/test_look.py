"""Looks are checked numbers; a camera of 1080p with all faults can be written down."""

from __future__ import annotations

import dataclasses

import pytest

from fingerslip.errors import InputError
from fingerslip.vision.cameras.looks import (
    BRIGHT_ON_DARK,
    DARK_ON_BRIGHT,
    HARSH_LIGHT,
    Glare,
    Lighting,
    MarkerLook,
    PixelCamera,
    SensorNoise,
)
from unit.vision.cameras.scenes import camera


def test_defaults_have_no_fault_but_noise():
    plain = PixelCamera(camera())
    assert plain.lighting == Lighting()
    assert (plain.noise.read, plain.jpeg_quality) == (2.0, None)
    assert HARSH_LIGHT.ring is not None
    assert BRIGHT_ON_DARK.marker > BRIGHT_ON_DARK.background
    assert DARK_ON_BRIGHT.marker < DARK_ON_BRIGHT.background


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: MarkerLook(radius=0.0), "radius"),
        (lambda: MarkerLook(marker=256.0), "marker"),
        (lambda: MarkerLook(softness=0.3), "softness"),
        (lambda: Lighting(vignetting=1.5), "vignetting"),
        (lambda: Glare(2.0, 0.5), "x"),
        (lambda: SensorNoise(read=-1.0), "read"),
        (lambda: PixelCamera(camera(), jpeg_quality=0), "jpeg_quality"),
        (lambda: PixelCamera(camera(), seed=-1), "seed"),
        (lambda: dataclasses.replace(PixelCamera(camera()), seed=2**63), "seed"),
    ],
)
def test_what_cannot_be_is_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()
