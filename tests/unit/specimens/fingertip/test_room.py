"""The room for the skin ends at the face of the phalanx that is nearest to the outline."""

from __future__ import annotations

from typing import Any

import pytest

from fingerslip.errors import InputError
from fingerslip.specimens.fingertip.numbers import skin_room
from unit.fingers import change


@pytest.mark.parametrize(
    ("changes", "room", "limit"),
    [
        ({}, 3e-3, "phalanx.sagittal.distal_end"),
        ({"phalanx": {"sagittal": {"distal_end": "3 mm"}}}, 4e-3, "phalanx.sagittal.dorsal_level"),
        ({"phalanx": {"sagittal": {"palmar_level": "-4.5 mm"}}}, 2.5e-3, "phalanx.sagittal.palmar_level"),
        ({"section": "transverse"}, 2.5e-3, "phalanx.transverse.half_width"),
        ({"section": "transverse", "transverse": {"half_height": "5 mm"}}, 2e-3, "phalanx.transverse.half_height"),
        ({"phalanx": {"variant": "scaled"}}, 7e-3, "sagittal.half_height"),
    ],
)
def test_room_is_set_by_the_nearest_face(changes: dict[str, Any], room: float, limit: str) -> None:
    fingertip = change(**changes)
    assert skin_room(fingertip.outline, fingertip.phalanx) == (pytest.approx(room), limit)


def test_skin_without_room_is_named_before_the_receptors_in_it() -> None:
    """FA-II at 3 mm would be in this skin too, but it is the skin that does not fit."""
    with pytest.raises(InputError, match=r"layers\.skin_thickness: got 4 mm, needs a value < 3 mm") as caught:
        change(layers={"skin_thickness": "4 mm"})
    assert caught.value.repair == "make the skin thinner or change phalanx.sagittal.distal_end"
