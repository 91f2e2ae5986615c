"""Cameras in study files."""

from __future__ import annotations

import pytest

from fingerslip.errors import InputError
from fingerslip.parameters import from_mapping
from fingerslip.study.definition.settings import CameraSettings


def test_values_have_units_and_defaults():
    camera = from_mapping(CameraSettings, {"view_width": "30 mm", "frame_rate": "60 1/s", "exposure": "5 ms"})
    assert (camera.view_width, camera.frame_rate, camera.exposure) == (0.03, 60.0, 5e-3)
    assert (camera.tier, camera.markers, camera.light) == ("pixel", "bright", "even")


def test_the_shutter_closes_before_the_next_frame():
    with pytest.raises(InputError, match=r"exposure: got 50 ms, needs at most a frame, 33.33 ms"):
        CameraSettings(exposure=50e-3)
