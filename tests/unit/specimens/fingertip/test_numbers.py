"""Fingertips whose numbers do not fit together are refused; the rest is taken as given."""

from __future__ import annotations

import pytest

from fingerslip.errors import InputError
from unit.fingers import change


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        ({"layers": {"epidermis_thickness": "1.5 mm"}}, "epidermis_thickness: got 1.5 mm, needs a value < 1.5 mm"),
        ({"layers": {"skin_thickness": "7 mm"}, "receptors": {"fa_ii_depth": "8 mm"}}, "skin_thickness: got 7 mm"),
        ({"ridges": {"intermediate_height": "1.5 mm"}}, "ridges.intermediate_height: got 1.5 mm.*pierces the dermis"),
        ({"ridges": {"limiting_height": "2 mm"}}, "ridges.limiting_height: got 2 mm.*pierces the dermis"),
        (
            {"layers": {"epidermis_thickness": "0.2 mm"}, "ridges": {"intermediate_height": "0.9 mm"}},
            "ridges: mean height 0.25 mm.*needs < 0.2 mm.*between ridges is thinner by that height",
        ),
        (
            {"fingerprint": {"enabled": True, "height": "1 mm"}},
            "fingerprint.height: got 1 mm.*grooves reach the dermis",
        ),
        ({"receptors": {"sa_ii_height": "1 mm"}}, "receptors.sa_ii_height: got 1 mm, needs a value < 1 mm"),
        ({"receptors": {"fa_ii_depth": "1.5 mm"}}, "receptors.fa_ii_depth: got 1.5 mm, needs a value > 1.5 mm"),
        ({"sagittal": {"pad_rise": "14 mm"}}, "pad_rise: got 14 mm, needs a value < 14 mm"),
        ({"sagittal": {"zone": {"fade": "10 mm"}}}, "sagittal.zone: zone from -12 mm to 7 mm with fade 10 mm"),
        ({"phalanx": {"sagittal": {"concavity_depth": "5 mm"}}}, "concavity_depth: got 5 mm, needs a value < 4.5 mm"),
        ({"phalanx": {"corner_radius": "2.5 mm"}}, "corner_radius: got 2.5 mm"),
        ({"phalanx": {"transverse": {"palmar_level": "-3 mm"}}}, "palmar_level: got -3 mm"),
        ({"phalanx": {"transverse": {"concavity_depth": "3 mm"}}}, "concavity_depth: got 3 mm"),
        ({"materials": {"nail": {}}}, "materials"),
        ({"depth": "0 mm"}, "depth: got"),
    ],
)
def test_wrong_combinations_are_one_clear_error(groups, message):
    with pytest.raises(InputError, match=message):
        change(**groups)


def test_materials_are_those_of_the_four_regions():
    nail = {"youngs_modulus": "1 GPa", "poisson_ratio": 0.3, "density": "1000 kg/m^3"}
    with pytest.raises(InputError, match=r"materials: has .*nail, needs epidermis, dermis, tissue, phalanx"):
        change(materials={"nail": nail})


def test_ridges_that_are_off_are_not_checked():
    assert not change(ridges={"enabled": False, "intermediate_height": "5 mm"}).ridges.enabled


def test_outline_and_zone_are_those_of_the_chosen_section():
    along, across = change(), change(section="transverse")
    assert (along.outline, along.zone) == (along.sagittal, along.sagittal.zone)
    assert (across.outline, across.zone) == (across.transverse, across.transverse.zone)
