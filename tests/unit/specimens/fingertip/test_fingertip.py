"""The fingertip as a specimen: its numbers, what a model takes from it, and that unused values make no difference."""

import dataclasses
import functools
from importlib import resources

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.parameters import as_mapping, from_mapping, walk_values
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.specimens.fingertip.fingertip import PRESETS
from fingerslip.specimens.fingertip.numbers import skin_room
from fingerslip.specimens.protocol import ModelUse
from unit.fingers import change, change_solid


def test_it_is_meshed_in_sections_and_in_3d_and_only_its_shape_changes_the_mesh():
    assert fs.Fingertip.mesh_sources == (fs.MeshSizes, fs.SolidSizes)
    assert change().default_mesh == fs.MeshSizes()
    assert change_solid().default_mesh == fs.SolidSizes()
    softer = {"materials": {"tissue": {"youngs_modulus": "20 kPa"}}}
    deeper = {"receptors": {"fa_ii_depth": "4 mm"}}
    assert change(**softer).shape == change(**deeper).shape == change().shape
    assert change(**softer) != change()
    thicker = dataclasses.replace(change(), depth=2e-3)
    assert (type(thicker), thicker.depth) == (fs.Fingertip, 2e-3)
    shaped = {"phalanx": {"variant": "scaled"}}, {"layers": {"skin_thickness": "1.4 mm"}}, {"section": "transverse"}
    for groups in (*shaped, {"ridges": {"enabled": False}}):
        assert change(**groups).shape != change().shape, groups
        assert fs.MeshSizes().key(change(**groups)) != fs.MeshSizes().key(change()), groups


def test_a_rigid_phalanx_is_held_as_a_whole_an_elastic_one_at_its_back_and_sites_are_those_asked_for():
    for axes in (("x", "y"), ("x", "y", "z")):
        assert change(phalanx={"rigid": True}).supports(len(axes)) == {"phalanx": axes}
        assert change(phalanx={"rigid": False}).supports(len(axes)) == {"phalanx_dorsal": axes}
    finger, solid = change(), change_solid()
    assert finger.sites((), 2) == ()
    assert finger.sites(RECEPTOR_KINDS, 2) == fs.receptor_sites(finger)
    assert {site.kind for site in finger.sites(("FA-II", "SA-I"), 2)} == {"SA-I", "FA-II"}
    receptors = tuple(site for site in fs.solid_receptor_sites(solid) if site.kind == "FA-I")
    assert solid.sites(("FA-I",), 3) == receptors
    assert solid.sites(("FA-I", "reference_nodes"), 3) == (*receptors, *fs.reference_sites(solid))


COARSE = fs.MeshSizes(contact_size=0.15e-3, bulk_size=0.9e-3)
EVERYTHING = frozenset(RECEPTOR_KINDS)


def with_smaller(finger, path):
    """Return a finger with another value at a path: a smaller number, the other truth value."""
    values = as_mapping(finger)
    *groups, last = path.split(".")
    inner = functools.reduce(lambda group, name: group[name], groups, values)
    value = inner[last]
    if isinstance(value, str):
        number, _, unit = value.partition(" ")
        inner[last] = f"{0.97 * float(number)!r} {unit}"
    else:
        inner[last] = not value if isinstance(value, bool) else 0.97 * value
    return from_mapping(fs.Fingertip, values)


SECTIONS = {
    "as it ships": {},
    "across": {"section": "transverse"},
    "scaled": {"phalanx": {"variant": "scaled"}},
    "flattened": {"phalanx": {"variant": "flattened"}},
    "smooth": {"ridges": {"enabled": False}, "fingerprint": {"enabled": False}},
    "printed": {"ridges": {"enabled": False}, "fingerprint": {"enabled": True}},
}
GROUPS = {"no sites": frozenset(), "SA-I": frozenset({"SA-I"}), "all": EVERYTHING}
# All sections and all choices of sites are in the fast cases.
FAST = {
    *(("as it ships", "no sites"), ("across", "SA-I"), ("scaled", "all"), ("flattened", "SA-I")),
    *(("smooth", "no sites"), ("printed", "all")),
}

CASES = [
    pytest.param(changes, groups, id=f"{name}-{sites}", marks=[pytest.mark.slow] * ((name, sites) not in FAST))
    for name, changes in SECTIONS.items()
    for sites, groups in GROUPS.items()
]


@pytest.mark.parametrize(("changes", "groups"), CASES)
def test_a_section_stays_the_same_when_all_unused_values_change(changes, groups):
    finger, use = change(**changes), ModelUse(dim=2, groups=groups)
    leaves = [leaf.path for leaf in walk_values(finger)]
    others, paths, tried = finger, [path for path in leaves if finger.unused_reason(path, use)], 0
    assert "section" not in paths
    for path in paths:
        try:
            others = with_smaller(others, path)
        except fs.InputError:
            continue
        tried += 1
    assert tried > 5
    assert others != finger
    before, after = COARSE.build(finger), COARSE.build(others)
    np.testing.assert_array_equal(before.p, after.p)
    np.testing.assert_array_equal(before.t, after.t)
    assert finger.sites(sorted(groups), 2) == others.sites(sorted(groups), 2)
    assert finger.supports(2) == others.supports(2)


@pytest.mark.parametrize(
    ("finger", "use", "path", "reason"),
    [
        (change(), ModelUse(2), "solid.length", "of the fingertip in 3D only"),
        (change(), ModelUse(2), "transverse.half_width", "of the transverse section only"),
        (change(), ModelUse(2), "receptors.fa_ii_depth", "no FA-II receptors are recorded"),
        (change(), ModelUse(2, groups=EVERYTHING), "receptors.fa_ii_depth", ""),
        (change(), ModelUse(2, groups=frozenset({"SA-I"})), "receptors.fa_ii_depth", "no FA-II receptors are recorded"),
        (change(), ModelUse(2, held=False), "phalanx.rigid", "the study gives its own supports"),
        (change(), ModelUse(2, meshed=False), "layers.skin_thickness", "the mesh comes from a file"),
        (change(), ModelUse(2), "layers.skin_thickness", ""),
        (change(), ModelUse(2), "phalanx.tissue_thickness", "of the scaled phalanx only"),
        (change(ridges={"enabled": False}), ModelUse(2), "ridges.pitch", "switched off"),
        (change(ridges={"enabled": False}), ModelUse(2, groups=EVERYTHING), "ridges.pitch", ""),
        (change_solid(), ModelUse(3), "depth", "of 2D sections only"),
        (change_solid(), ModelUse(3), "transverse.half_width", ""),
        (change_solid(), ModelUse(3), "ridges.pitch", "of 2D sections and receptors only"),
    ],
)
def test_the_reason_says_what_the_model_lacks(finger, use, path, reason):
    assert finger.unused_reason(path, use) == reason


NAME = "wang2014-2d"


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
