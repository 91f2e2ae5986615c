"""What an editor says of study files, and derived quantities."""

import json

import pytest
from jsonschema import Draft202012Validator

from fingerslip.contact.counterfaces import BuiltInCounterface
from fingerslip.contact.friction import BuiltInLaw
from fingerslip.errors import InputError
from fingerslip.materials.choice import LAWS
from fingerslip.parameters import kinds_of
from fingerslip.results import Quantity, RunResult
from fingerslip.slip.events import Events, SlipEvents
from fingerslip.study.definition.expressions import check_expression, check_names, derive
from fingerslip.study.definition.file import read_mapping
from fingerslip.study.definition.schema import study_schema
from fingerslip.study.definition.spec import Study, read_study
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


def test_schema_that_ships_is_that_of_the_program_and_knows_the_keys_of_a_study(schema):
    shipped = json.loads((ROOT / "studies" / "study.schema.json").read_text(encoding="utf-8"))
    assert shipped == schema, "make it again: fingerslip schema > studies/study.schema.json"
    assert json.loads(json.dumps(schema)) == schema
    assert set(schema["properties"]) == {"base", *Study.__dataclass_fields__}
    assert "required" not in schema["$defs"]["Phalanx"]
    assert schema["$defs"]["Press"]["properties"]["depth"]["examples"] == ["1.5 mm"]
    Draft202012Validator.check_schema(schema)


@pytest.mark.parametrize(
    ("path", "value", "marked"),
    [
        *(("depth", value, ["depth"]) for value in (1, "1", "1e-3", "wide")),
        *(("depth", value, []) for value in ("1.5 mm", "-2e-3 m", ".5 mm", "3mm", "1 m/s")),
        ("contact.friction_coefficient", "much", ["contact"]),
        ("formulation", "plane", ["formulation"]),
        ("titel", "Block", [""]),
    ],
)
def test_an_editor_marks_mistakes_and_lets_quantities_pass(schema, path, value, marked):
    assert mistakes(schema, changed(path, value)) == marked


RUN = RunResult(
    "run",
    {"contact.friction_coefficient": 0.5},
    Events(slip=SlipEvents(incipient=1.2, overall=1.7)),
    numbers={"contact_area_max_m2": 1e-4},
    values={"programme.0.press.speed": "1.5 mm/s", "programme.1.slide.speed": "3 mm/s", "title": "x"},
)


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("overall_slip * slide_speed", 5.1e-3, "m"),
        ("latency * programme.1.slide.speed / '1 mm'", 1.5, ""),
        ("sqrt(contact_area_max) * friction_coefficient", 5e-3, "m"),
        ("overall_slip - '0.7 s'", 1.0, "s"),
        ("max(slide_speed, press.speed)**2 / contact_area_max", 0.09, "1/s^2"),
        ("log(friction_coefficient) + 2e0", 1.3068528, ""),
        ("-(1 + 1)", -2.0, ""),
        *(("log(1e300)", 690.7755, ""), ("exp(30)", 1.068647e13, ""), ("2 ** 30", 2.0**30, "")),
        # what has no value has a unit all the same
        ("three_quarter_slip * slide_speed", None, "m"),
        ("1 / (latency - latency)", None, "1/s"),
        ("sqrt(overall_slip - '1.8 s')", None, "s^0.5"),
        *(("log(latency / '1 s' - 1)", None, ""), ("1 / 0", None, "")),
    ],
)
def test_an_expression_has_a_unit_and_where_it_exists_a_value(text, value, unit):
    assert derive("x", check_expression(text), RUN) == Quantity("x", unit, value and pytest.approx(value))
    # Without the events a root of (overall_slip - 1.5 s) is as possible as with them.
    assert derive("x", "sqrt(overall_slip - '1.5 s')", RunResult("run", {}, Events())) == Quantity("x", "s^0.5", None)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        *((text, None) for text in ("__import__('os')", "().__class__", "[1][0]", "lambda: 1", "1 if 2 else 3")),
        *((text, None) for text in ("a = 1", "'3 apples'", "max(a, key=b)", "1 +")),
        ("-" * 2000 + "1", "needs 500 or fewer"),
        ("min(latency)", "needs two values or more"),
        ("sqrt()", "needs one value"),
        ("1e999", "too large"),
    ],
)
def test_what_is_no_expression_is_refused(text, said):
    with pytest.raises(InputError, match=said):
        check_expression(text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("speed * 2", "'speed' stands for programme.0.press.speed, programme.1.slide.speed"),
        ("nothing", "'nothing' is not known"),
        ("overall_slip + slide_speed", "needs units that fit together"),
        ("2 ** latency", "a number in s stands where a pure one is needed"),
        ("'2 mm' ** (three_quarter_slip / '1 s')", "known exponent"),
        *(("max", "is not known"), ("breadth + é", "is not known")),
    ],
)
def test_wrong_names_and_units_are_refused(text, said):
    with pytest.raises(InputError, match=r"derived\.x") as caught:
        derive("x", check_expression(text), RUN)
    assert said in str(caught.value)


TAKEN = ["overall_slip", "overall", "latency_displacement", "normal_force_max", "sample"]


@pytest.mark.parametrize("name", [*TAKEN, "a, b", "2nd", "", "_x", "é"])
def test_names_are_those_of_columns_and_of_nothing_else_in_study_files_too(name, write_study):
    said = "a name of its own" if name in TAKEN else "is no name of a column"
    with pytest.raises(InputError, match=f"{name}.*{said}"):
        check_names({name: "latency"})
    if name == "overall":
        with pytest.raises(InputError, match=r"derived\.overall: "):
            read_study(write_study(block_values() | {"derived": {name: "latency"}}))
