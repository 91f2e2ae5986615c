"""The study file: every mistake gives one error that says where, what, what is allowed and how to repair it."""

from __future__ import annotations

import copy
import json
import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from fingerslip.errors import InputError
from fingerslip.mesh.file import MeshFile
from fingerslip.model import Press, Slide
from fingerslip.study.definition.spec import Study, parse_study, read_study, study_mapping, study_schema
from fingerslip.study.definition.sweep import expand
from places import ROOT
from unit.study.block import block_values

FINGER = """
title: Slip onset against friction
fingertip:
  preset: wang2014-2d
  phalanx: {variant: original}
mesh: {contact_size: 0.15 mm, bulk_size: 0.6 mm}
contact: {friction_coefficient: 0.6}
programme:
  - press: {depth: 1.5 mm, speed: 1.5 mm/s}
  - slide: {distance: 6 mm, speed: 3 mm/s}
time: {step: 5 ms, alpha: -0.05}
record: {receptors: [FA-I, SA-I], snapshots_every: 50 ms}
"""
SOURCE = Path("studies/x.yaml")
STUDIES = sorted((ROOT / "studies").glob("*.yaml"))


def finger() -> dict[str, Any]:
    values: dict[str, Any] = yaml.safe_load(FINGER)
    return values


def changed(path: str, value: object) -> dict[str, Any]:
    """Return the study with one value changed; None removes it."""
    values = finger()
    *groups, leaf = path.split(".")
    inner: Any = values
    for group in groups:
        inner = inner[int(group)] if isinstance(inner, list) else inner.setdefault(group, {})
    if value is None:
        del inner[leaf]
    else:
        inner[int(leaf) if isinstance(inner, list) else leaf] = value
    return values


def test_values_are_si() -> None:
    study = parse_study(finger(), SOURCE)
    assert study.time.step == 0.005
    assert study.record.snapshots_every == 0.05
    assert [entry.phase for entry in study.programme] == [Press(1.5e-3, 1.5e-3), Slide(6e-3, 3e-3)]


def test_written_study_reads_back_the_same() -> None:
    study = parse_study(finger(), SOURCE)
    assert parse_study(study_mapping(study), SOURCE) == study


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("contact.friction_coefficient", -0.2, "contact.friction_coefficient: got -0.2, needs a number >= 0"),
        ("contact.friction_coefficient", "much", "contact.friction_coefficient: got 'much', needs a number"),
        (
            "contact.friction_coefficient",
            None,
            "contact.friction_coefficient: is missing, needs a value; or give another law in friction",
        ),
        ("time.step", None, "time.step: is missing, needs a value"),
        ("time.step", "0 ms", "time.step: got '0 ms', needs a value > 0"),
        ("time.step", "-1 ms", "time.step: got '-1 ms', needs a value > 0"),
        ("time.alpha", 0.5, "time.alpha: got 0.5, needs a number <= 0"),
        (
            "mesh.contact_size",
            "0.05",
            "mesh.contact_size: '0.05' has no unit, needs a unit of [m]; write '0.05 mm' or '0.05 m'",
        ),
        (
            "mesh.contact_size",
            0.05,
            "mesh.contact_size: '0.05' has no unit, needs a unit of [m]; write '0.05 mm' or '0.05 m'",
        ),
        (
            "mesh.contact_size",
            "3 kg",
            "mesh.contact_size: got '3 kg', needs a unit of [m]; write for example '3 mm'",
        ),
        ("mesh.bulk_size", "0.1 mm", "mesh.bulk_size: got 0.1 mm, needs >= 0.15 mm (contact_size)"),
        ("mesh", {"file": "a.msh", "x": 1}, "mesh.x: is not known, may be one of file, length_unit"),
        ("mesh", "a.msh", "mesh: got 'a.msh', needs keys and values"),
        ("programme", "press", "programme: got 'press', needs a list"),
        ("programme.0", {"push": {}}, "programme.0.push: is not known, may be one of press, hold, slide, lift"),
        ("programme.0", {}, "programme.0: has no phase, needs one of press, hold, slide, lift"),
        (
            "programme.0.hold",
            {"duration": "1 s"},
            "programme.0: has press and hold, needs one of press, hold, slide, lift",
        ),
        (
            "programme.0.press.depth",
            1.5,
            "programme.0.press.depth: '1.5' has no unit, needs a unit of [m]; write '1.5 mm' or '1.5 m'",
        ),
        ("record.receptors", ["FA"], "record.receptors.0: got 'FA', needs 'FA-I', 'SA-I', 'FA-II' or 'SA-II'"),
        (
            "fingertip.preset",
            "wang2014",
            (
                "fingertip.preset: 'wang2014' is not known, needs one of wang2014-2d, wang2014-3d; "
                "did you mean 'wang2014-3d'?"
            ),
        ),
        (
            "fingertip.phalanx.variant",
            "flat",
            "fingertip.phalanx.variant: got 'flat', needs 'original', 'flattened' or 'scaled'",
        ),
        (
            "fingertip",
            None,
            "fingertip: is missing, needs a preset, or mesh.file for a body that is no fingertip",
        ),
        ("sweep", {"time.step": []}, "sweep.time.step: has no values, needs a list such as [0.2, 0.4]"),
        ("sweep", {"time.step": ["1 ms", "1 ms"]}, "sweep.time.step: has '1 ms' twice, needs every value once"),
        ("sweep", {"time.step": "1 ms"}, "sweep.time.step: got '1 ms', needs a list"),
        (
            "sweep",
            {"time": [{}], "time.step": ["1 ms"]},
            "sweep.time.step: is a part of the swept 'time', needs paths apart from each other",
        ),
        ("title", 3, "title: got 3, needs text"),
    ],
)
def test_mistake_is_named_with_its_mend(path: str, value: object, message: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_study(changed(path, value), SOURCE)
    assert str(caught.value) == f"studies/x.yaml: {message}"


@pytest.mark.parametrize(
    ("path", "nearest"),
    [
        ("tme", "time"),
        ("contact.frction", "friction"),
        ("contact.friction_coeficient", "friction_coefficient"),
        ("fingertip.phalanx.varant", "variant"),
        ("programme.0.press.dept", "depth"),
    ],
)
def test_unknown_key_is_refused_with_the_nearest(path: str, nearest: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_study(changed(path, 1), SOURCE)
    assert caught.value.where == f"studies/x.yaml: {path}"
    assert caught.value.repair == f"did you mean '{nearest}'?"


@pytest.mark.parametrize("name", ["materials", "formulation", "depth"])
def test_body_that_is_no_fingertip_says_everything_itself(name: str) -> None:
    values = block_values()
    del values[name]
    with pytest.raises(InputError, match=rf"x\.yaml: {name}: is missing, needs a value where there is no fingertip"):
        parse_study(values, SOURCE)


def test_receptors_need_a_fingertip() -> None:
    with pytest.raises(InputError, match="name points in record"):
        parse_study(block_values() | {"record": {"receptors": ["FA-I"]}}, SOURCE)


def test_mesh_file_is_relative_to_the_study(tmp_path: Path) -> None:
    (tmp_path / "x.yaml").write_text(yaml.safe_dump(block_values()))
    mesh = read_study(tmp_path / "x.yaml").mesh
    assert mesh == MeshFile(str(tmp_path.resolve() / "block.msh"))


def test_schema_knows_the_keys_of_a_study() -> None:
    schema = study_schema()
    assert json.loads(json.dumps(schema)) == schema
    assert schema["required"] == ["time"]
    assert set(schema["properties"]) == set(Study.__dataclass_fields__)
    assert "required" not in schema["$defs"]["Phalanx"]
    assert schema["$defs"]["Press"]["properties"]["depth"]["examples"] == ["1.5 mm"]


def test_reading_changes_nothing_in_its_argument() -> None:
    values = finger()
    before = copy.deepcopy(values)
    parse_study(values, SOURCE)
    assert values == before


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_shipped_study_is_read_and_read_back(path: Path) -> None:
    for run in expand(read_study(path), path):
        again = parse_study(run.resolved(), path)
        assert (again.all_contacts, again.programme, again.time) == (
            run.study.all_contacts,
            run.study.programme,
            run.study.time,
        )


def test_examples_of_the_documentation_are_read(tmp_path: Path) -> None:
    """The page shows a study in parts: together they are one, and every one of its runs is right."""
    text = (ROOT / "docs" / "studies.md").read_text(encoding="utf-8")
    short, *parts = (yaml.safe_load(block) for block in re.findall(r"```yaml\n(.*?)```", text, re.DOTALL))
    parse_study(finger() | short, SOURCE)
    whole: dict[str, Any] = {}
    for part in parts:
        whole |= part
    source = tmp_path / "x.yaml"
    assert len(expand(parse_study(whole, source), source)) == 8
