"""Parts of a fingertip that cannot be are refused, each by itself."""

from __future__ import annotations

import pytest

from fingerslip.errors import InputError
from fingerslip.specimens.fingertip.numbers import (
    Fingerprint,
    Layers,
    Ridges,
    RidgeZone,
    SagittalOutline,
    TransverseOutline,
)

ZONE = RidgeZone(-12e-3, 7e-3, 1e-3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: RidgeZone(-1e-3, 1e-3, 1e-3), "zone from -1 mm to 1 mm with fade 1 mm, needs end - start > 2 fade"),
        (lambda: SagittalOutline(6e-3, 16e-3, 12e-3, 8e-3, ZONE), "pad_rise: got 12 mm, needs a value < 12 mm"),
        (
            lambda: SagittalOutline(6.5, 16.0, 6.0, 8.0, ZONE),
            "half_height: got 6500 mm, needs at most 1000 mm",
        ),
        (lambda: TransverseOutline(1e9, 6e-3, ZONE), "half_width: got .* mm, needs at most 1000 mm"),
        (lambda: Layers(1e-3, 1e-3), "epidermis_thickness: got 1 mm, needs a value < 1 mm"),
        (lambda: Layers("1.5", "0.5 mm"), "'1.5' has no unit"),
    ],
)
def test_parts_that_cannot_be_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_dermis_is_what_the_epidermis_leaves_of_the_skin():
    assert Layers(1.5e-3, 0.5e-3).dermis_thickness == pytest.approx(1e-3)


def test_mean_height_of_ridges_is_that_of_two_half_squared_cosines():
    assert Ridges(True, 0.47e-3, 0.15e-3, 0.1e-3).mean_height == pytest.approx(0.0625e-3)


def test_angles_are_read_in_degrees():
    assert Fingerprint(True, "0.47 mm", "0.1 mm", "180 deg").phase == pytest.approx(3.14159265)
