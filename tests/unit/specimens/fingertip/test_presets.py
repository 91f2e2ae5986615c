"""Presets: published values, a source for each, and changes to them."""

from __future__ import annotations

import pytest

from fingerslip.errors import InputError
from fingerslip.parameters import as_mapping, from_mapping, walk_values
from fingerslip.specimens.fingertip import fingertip_from, preset, preset_header, preset_names, preset_table

NAME = "wang2014-2d"


def test_preset_holds_the_published_materials():
    materials = preset(NAME).materials
    assert {name: m.youngs_modulus for name, m in materials.items()} == {
        "epidermis": 136e3,
        "dermis": 80e3,
        "tissue": 34e3,
        "phalanx": 1.5e9,
    }
    assert [materials[name].poisson_ratio for name in ("tissue", "phalanx")] == [0.48, 0.30]
    assert [materials[name].density for name in ("tissue", "phalanx")] == [1000.0, 449.0]


def test_preset_holds_the_published_skin():
    fingertip = preset(NAME)
    assert fingertip.layers.skin_thickness == 1.5e-3
    assert fingertip.receptors.fa_ii_depth == 3e-3
    assert (fingertip.section, fingertip.formulation) == ("sagittal", "plane_stress")


@pytest.mark.parametrize("name", [NAME, "wang2014-3d"])
def test_every_value_of_the_preset_has_a_source(name):
    table = preset_table(name)
    # What a preset leaves out, such as the nail, has no source either.
    given = {leaf.path for leaf in walk_values(preset(name))}
    assert {row.path for row in table} == given
    assert {row.source for row in table} == {"assumed", "wang2014", "corniani2024"}
    assert all(row.note for row in table)


def test_assumed_values_come_first():
    assumed = [row.source == "assumed" for row in preset_table(NAME)]
    assert assumed == sorted(assumed, reverse=True)


def test_sources_are_in_the_references():
    from importlib import resources

    references = resources.files("fingerslip").joinpath("references.bib").read_text()
    sources = {row.source for row in preset_table(NAME)} - {"assumed"}
    assert all(f"{{{source}," in references for source in sources)


def test_header_says_what_the_set_does_not_claim():
    assert preset_names() == (NAME, "wang2014-3d")
    for name in preset_names():
        assert "no dimension" in preset_header(name)["claims_not"]


def test_study_overrides_merge_deeply():
    fingertip = fingertip_from(
        {"preset": NAME, "phalanx": {"variant": "flattened", "sagittal": {"distal_end": "3 mm"}}}, "x"
    )
    assert fingertip.phalanx.variant == "flattened"
    assert fingertip.phalanx.sagittal.distal_end == 3e-3
    assert fingertip.phalanx.sagittal.palmar_level == preset(NAME).phalanx.sagittal.palmar_level


def test_preset_without_overrides_is_the_preset():
    from fingerslip.specimens.fingertip import Fingertip

    fingertip = fingertip_from({"preset": NAME}, "x")
    assert fingertip == preset(NAME)
    assert from_mapping(Fingertip, as_mapping(fingertip), "x") == fingertip


@pytest.mark.parametrize(
    ("mapping", "message"),
    [
        ({"preset": "wang2014-2"}, "study.fingertip.preset: 'wang2014-2' is not known.*did you mean 'wang2014-2d'?"),
        ({}, "study.fingertip.preset: is missing, needs one of wang2014-2d"),
        (
            {"preset": NAME, "phalanx": {"variety": "flattened"}},
            "phalanx.variety: is not known.*did you mean 'variant'",
        ),
        ({"preset": NAME, "phalanx": {"variant": "flat"}}, "phalanx.variant: got 'flat'"),
        ({"preset": NAME, "layers": {"skin_thickness": 1.5}}, "skin_thickness: '1.5' has no unit.*write '1.5 mm'"),
        ({"preset": NAME, "ridges": True}, "ridges"),
    ],
)
def test_wrong_overrides_are_one_clear_error(mapping, message):
    with pytest.raises(InputError, match=message):
        fingertip_from(mapping, "study.fingertip")


def test_unknown_preset():
    with pytest.raises(InputError, match=r"did you mean 'wang2014-[23]d'"):
        preset("wang2014")
