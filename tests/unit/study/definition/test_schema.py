"""What an editor says of study files."""

import copy
import json

import pytest
from jsonschema import Draft202012Validator

from fingerslip.contact.counterfaces import BuiltInCounterface
from fingerslip.contact.friction import BuiltInLaw
from fingerslip.materials.choice import LAWS
from fingerslip.parameters import kinds_of
from fingerslip.study.definition.file import read_mapping
from fingerslip.study.definition.schema import study_schema
from fingerslip.study.definition.spec import Study
from places import ROOT
from unit.study.block import block_values, changed

STUDIES = sorted((ROOT / "studies").glob("*.yaml"))


@pytest.fixture(scope="module")
def schema():
    return study_schema()


def mistakes(schema, values):
    """Return the dotted paths that an editor marks in a study."""
    found = Draft202012Validator(schema).iter_errors(values)
    return sorted(".".join(map(str, error.absolute_path)) for error in found)


def test_schema_knows_the_keys_of_a_study_and_is_one(schema):
    assert json.loads(json.dumps(schema)) == schema
    assert set(schema["properties"]) == {"base", *Study.__dataclass_fields__}
    assert "required" not in schema["$defs"]["Phalanx"]
    assert schema["$defs"]["Press"]["properties"]["depth"]["examples"] == ["1.5 mm"]
    Draft202012Validator.check_schema(schema)


def test_every_key_is_described(schema):
    parts = {"Study": schema} | schema["$defs"]
    silent = [
        f"{part}.{name}"
        for part, definition in parts.items()
        for name, own in definition.get("properties", {}).items()
        if not own.get("description")
    ]
    assert silent == []


def test_definitions_have_their_laws_choices_defaults_and_sources(schema):
    definitions = schema["$defs"]
    assert [definitions[law.__name__]["required"] for law in LAWS] == [[], ["law"], ["law"], ["law"]]
    assert definitions["NeoHookean"]["properties"]["law"]["const"] == "neo_hookean"
    words = definitions["Layers"]["properties"]["skin_thickness"]["description"]
    assert "[m]" in words
    assert "wang2014-2d: 1.5 mm (wang2014)." in words
    assert definitions["BodyLoad"]["properties"]["x"]["default"] == "0.0 N"
    laws = {"coulomb", "static_kinetic", "pressure_dependent", "anisotropic"}
    assert laws <= set(definitions["FrictionChoice"]["properties"]) == set(kinds_of(BuiltInLaw))
    shapes = {"plane", "cylinder", "sphere"}
    assert shapes <= set(definitions["CounterfaceChoice"]["properties"]) == set(kinds_of(BuiltInCounterface))
    assert definitions["TimeSettings"]["properties"]["scheme"]["enum"] == ["hht_alpha", "quasi_static"]
    assert definitions["StaticKinetic"]["properties"]["decay_speed"]["examples"] == ["1.5 mm/s"]
    assert "Ramp" in definitions


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_an_editor_accepts_shipped_studies_and_finds_the_schema(path, schema):
    assert path.read_text(encoding="utf-8").startswith("# yaml-language-server: $schema=study.schema.json\n")
    assert mistakes(schema, read_mapping(path)) == []


def test_schema_that_ships_is_that_of_the_program(schema):
    shipped = json.loads((ROOT / "studies" / "study.schema.json").read_text(encoding="utf-8"))
    assert shipped == schema, "make it again: fingerslip schema > studies/study.schema.json"


@pytest.mark.parametrize(
    ("path", "value", "marked"),
    [
        ("depth", 1, "depth"),
        ("depth", "1", "depth"),
        ("depth", "1e-3", "depth"),
        ("depth", "wide", "depth"),
        ("contact.friction_coefficient", "much", "contact"),
        ("formulation", "plane", "formulation"),
        ("titel", "Block", ""),
    ],
)
def test_an_editor_marks_mistakes(schema, path, value, marked):
    assert mistakes(schema, block_values()) == []
    assert mistakes(schema, changed(path, value)) == [marked]


@pytest.mark.parametrize("text", ["1.5 mm", "-2e-3 m", ".5 mm", "3mm", "1 m/s"])
def test_quantities_pass(schema, text):
    values = copy.deepcopy(block_values()) | {"depth": text}
    assert mistakes(schema, values) == []
