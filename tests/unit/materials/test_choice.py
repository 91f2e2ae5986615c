"""Which material a file means, and those that ship."""

import dataclasses
import re
from importlib import resources

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.materials.choice import LAWS, MATERIALS, MaterialChoice, kept_values
from fingerslip.materials.large_strain import FiniteMaterial
from fingerslip.materials.material import Material
from fingerslip.parameters import as_mapping, from_mapping, parameters
from fingerslip.parameters.schema import json_schema

HOOKE = {"youngs_modulus": "34 kPa", "poisson_ratio": 0.48, "density": "1000 kg/m^3"}


@parameters
class Body:
    """Something with layers."""

    layers: dict[str, MaterialChoice]


def read(**values):
    return from_mapping(Body, {"layers": {"skin": values}}, "x.yaml").layers["skin"]


@pytest.mark.parametrize("law", LAWS)
def test_laws_are_named_by_their_class_in_snake_case(law):
    name = next(field.default for field in dataclasses.fields(law) if field.name == "law")
    assert name == re.sub(r"(?<!^)(?=[A-Z])", "_", law.__name__).lower()


def test_laws_are_elastic_unless_named_and_ranges_are_shown_with_the_notes():
    assert read(**HOOKE) == fs.Elastic(34e3, 0.48, 1000.0)
    assert read(law="elastic", **HOOKE) == fs.Elastic(34e3, 0.48, 1000.0)
    assert read(law="neo_hookean", **HOOKE) == fs.NeoHookean(34e3, 0.48, 1000.0)
    rows = {row.path: row for row in MATERIALS.table("sylgard-184")}
    assert rows["youngs_modulus"].note.endswith("range 1.32 to 2.97 MPa, cured at 25 to 200 degrees Celsius")
    with pytest.raises(fs.InputError, match=r"'ecoflex' is not known, needs one of agilus30, .*mean 'ecoflex-00-30'"):
        fs.material("ecoflex")


def test_materials_are_written_as_they_are_read_objects_taken_as_they_are_and_others_refused():
    ogden = fs.Ogden((fs.OgdenTerm(2e3, 3.0),), 1000.0, bulk_modulus=1e6)
    for law in (fs.Elastic(34e3, 0.48, 1000.0), fs.NeoHookean(34e3, 0.48, 1000.0), ogden):
        assert read(**as_mapping(law)) == law
        assert Body({"skin": law}).layers["skin"] is law
    with pytest.raises(fs.InputError, match=r"layers\.skin"):
        Body({"skin": 3.0})
    assert {law.__name__ for law in LAWS} <= set(json_schema(Body)["$defs"])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"law": "neo_hooke", **HOOKE}, "layers.skin.law: 'neo_hooke' is not known, needs one of elastic, neo_hookean"),
        ({"law": "ogden", **HOOKE}, "layers.skin.youngs_modulus: is not known, may be one of terms,"),
        ({"law": "ogden", "terms": [{"modulus": "3", "exponent": 2}]}, "layers.skin.terms.0.modulus: '3' has no unit"),
        ({**HOOKE, "poisson_ratio": 0.6}, "layers.skin.poisson_ratio: got 0.6, needs a number <= 0.5"),
        (
            {"law": "mooney_rivlin", "c10": "1 kPa", "c01": "-2 kPa", "density": "1 kg/m^3"},
            "layers.skin.c10: got c10 + c01 = -1000 Pa",
        ),
    ],
)
def test_mistakes_are_at_their_place(values, message):
    with pytest.raises(fs.InputError) as caught:
        read(**values)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("values", "changes", "kept"),
    [
        (HOOKE, {"youngs_modulus": "3 kPa"}, HOOKE),
        (HOOKE, {"law": "neo_hookean"}, HOOKE),
        (HOOKE, {"law": "mooney_rivlin"}, {"density": "1000 kg/m^3"}),
        ({"law": "ogden", "terms": [], "density": "1 kg/m^3"}, {"law": "elastic"}, {"density": "1 kg/m^3"}),
        # What is no name is told by whoever reads the values.
        (HOOKE, {"law": {}}, HOOKE),
        (HOOKE, {"law": "nonsense"}, HOOKE),
    ],
)
def test_another_law_keeps_what_it_needs(values, changes, kept):
    assert kept_values(values, changes) == kept


@pytest.mark.parametrize("name", fs.material_names())
def test_every_material_is_a_law_says_what_it_claims_and_names_sources_the_assumed_ones_first(name):
    assert isinstance(fs.material(name), Material | FiniteMaterial)
    assert all(MATERIALS.header(name)[key] for key in ("citation", "published", "claims_not"))
    references = resources.files("fingerslip").joinpath("references.bib").read_text()
    sources = [row.source for row in MATERIALS.table(name)]
    assert all(source == "assumed" or f"{{{source}," in references for source in sources)
    assert sources == sorted(sources, key=lambda source: source != "assumed")


@pytest.mark.parametrize(
    ("name", "stresses"),
    [("ecoflex-00-30", (8.56e3, 16.89e3, 22.88e3, 29.72e3)), ("dragon-skin-30", (110.9e3, 213.9e3, 322.1e3, 437.1e3))],
)
def test_silicones_follow_the_test_they_were_fitted_to(name, stresses):
    """Nominal stress of the uniaxial test at strains 0.25 to 1; the notes state 4.7 and 0.4 % as largest errors."""
    law, stretch = fs.material(name), 1.0 + np.array([0.25, 0.5, 0.75, 1.0])
    log_strain = np.log(stretch)[:, None] * np.array([1.0, -0.5, -0.5])
    stress = law.kirchhoff_stress(log_strain)
    nominal = (stress[:, 0] - stress[:, 1]) / stretch
    np.testing.assert_allclose(nominal, stresses, rtol=0.048 if name == "ecoflex-00-30" else 0.005)


def test_tissue_is_that_of_the_fingertip_preset_and_pulp_that_relaxes_ends_near_pulp():
    finger, pulp, relaxing = fs.preset("wang2014-2d").materials, fs.material("pulp"), fs.material("pulp-relaxing")
    assert pulp.at_rest() == finger["tissue"]
    assert fs.material("skin").at_rest() == finger["epidermis"]
    assert [term.time for term in relaxing.prony] == [4e-3, 70e-3, 1.4]
    assert (1.0 - 0.6) * relaxing.shear_modulus == pytest.approx(pulp.shear_modulus)
