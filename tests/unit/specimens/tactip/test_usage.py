"""Values of a TacTip that make no difference."""

from __future__ import annotations

import pytest

from fingerslip.specimens.protocol import ModelUse
from fingerslip.specimens.tactip.tactip import PRESETS, unused_reason

RIDGED, SMOOTH = PRESETS.read("tactip-ridged-2d"), PRESETS.read("tactip-smooth-2d")


@pytest.mark.parametrize(
    ("sensor", "path", "use", "reason"),
    [
        (RIDGED, "depth", ModelUse(3), "of 2D sections only"),
        (RIDGED, "dome.radius", ModelUse(2, meshed=False), "the mesh comes from a file"),
        (SMOOTH, "skin.ridges.pitch", ModelUse(2), "switched off"),
        (SMOOTH, "skin.ridges.enabled", ModelUse(2), ""),
        (RIDGED, "markers.layers", ModelUse(2), "of the hexagonal layout only"),
        (RIDGED, "markers.rings", ModelUse(2), ""),
        (RIDGED, "skin.ridges.pitch", ModelUse(2), ""),
    ],
)
def test_reasons(sensor, path, use, reason):
    assert unused_reason(sensor, path, use) == reason


def test_rings_are_not_of_a_hexagonal_layout():
    sensor = PRESETS.changed({"preset": "tactip-smooth-2d", "markers": {"layout": "hexagonal"}})
    assert unused_reason(sensor, "markers.rings", ModelUse(2)) == "of rings only"
