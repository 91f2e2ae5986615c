"""What of a TacTip does not fit together."""

from __future__ import annotations

import pytest

from fingerslip.errors import InputError
from fingerslip.specimens.tactip.tactip import PRESETS


def test_depths_of_rods_and_markers():
    sensor = PRESETS.read("tactip-ridged-2d")
    assert sensor.rod_depth == pytest.approx(0.5e-3)
    assert sensor.marker_depth == pytest.approx(6e-3)


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({"rods": {"embedding": "1 mm"}}, "rods.embedding: got 1 mm"),
        ({"rods": {"radius": "1.3 mm"}}, "inside its ridge"),
        ({"rods": {"length": "10 mm"}}, "make the rods shorter or thinner"),
        ({"rods": {"length": "16 mm"}}, r"needs < 20 mm \(dome.radius\)"),
        ({"markers": {"layout": "hexagonal"}}, "needs rings, as a rod begins in the crown.* take a smooth skin"),
        ({"markers": {"spacing": "3 mm"}}, "as a ridge has each ring"),
        ({"markers": {"rings": [1, 8, 16, 24, 32, 40]}}, "has 5 rings"),
        ({"dome": {"height": "4 mm"}}, "from crowns to its inside"),
    ],
)
def test_values_that_do_not_fit(changes, found):
    with pytest.raises(InputError, match=found):
        PRESETS.changed({"preset": "tactip-ridged-2d", **changes})


def test_a_hexagonal_layout_fits_a_smooth_skin():
    sensor = PRESETS.changed({"preset": "tactip-smooth-2d", "markers": {"layout": "hexagonal", "spacing": "2 mm"}})
    assert sensor.markers.layout == "hexagonal"
