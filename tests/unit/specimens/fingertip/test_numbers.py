"""The numbers of a fingertip: what does not fit together is refused, and every value that ships has a source."""

import dataclasses
from importlib import resources

import pytest

import fingerslip as fs
from fingerslip.parameters import as_mapping, from_mapping, walk_values
from fingerslip.specimens.fingertip.fingertip import PRESETS
from fingerslip.specimens.fingertip.numbers import Fingerprint, Layers, Nail, Ridges, skin_room
from unit.fingers import HARD, NAIL, change, change_solid

NAME = "wang2014-2d"


def test_derived_numbers_are_those_of_the_chosen_section_and_switches():
    along, across = change(), change(section="transverse")
    assert (along.outline, along.zone) == (along.sagittal, along.sagittal.zone)
    assert (across.outline, across.zone) == (across.transverse, across.transverse.zone)
    assert not change(ridges={"enabled": False, "intermediate_height": "5 mm"}).ridges.enabled
    assert Layers(1.5e-3, 0.5e-3).dermis_thickness == pytest.approx(1e-3)
    # Two half squared cosines.
    assert Ridges(True, 0.47e-3, 0.15e-3, 0.1e-3).mean_height == pytest.approx(0.0625e-3)
    assert Fingerprint(True, "0.47 mm", "0.1 mm", "180 deg").phase == pytest.approx(3.14159265)
    assert change_solid(solid={"nail": NAIL}, materials={"nail": HARD}).solid.nail == Nail(-4e-3, 5e-3, 5e-3, 5e-4)


@pytest.mark.parametrize(
    ("changes", "room", "limit"),
    [
        ({"phalanx": {"sagittal": {"distal_end": "3 mm"}}}, 4e-3, "phalanx.sagittal.dorsal_level"),
        ({"phalanx": {"sagittal": {"palmar_level": "-4.5 mm"}}}, 2.5e-3, "phalanx.sagittal.palmar_level"),
        ({"section": "transverse"}, 2.5e-3, "phalanx.transverse.half_width"),
        ({"section": "transverse", "transverse": {"half_height": "5 mm"}}, 2e-3, "phalanx.transverse.half_height"),
        ({"phalanx": {"variant": "scaled"}}, 7e-3, "sagittal.half_height"),
    ],
)
def test_room_is_set_by_the_nearest_face(changes, room, limit):
    fingertip = change(**changes)
    assert skin_room(fingertip.outline, fingertip.phalanx) == (pytest.approx(room), limit)


def test_presets_hold_what_is_published_and_that_in_3d_keeps_the_sections():
    plane, solid = fs.preset("wang2014-2d"), fs.preset("wang2014-3d")
    # The half height of the section is calibrated, that of the fingertip in 3D is not.
    assert dataclasses.replace(plane.sagittal, half_height=6.5e-3) == solid.sagittal
    assert plane.sagittal.half_height == 7e-3
    assert plane.transverse == solid.transverse
    assert plane.phalanx.sagittal == solid.phalanx.sagittal
    assert solid.layers.skin_thickness == 1e-3
    assert solid.materials["epidermis"] == solid.materials["dermis"]
    fingertip, materials = plane, plane.materials
    assert (fingertip.layers.skin_thickness, fingertip.receptors.fa_ii_depth) == (1.5e-3, 3e-3)
    assert (fingertip.section, fingertip.formulation) == ("sagittal", "plane_stress")
    moduli = {name: material.youngs_modulus for name, material in materials.items()}
    assert moduli == {"epidermis": 136e3, "dermis": 80e3, "tissue": 34e3, "phalanx": 1.5e9}
    assert [materials[name].poisson_ratio for name in ("tissue", "phalanx")] == [0.48, 0.30]
    assert [materials[name].density for name in ("tissue", "phalanx")] == [1000.0, 449.0]


@pytest.mark.parametrize("name", [NAME, "wang2014-3d"])
def test_every_value_of_the_preset_has_a_source_and_it_says_what_it_does_not_claim(name):
    table = fs.preset_table(name)
    references = resources.files("fingerslip").joinpath("references.bib").read_text()
    # What a preset leaves out, such as the nail, has no source either.
    assert {row.path for row in table} == {leaf.path for leaf in walk_values(fs.preset(name))}
    assert {row.source for row in table} == {"assumed", "wang2014", "corniani2024"}
    assert all(row.source == "assumed" or f"{{{row.source}," in references for row in table)
    assert all(row.note for row in table)
    assumed = [row.source == "assumed" for row in table]
    assert assumed == sorted(assumed, reverse=True)
    assert fs.preset_names() == (NAME, "wang2014-3d")
    assert "no dimension" in PRESETS.header(name)["claims_not"]


def test_a_preset_of_a_sensor_names_the_way_to_its_model():
    with pytest.raises(fs.InputError, match=r"no fingertip, needs one of .*; other specimens .* fs\.study_model"):
        fs.preset("tactip-ridged-2d")


def test_study_overrides_merge_deeply():
    assert fs.fingertip_from({"preset": NAME}, "x") == fs.preset(NAME)
    assert from_mapping(fs.Fingertip, as_mapping(fs.preset(NAME)), "x") == fs.preset(NAME)
    changed = change(phalanx={"variant": "flattened", "sagittal": {"distal_end": "3 mm"}}).phalanx
    assert (changed.variant, changed.sagittal.distal_end) == ("flattened", 3e-3)
    assert changed.sagittal.palmar_level == fs.preset(NAME).phalanx.sagittal.palmar_level
