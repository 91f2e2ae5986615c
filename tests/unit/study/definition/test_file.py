"""Study files as plain data, and what an editor says of them; derived quantities."""

import json
import os
import re
import sys

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from fingerslip.errors import InputError, InputErrors
from fingerslip.results import Quantity, RunResult
from fingerslip.slip.events import Events, SlipEvents
from fingerslip.study.definition.expressions import check_expression, check_names, derive
from fingerslip.study.definition.file import REPEATS, line_numbers, read_mapping, read_with_base, write_mapping
from fingerslip.study.definition.runs import read_runs
from fingerslip.study.definition.schema import study_schema
from fingerslip.study.definition.spec import Study, read_study
from places import ROOT
from unit.study.block import block_values, changed


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"a: 1\nb: [1\n", r"line \d, column \d: found expected .*, needs 'key: value' lines"),
        (b"a: 1\na: 2\n", "line 2, column 1: found key 'a' twice, needs 'key: value' lines, each key once"),
        (b"t: {a: 1, a: 2}\n", "line 1, column 11: found key 'a' twice"),
        (b"? [a]\n: 1\n", "found a key that is not plain text"),
        (b"- 1\n- 2\n", "holds a list, needs 'key: value' lines"),
        (b"", "is empty, needs 'key: value' lines"),
        (b"a: !!python/object/apply:os.getcwd []\n", "line 1, column 4: found the tag !!python/object/apply:os.getcwd"),
        (b"\xff\xfe\x00", "is not text in UTF-8, needs a study file; save it as UTF-8"),
    ],
)
def test_what_is_no_study(tmp_path, content, message):
    (tmp_path / "x.yaml").write_bytes(content)
    with pytest.raises(InputError, match=message):
        read_mapping(tmp_path / "x.yaml")


def test_what_cannot_be_read_and_a_name_that_is_not_utf_8_are_refused(tmp_path):
    (tmp_path / "x.yaml").write_text("time: {step: 1 ms}")
    names = {
        "": "is a folder",
        f"{'x' * 300}.yaml": "cannot be read",
        "gone.yaml": r"gone\.yaml: is not there, needs a study file; in that folder: .*x\.yaml",
    }
    for name, kind in (("pad.inp", "a deck of Abaqus"), ("pad.feb", "a file of FEBio"), ("pad.vtu", "a mesh")):
        (tmp_path / name).write_text("*Heading")
        names[name] = f"is {kind}, needs a study file; fingerslip new pad.yaml --template own-mesh"
    if sys.platform == "linux":  # elsewhere names are Unicode
        bad = os.fsdecode(b"a\xff.yaml")
        (tmp_path / bad).write_text("time: {step: 1 ms}")
        names[bad] = r"'a\\udcff.yaml': is a name that is not UTF-8, needs a study file; rename the file"
    for name, message in names.items():
        with pytest.raises(InputError, match=message):
            read_mapping(tmp_path / name)


def test_files_with_the_most_similar_names_come_first(tmp_path):
    for name in ("a.yaml", "b.yaml", "c.yaml", "d.yaml", "e.yaml", "f.yaml", "slide.yaml"):
        (tmp_path / name).write_text("time: {step: 1 ms}")
    with pytest.raises(InputError, match=r"is not there, .*; it ships: fingerslip examples wang2014_table2 copies it"):
        read_study(tmp_path / "studies" / "wang2014_table2.yaml")
    with pytest.raises(InputError) as caught:
        read_mapping(tmp_path / "study.schema.json")
    assert "it ships" not in str(caught.value), "it is no study"
    with pytest.raises(InputError, match=r"slied\.yaml: is not there, .*; in that folder: [^,]*slide\.yaml"):
        read_mapping(tmp_path / "slied.yaml")


plain = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-1000, 1000)
    | st.floats(allow_nan=False)
    | st.sampled_from(["no", "1.5 mm", "a b", "a\n\n b: 1\nc", "- a", "# b" + 60 * " word"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from("abc"), inner, max_size=3),
    max_leaves=8,
)


@given(values=st.dictionaries(st.sampled_from(["x", "y", "on"]), plain, min_size=1))
def test_what_is_written_reads_back_also_by_entries(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("yaml") / "x.yaml"
    for comment in ("a comment", REPEATS):
        write_mapping(values, path, comment=comment)
        assert read_mapping(path) == values


@pytest.mark.parametrize("text", ["a: &a 1\nb: *a\n", "{a: 1,\nb: 1}\n", "a: 1\n---\nb: 1\n", "a: 1\na: 1\n"])
def test_a_file_of_a_run_that_was_changed_is_read_as_a_whole(tmp_path, text):
    read = []
    for front in ("", f"# {REPEATS}\n"):
        (tmp_path / "run.yaml").write_text(front + text, encoding="utf-8")
        try:
            read.append(read_mapping(tmp_path / "run.yaml"))
        except InputError as error:
            read.append(re.sub(r"line \d", "line", str(error)))
    assert read[0] == read[1]


def test_keys_are_text_in_their_order_and_anchors_are_followed(tmp_path):
    write_mapping({"z": 1, "a": {"é": "1 µm"}}, tmp_path / "x.yaml", comment="how it was made")
    assert (tmp_path / "x.yaml").read_text(encoding="utf-8") == "# how it was made\nz: 1\na:\n  é: 1 µm\n"
    (tmp_path / "x.yaml").write_text("1: a\ntrue: b\n")
    assert read_mapping(tmp_path / "x.yaml") == {"1": "a", "true": "b"}
    # YAML 1.2 knows no merge keys: '<<' is a key like any other, which a study then does not know.
    (tmp_path / "x.yaml").write_text("a: &a {x: 1}\nb: *a\nc: {<<: *a}\n")
    assert read_mapping(tmp_path / "x.yaml") == {"a": {"x": 1}, "b": {"x": 1}, "c": {"<<": {"x": 1}}}


def test_mistakes_get_the_line_of_their_value_and_those_of_something_else_stay_as_they_are(tmp_path):
    path = tmp_path / "x.yaml"
    path.write_text("# a study\ntime:\n  step: 1\ndepth: x\nsweep:\n  time.step: [1, 2]\n")
    places = ("depth", "time.step", "time.end", "mesh")
    mistakes = [InputError(f"{path}: {place}", "is wrong", "needs another") for place in places]
    with pytest.raises(InputErrors) as caught, line_numbers(path):
        raise InputErrors(mistakes)
    lines = [(error.where.removeprefix(f"{path}: "), error.line) for error in caught.value.all]
    assert lines == [("time.step", 3), ("time.end", 2), ("depth", 4), ("mesh", None)]
    with pytest.raises(InputError, match=r"\(line 6\)"), line_numbers(path, "a run"):
        raise InputError("a run: time.step", "is wrong", "needs another")
    error = InputError("preset x", "is wrong", "needs another")
    for path in (tmp_path / "gone.yaml", tmp_path / "x.yaml"):
        (tmp_path / "x.yaml").write_text("a: 1\n")
        with pytest.raises(InputError) as caught, line_numbers(path):
            raise error
        assert (caught.value.line, str(caught.value)) == (None, str(error))


def write(folder, name, values):
    path = folder / name
    path.write_text(yaml.safe_dump(values, sort_keys=False), encoding="utf-8")
    return path


def test_what_is_not_written_comes_from_the_base_but_sweeps_and_lists_are_replaced(tmp_path):
    write(tmp_path, "block.yaml", block_values())
    changes = {"title": "Faster", "contact": {"friction_coefficient": 0.3}, "time": {"step": "1 ms"}}
    path = write(tmp_path, "fast.yaml", {"base": "block.yaml"} | changes)
    study = read_study(path)
    assert (study.title, study.time.step) == ("Faster", 1e-3)
    assert (study.all_contacts[0].boundary, study.all_contacts[0].friction_coefficient) == ("bottom", 0.3)
    assert study.programme == read_study(tmp_path / "block.yaml").programme
    assert "formulation" in read_runs(path).given
    press = [{"press": {"depth": "0.2 mm", "speed": "5 mm/s"}}]
    path = write(tmp_path, "own.yaml", {"base": "block.yaml", "sweep": {"time.step": ["1 ms"]}, "programme": press})
    assert read_with_base(path)["sweep"] == {"time.step": ["1 ms"]}
    assert read_with_base(path)["programme"] == press
    write(tmp_path, "a.yaml", {"x": 1, "group": {"one": 1, "two": 2}})
    write(tmp_path, "b.yaml", {"base": "a.yaml", "group": {"two": 3}})
    path = write(tmp_path, "c.yaml", {"base": "b.yaml", "y": 2})
    assert read_with_base(path) == {"x": 1, "group": {"one": 1, "two": 3}, "y": 2}, "a base may have a base"


@pytest.mark.parametrize(
    ("base", "message"),
    [
        ("", r"own\.yaml: base: got '', needs the name of a study file in the same"),
        ("nothing.yaml", r"nothing\.yaml: is not there, needs a study file"),
        ("../other/block.yaml", r"own\.yaml: base: got '\.\./other/block\.yaml', needs the name of a study file in"),
        (3, r"own\.yaml: base: got 3, needs the name"),
        ("own.yaml", r"own\.yaml: base: leads back to own\.yaml \(own\.yaml -> own\.yaml\)"),
    ],
)
def test_a_base_that_is_none_is_refused(tmp_path, base, message):
    with pytest.raises(InputError, match=message):
        read_study(write(tmp_path, "own.yaml", {"base": base}))


def test_a_constant_that_the_law_of_the_base_does_not_have_is_told_where_the_law_comes_from(tmp_path):
    values = block_values()
    (name,) = values["materials"]
    terms = [{"modulus": "20 kPa", "exponent": 2}]
    ogden = {"law": "ogden", "terms": terms, "bulk_modulus": "1 MPa", "density": "1000 kg/m^3"}
    write(tmp_path, "pad.yaml", values | {"materials": {name: ogden}})
    path = write(tmp_path, "own.yaml", {"base": "pad.yaml", "materials": {name: {"youngs_modulus": "100 kPa"}}})
    message = rf"{name}.youngs_modulus: is not known, .*; law: ogden comes from its base pad.yaml: write .* \(line 4\)"
    for read in (read_study, read_runs):
        with pytest.raises(InputError, match=message):
            read(path)


@pytest.mark.slow
def test_a_long_ring_of_bases_is_one_line(tmp_path):
    for number in range(1200):
        (tmp_path / f"{number}.yaml").write_text(f"title: x\nbase: {(number + 1) % 1200}.yaml\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"1199.yaml: base: leads back to 0.yaml") as caught:
        read_with_base(tmp_path / "0.yaml")
    assert len(str(caught.value)) < 500


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
        *(("depth", value, ["depth"]) for value in (1, "1", "1e-3", "2 1", "wide")),
        *(("depth", value, []) for value in ("1.5 mm", "-2e-3 m", ".5 mm", "3mm", "1 m/s", "25 1/s")),
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
        *((text, None) for text in ("a = 1", "'3 apples'", "max(a, key=b)", "1 +", "2j")),
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
        *((text, "known exponent") for text in ("'2 mm' ** (three_quarter_slip / '1 s')", "'2 mm' ** 21")),
        *((text, "is not known") for text in ("max", "breadth + é", "True")),
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
