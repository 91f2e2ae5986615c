import pytest

from fingerslip.anatomy import fingertip_from, phalanx_contour
from fingerslip.errors import InputError


def change(**groups):
    return fingertip_from({"preset": "wang2014-2d", **groups}, "finger")


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        ({"layers": {"epidermis_thickness": "1.5 mm"}}, "epidermis_thickness: got 1.5 mm, needs a value < 1.5 mm"),
        ({"layers": {"skin_thickness": "7 mm"}, "receptors": {"fa_ii_depth": "8 mm"}}, "skin_thickness: got 7 mm"),
        ({"ridges": {"intermediate_height": "1.5 mm"}}, "ridges.intermediate_height: got 1.5 mm.*pierces the dermis"),
        ({"ridges": {"limiting_height": "2 mm"}}, "ridges.limiting_height: got 2 mm.*pierces the dermis"),
        (
            {"layers": {"epidermis_thickness": "0.2 mm"}, "ridges": {"intermediate_height": "0.9 mm"}},
            "ridges: mean height 0.25 mm, needs ridges whose mean height is < 0.2 mm",
        ),
        (
            {"fingerprint": {"enabled": True, "height": "1 mm"}},
            "fingerprint.height: got 1 mm.*grooves reach the dermis",
        ),
        ({"receptors": {"sa_ii_height": "1 mm"}}, "receptors.sa_ii_height: got 1 mm, needs a value < 1 mm"),
        ({"receptors": {"fa_ii_depth": "1.5 mm"}}, "receptors.fa_ii_depth: got 1.5 mm, needs a value > 1.5 mm"),
        ({"sagittal": {"pad_rise": "13 mm"}}, "pad_rise: got 13 mm, needs a value < 13 mm"),
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


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        ({"layers": {"skin_thickness": "2.9 mm"}, "receptors": {"fa_ii_depth": "4 mm"}}, "phalanx: .* of tissue at"),
        ({"phalanx": {"sagittal": {"distal_end": "9 mm"}}}, "phalanx: -3.07 mm of tissue at x = 8.97 mm"),
        ({"phalanx": {"sagittal": {"distal_end": "-15.9 mm"}}}, "distal_end: got -15.9 mm, needs a value > -15.7 mm"),
        (
            {"phalanx": {"sagittal": {"dorsal_level": "-0.6 mm", "concavity_depth": "0.85 mm"}}},
            "dorsal_level: got -0.6 mm",
        ),
        ({"phalanx": {"variant": "scaled", "tissue_thickness": "6 mm"}}, "tissue_thickness: got 6 mm.*nothing is left"),
        (
            {"section": "transverse", "phalanx": {"transverse": {"half_width": "7 mm"}}},
            "phalanx: .* of tissue at x = 7",
        ),
    ],
)
def test_phalanx_that_does_not_fit_is_one_clear_error(groups, message):
    with pytest.raises(InputError, match=message):
        phalanx_contour(change(**groups))
