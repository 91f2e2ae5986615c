"""The numbers of the phalanx: what they refuse."""

from __future__ import annotations

import pytest

from fingerslip.errors import InputError
from unit.fingers import change


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        (
            {"sagittal": {"concavity_depth": "5 mm"}},
            r"phalanx.sagittal.concavity_depth: got 5 mm, needs a value < 4.5 mm",
        ),
        ({"transverse": {"palmar_level": "-3 mm"}}, r"phalanx.transverse.palmar_level: got -3 mm"),
        ({"corner_radius": "3 mm"}, r"phalanx.corner_radius: got 3 mm, needs a value < 2.25 mm"),
    ],
)
def test_phalanges_that_cannot_be_are_refused(groups, message):
    with pytest.raises(InputError, match=message):
        change(phalanx=groups)
