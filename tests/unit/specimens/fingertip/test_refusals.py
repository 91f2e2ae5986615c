"""Numbers, shapes, sizes and sites of a fingertip that do not fit are refused, each with what would."""

import pytest

import fingerslip as fs
from fingerslip.specimens.fingertip.phalanx import phalanx_contour, phalanx_surface
from fingerslip.specimens.fingertip.sites import skin_markers
from fingerslip.specimens.fingertip.skin import solid_shape
from unit.fingers import HARD, NAIL, change, change_solid

NAME = "wang2014-2d"
WIDE = {"contact_size": 0.3e-3, "bulk_size": 1e-3}
COARSE = {"contact_size": 0.8e-3, "bulk_size": 1.6e-3}
HIGH = {"layers": {"epidermis_thickness": "0.2 mm"}, "ridges": {"intermediate_height": "0.9 mm"}}
THICK = {"layers": {"skin_thickness": "4 mm"}}
CROSSING = {"layers": {"skin_thickness": "3.5 mm"}, "receptors": {"fa_ii_depth": "4 mm"}}
NAILED = {"solid": {"nail": {**NAIL, "thickness": "0.45 mm"}}, "materials": {"nail": HARD}}
RIPPLED, PLAIN = {"fingerprint": {"enabled": True}}, {"ridges": {"enabled": False}}


def overrides(**values):
    fs.fingertip_from(values, "study.fingertip")


def contour(**groups):
    phalanx_contour(change(**groups))


def surface(**groups):
    phalanx_surface(change_solid(**groups))


def section(sizes, **groups):
    fs.build_section(change(**groups), **sizes)


def solid(sizes, **groups):
    fs.build_solid(change_solid(**groups), **sizes)


def in_3d(function):
    function(change())


def sites(groups):
    change_solid().sites(groups, 2)


REFUSED = {
    change: [
        ({"layers": {"epidermis_thickness": "1.5 mm"}}, "epidermis_thickness: got 1.5 mm, needs a value < 1.5 mm"),
        ({"layers": {"skin_thickness": "7 mm"}, "receptors": {"fa_ii_depth": "8 mm"}}, "skin_thickness: got 7 mm"),
        # FA-II at 3 mm would be in this skin too, but it is the skin that does not fit.
        (
            THICK,
            "skin_thickness: got 4 mm, needs a value < 3 mm; make the skin thinner or change .*distal_end",
        ),
        ({"ridges": {"intermediate_height": "1.5 mm"}}, "ridges.intermediate_height: got 1.5 mm.*pierces the dermis"),
        ({"ridges": {"limiting_height": "2 mm"}}, "ridges.limiting_height: got 2 mm.*pierces the dermis"),
        (HIGH, "ridges: mean height 0.25 mm.*needs < 0.2 mm.*between ridges is thinner by that height"),
        ({"fingerprint": {"enabled": True, "height": "1 mm"}}, "fingerprint.height: got 1 mm.*reach the dermis"),
        ({"receptors": {"sa_ii_height": "1 mm"}}, "receptors.sa_ii_height: got 1 mm, needs a value < 1 mm"),
        ({"receptors": {"fa_ii_depth": "1.5 mm"}}, "receptors.fa_ii_depth: got 1.5 mm, needs a value > 1.5 mm"),
        ({"sagittal": {"pad_rise": "14 mm"}}, "pad_rise: got 14 mm, needs a value < 14 mm"),
        ({"sagittal": {"zone": {"fade": "10 mm"}}}, "sagittal.zone: zone from -12 mm to 7 mm with fade 10 mm"),
        ({"phalanx": {"sagittal": {"concavity_depth": "5 mm"}}}, "concavity_depth: got 5 mm, needs a value < 4.5 mm"),
        ({"phalanx": {"corner_radius": "2.5 mm"}}, "corner_radius: got 2.5 mm"),
        ({"phalanx": {"transverse": {"palmar_level": "-3 mm"}}}, "palmar_level: got -3 mm"),
        ({"phalanx": {"transverse": {"concavity_depth": "3 mm"}}}, "concavity_depth: got 3 mm"),
        ({"materials": {"nail": HARD}}, "materials: has .*nail, needs epidermis, dermis, tissue, phalanx"),
        ({"phalanx": {"corner_radius": "3 mm"}}, "phalanx.corner_radius: got 3 mm, needs a value < 2.25 mm"),
        ({"sagittal": {"half_height": "6500 mm"}}, "half_height: got 6500 mm, needs at most 1000 mm"),
        ({"transverse": {"half_width": "1e9 m"}}, "half_width: got .* mm, needs at most 1000 mm"),
        ({"layers": {"skin_thickness": "1.5"}}, "'1.5' has no unit"),
        ({"depth": "0 mm"}, "depth: got"),
    ],
    change_solid: [
        ({"transverse": {"half_height": "6 mm"}}, r"transverse.half_height: got 6 mm, needs 6.5 mm"),
        ({"solid": {"angle": "40 deg"}}, r"solid.angle: got 0.6981 rad"),
        ({"solid": {"phalanx": {"waist_position": "1 mm"}}}, r"waist_position: got 1 mm, needs a value between -16 mm"),
        ({"solid": {"nail": NAIL}}, r"materials: has .*, needs .*nail"),
        ({"solid": {"nail": {**NAIL, "end": "-5 mm"}}}, r"solid.nail.end: got -5 mm, needs a value > -4 mm"),
        ({"solid": {"base_half_width": "0 mm"}}, r"base_half_width"),
        *(
            ({"solid": {"nail": {**NAIL, name: value}}, "materials": {"nail": HARD}}, f"solid.nail.{name}: got {value}")
            for name, value in (("end", "9 mm"), ("half_width", "9 mm"), ("thickness", "1 mm"), ("start", "-17 mm"))
        ),
    ],
    overrides: [
        ({"preset": "wang2014-2"}, "study.fingertip.preset: 'wang2014-2' is not known.*did you mean 'wang2014-2d'?"),
        ({"preset": "wang2014"}, "did you mean 'wang2014-2d' or 'wang2014-3d'"),
        ({}, "study.fingertip.preset: is missing, needs one of wang2014-2d"),
        ({"preset": NAME, "phalanx": {"variety": "flattened"}}, "phalanx.variety: is not known.*mean 'variant'"),
        ({"preset": NAME, "phalanx": {"variant": "flat"}}, "phalanx.variant: got 'flat'"),
        ({"preset": NAME, "layers": {"skin_thickness": 1.5}}, "skin_thickness: '1.5' has no unit.*write '1.5 mm'"),
        ({"preset": NAME, "ridges": True}, "ridges"),
    ],
    contour: [
        ({"layers": {"skin_thickness": "2.9 mm"}, "receptors": {"fa_ii_depth": "4 mm"}}, "phalanx: .* of tissue at"),
        ({"phalanx": {"sagittal": {"distal_end": "9 mm"}}}, "phalanx: -3.01 mm of tissue at x = 8.98 mm"),
        ({"phalanx": {"sagittal": {"distal_end": "-15.9 mm"}}}, "distal_end: got -15.9 mm, needs a value > -15.7 mm"),
        ({"phalanx": {"sagittal": {"dorsal_level": "-0.6 mm", "concavity_depth": "0.85 mm"}}}, "level: got -0.6 mm"),
        ({"phalanx": {"variant": "scaled", "tissue_thickness": "6 mm"}}, "tissue_thickness: got 6 mm.*nothing is left"),
        ({"section": "transverse", "phalanx": {"transverse": {"half_width": "7 mm"}}}, "phalanx: .* tissue at x = 7"),
    ],
    surface: [
        ({"solid": {"phalanx": {"base_half_width": "7.5 mm"}}}, "of tissue at x = .* z = "),
        ({"solid": {"phalanx": {"end_half_width": "0.2 mm"}}}, "end_half_width: got 0.2 mm"),
        ({"phalanx": {"sagittal": {"distal_end": "0.2 mm"}}}, "distal_end: got 0.2 mm, needs to reach beyond"),
    ],
    section: [
        ({"sizes": WIDE}, "contact_size: got 0.3 mm.*third of ridges.pitch.*'0.1175 mm'"),
        ({"sizes": WIDE, **PLAIN, **RIPPLED}, "third of fingerprint.pitch.*switch the fingerprint off"),
        ({"sizes": {"contact_size": 0.157e-3}}, "contact_size: got 0.157 mm, needs <= 0.1567 mm, a third of ridges"),
        ({"sizes": {"bulk_size": 0.05e-3}}, r"^MeshSizes.bulk_size: got 0.05 mm, needs >= 0.12 mm \(contact_size\)$"),
        ({"sizes": {"element": "T4"}}, "element"),
        ({"sizes": {}, "sagittal": {"zone": {"start": "-20 mm"}}}, "zone: reaches from -20 mm to 7 mm, needs to lie"),
        ({"sizes": {}, "sagittal": {"zone": {"end": "40 mm"}}}, "sagittal.zone: reaches from -12 mm to 40 mm"),
    ],
    solid: [
        ({"sizes": {"contact_size": 1e-3, "bulk_size": 0.5e-3}}, "bulk_size: got 0.5 mm, needs >= 1 mm"),
        ({"sizes": {"bulk_size": 0.2e-3}}, "bulk_size: got 0.2 mm, needs >= 0.8 mm"),
        ({"sizes": {**COARSE, "element": "Q4"}}, "element"),
        ({"sizes": COARSE, **CROSSING}, "got 3.5 mm, needs a smaller value: layers would cross .* x = "),
        ({"sizes": COARSE, **NAILED}, "layers: has borders 0.05 mm apart"),
        ({"sizes": COARSE, **RIPPLED}, "contact_size: got 0.8 mm, needs <= 0.1175 mm, a quarter of fingerprint.pitch"),
    ],
    in_3d: [
        ({"function": function}, "fingertip.solid: is missing")
        for function in (
            *(fs.reference_sites, fs.solid_receptor_sites, skin_markers),
            *(solid_shape, phalanx_surface, lambda finger: fs.build_solid(finger, **COARSE)),
        )
    ],
    sites: [
        ({"groups": ("reference_nodes",)}, r"record.reference_nodes: without a fingertip in 3D, .* T4 or T10"),
        ({"groups": ("FA-I", "whisker")}, r"a fingertip has no 'whisker', needs some of FA-I, .*, external_markers"),
    ],
}


@pytest.mark.parametrize(
    ("make", "values", "message"),
    [
        pytest.param(make, *row, id=f"{make.__name__}-{number}")
        for make, cases in REFUSED.items()
        for number, row in enumerate(cases)
    ],
)
def test_what_does_not_fit_is_one_clear_error(make, values, message):
    with pytest.raises(fs.InputError, match=message):
        make(**values)
