"""What must hold between the fields of a study, also where others are wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from fingerslip.errors import InputError
from fingerslip.mesh.source import MeshFile
from fingerslip.study.definition.spec import mistakes_between, parse_study
from unit.study.block import block_values

SOURCE = Path("studies/x.yaml")


@pytest.mark.parametrize("name", ["materials", "formulation", "depth"])
def test_body_that_is_no_fingertip_says_everything_itself(name: str) -> None:
    values = block_values()
    del values[name]
    with pytest.raises(InputError, match=rf"x\.yaml: {name}: is missing, needs a value where there is no fingertip"):
        parse_study(values, SOURCE)


@pytest.mark.parametrize(("name", "value"), [("receptors", ["FA-I"]), ("reference_nodes", True)])
def test_sites_of_a_fingertip_need_one(name: str, value: object) -> None:
    missing = rf"record\.{name}: is given without a fingertip or tactip, .*name points in record"
    with pytest.raises(InputError, match=missing):
        parse_study(block_values() | {"record": {name: value}}, SOURCE)


def test_fields_that_are_missing_together_come_with_mistakes_elsewhere() -> None:
    values = block_values() | {"time": {"step": 3}, "contacts": [{"friction_coefficient": 0.1}]}
    for name in ("materials", "formulation", "depth"):
        del values[name]
    with pytest.raises(InputError) as caught:
        parse_study(values, SOURCE)
    assert [(error.where.removeprefix("studies/x.yaml: "), error.found) for error in caught.value.all] == [
        ("time.step", "'3' has no unit"),
        ("contacts", "is given with contact"),
        *((name, "is missing") for name in ("materials", "formulation", "depth")),
    ]


def test_a_programme_needs_a_contact() -> None:
    fields = {"contact": None, "contacts": (), "programme": (object(),)}
    (mistake,) = mistakes_between(fields)
    assert (mistake.where, mistake.found) == ("contact", "is missing, and the programme moves the plate")
    assert mistakes_between({**fields, "programme": ()}) == []
    assert mistakes_between({**fields, "contacts": (object(),)}) == []


def test_a_relation_is_checked_where_all_its_fields_are_known() -> None:
    fields = {"fingertip": None, "tactip": None, "mesh": MeshFile("a.msh"), "formulation": "solid", "materials": {}}
    assert [mistake.where for mistake in mistakes_between(fields)] == ["materials"]
    assert mistakes_between({"fingertip": None, "tactip": None, "materials": {}}) == []
    assert [mistake.where for mistake in mistakes_between(fields | {"formulation": None, "depth": None})] == [
        "materials",
        "formulation",
        "depth",
    ]
