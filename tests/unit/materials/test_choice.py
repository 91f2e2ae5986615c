"""Which law the values of a study file mean, and what remains of a preset's values under another law."""

from __future__ import annotations

import dataclasses
import re

import pytest

from fingerslip.errors import InputError
from fingerslip.materials.choice import LAWS, MaterialChoice, kept_values
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.materials.ogden import Ogden, OgdenTerm
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


def test_law_is_elastic_unless_named():
    assert read(**HOOKE) == Elastic(34e3, 0.48, 1000.0)
    assert read(law="elastic", **HOOKE) == Elastic(34e3, 0.48, 1000.0)
    assert read(law="neo_hookean", **HOOKE) == NeoHookean(34e3, 0.48, 1000.0)


def test_materials_are_written_as_they_are_read():
    ogden = Ogden((OgdenTerm(2e3, 3.0),), 1000.0, bulk_modulus=1e6)
    for material in (Elastic(34e3, 0.48, 1000.0), NeoHookean(34e3, 0.48, 1000.0), ogden):
        assert read(**as_mapping(material)) == material


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
    with pytest.raises(InputError) as caught:
        read(**values)
    assert message in str(caught.value)


def test_objects_are_taken_as_they_are_and_others_refused():
    law = NeoHookean(34e3, 0.48, 1000.0)
    assert Body({"skin": law}).layers["skin"] is law
    with pytest.raises(InputError, match=r"layers\.skin"):
        Body({"skin": 3.0})


def test_schema_has_every_law():
    schema = json_schema(Body)
    assert {law.__name__ for law in LAWS} <= set(schema["$defs"])


def test_another_law_keeps_what_it_needs():
    assert kept_values(HOOKE, {"youngs_modulus": "3 kPa"}) == HOOKE
    assert kept_values(HOOKE, {"law": "neo_hookean"}) == HOOKE
    assert kept_values(HOOKE, {"law": "mooney_rivlin"}) == {"density": "1000 kg/m^3"}
    # What is no name is told by whoever reads the values.
    assert kept_values(HOOKE, {"law": {}}) == HOOKE
    assert kept_values({"law": "ogden", "terms": [], "density": "1 kg/m^3"}, {"law": "elastic"}) == {
        "density": "1 kg/m^3"
    }
    assert kept_values(HOOKE, {"law": "nonsense"}) == HOOKE
