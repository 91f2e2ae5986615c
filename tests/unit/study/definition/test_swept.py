"""What a sweep changes: every wrong path and value is told once, and no right one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fingerslip.errors import InputError
from fingerslip.study.definition.spec import parse_study
from fingerslip.study.definition.sweep import check_sweep, combinations, with_values
from unit.study.block import block_values

SOURCE = Path("x.yaml")


def mistakes(swept: dict[str, Any], **changes: Any) -> list[str]:
    """Return the lines about a study with a sweep; none where it is right."""
    try:
        parse_study(block_values() | changes | {"sweep": swept}, SOURCE)
    except InputError as error:
        return [line.removeprefix("x.yaml: ") for line in str(error).splitlines()]
    return []


def test_all_paths_and_values_are_judged() -> None:
    swept = {
        "contact.friction_coefficient": [0.2, -0.4, "much"],
        "time.stp": ["1 ms"],
        "materials.block.density": ["1 kg/m^3", "1 kg"],
    }
    assert mistakes(swept) == [
        "sweep.contact.friction_coefficient.1: got -0.4, needs a number >= 0",
        "sweep.contact.friction_coefficient.2: got 'much', needs a number",
        "sweep.time.stp: is not known, needs the dotted path of a value of the study; did you mean 'time.step'?",
        "sweep.materials.block.density.1: got '1 kg', needs a unit of [kg/m^3]; write for example '1 kg/m^3'",
    ]


def test_a_name_like_none_of_its_group_is_answered_by_the_names_of_the_group() -> None:
    (found,) = mistakes({"contact.mu": [0.4]})
    assert found.startswith("sweep.contact.mu: is not known, contact may have boundary, clearance, counterface, ")
    assert ", friction_coefficient, " in found


def test_they_come_with_the_other_mistakes_of_the_file() -> None:
    found = mistakes({"contact.friction_coefficient": [-0.4], "time.stp": ["1 ms"]}, depth="1 s", time={"step": 3})
    assert [line.partition(":")[0] for line in found] == [
        *("depth", "time.step"),
        *("sweep.contact.friction_coefficient.0", "sweep.time.stp"),
    ]


def test_paths_into_a_wrong_field_are_judged_by_their_values() -> None:
    contact = {"friction_coefficient": 0.6, "boundary": 3}
    swept = {"contact.friction_coefficient": [0.1, -1], "contact.frictoin": [1, 2], "contact.boundary.x": [1]}
    assert mistakes(swept, contact=contact) == [
        "contact.boundary: got 3, needs text",
        "sweep.contact.friction_coefficient.1: got -1, needs a number >= 0",
        mistakes({}, contact=contact | {"frictoin": 1})[1].replace("contact.frictoin", "sweep.contact.frictoin"),
    ]


def test_values_inside_groups_are_named() -> None:
    swept = {"contact.counterface": [{"cylinder": {"radius": "8 mm"}}, {"cylinder": {"radius": 8}}]}
    assert mistakes(swept) == [
        "sweep.contact.counterface.1.cylinder.radius: '8' has no unit, needs a unit of [m]; write '8 mm' or '8 m'"
    ]


def finger(**swept: list[str]) -> dict[str, Any]:
    return {
        "fingertip": {"preset": "wang2014-2d"},
        "contact": {"friction_coefficient": 0.6},
        "time": {"step": "5 ms"},
        "mesh": {"contact_size": "0.5 mm", "bulk_size": "1 mm"},
        "sweep": {f"mesh.{name}": values for name, values in swept.items()},
    }


def test_what_the_sweep_replaces_does_not_matter() -> None:
    """A bulk size of 0.3 mm is too small for the contact size of the file, which no run has."""
    study = parse_study(finger(contact_size=["0.1 mm", "0.2 mm"], bulk_size=["0.3 mm", "0.4 mm"]), SOURCE)
    assert len(study.sweep) == 2


def test_a_mistake_between_values_names_the_run() -> None:
    with pytest.raises(InputError) as caught:
        parse_study(finger(contact_size=["0.1 mm", "2 mm"]), SOURCE)
    assert str(caught.value) == (
        "x.yaml: mesh.bulk_size: got 1 mm in the run with mesh.contact_size = 2 mm, needs >= 2 mm (contact_size)"
    )


def test_values_of_the_fingertip_are_judged() -> None:
    values = finger() | {"sweep": {"fingertip.phalanx.variant": ["scaled", "flat"], "fingertip.preset": ["wang"]}}
    with pytest.raises(InputError) as caught:
        parse_study(values, SOURCE)
    assert "x.yaml: sweep.fingertip.preset.0: 'wang' is not known" in str(caught.value)


@pytest.mark.parametrize(
    ("sweep", "message"),
    [
        ({"a": ()}, "a: has no values, needs a list such as [0.2, 0.4]"),
        ({"a": (1, 2, 1)}, "a: has 1 twice, needs every value once"),
        ({"a": (None, None)}, "a: has None twice, needs every value once"),
        ({"a": ("1 mm", "1mm")}, "a: has '1mm' twice, needs every value once"),
        ({"a": (1,), "a.b": (1,)}, "a.b: is a part of the swept 'a', needs paths apart from each other"),
    ],
)
def test_lists_are_right_on_their_own(sweep: dict[str, tuple[Any, ...]], message: str) -> None:
    with pytest.raises(InputError) as caught:
        check_sweep(sweep)
    assert str(caught.value) == message
    assert check_sweep({"a": ("a b", "ab"), "ab": (1,)})


def test_values_are_put_into_a_copy() -> None:
    values = block_values()
    changed = with_values(values, {"contact.friction_coefficient": 0.1, "damping.stiffness": "1 s"})
    assert changed == values | {
        "contact": {"friction_coefficient": 0.1, "boundary": "bottom"},
        "damping": {"stiffness": "1 s"},
        "sweep": {},
    }
    assert values == block_values()
    assert combinations({}) == [{}]


TOGETHER = "contact.friction_coefficient, programme.0.press.depth"


def test_values_that_change_together_are_runs_side_by_side() -> None:
    swept = {TOGETHER: [[0.2, "0.1 mm"], [0.4, "0.2 mm"]], "time.step": ["2 ms", "1 ms"]}
    study = parse_study(block_values() | {"sweep": swept}, SOURCE)
    found = combinations(study.sweep)
    assert [tuple(one.values()) for one in found] == [
        (0.2, "0.1 mm", "2 ms"),
        (0.2, "0.1 mm", "1 ms"),
        (0.4, "0.2 mm", "2 ms"),
        (0.4, "0.2 mm", "1 ms"),
    ]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ([[0.2, "0.1 mm"], [0.4]], f"sweep.{TOGETHER}.1: got [0.4], needs a list of 2 values, one for each path"),
        ([0.2], f"sweep.{TOGETHER}.0: got 0.2, needs a list of 2 values, one for each path"),
        ([[0.2, "0.1 mm"], [-1, "0.1 mm"]], f"sweep.{TOGETHER}.1.0: got -1, needs a number >= 0"),
        ([[0.2, "0.1 s"]], f"sweep.{TOGETHER}.0.1: got '0.1 s', needs a unit of [m]; write for example '0.1 mm'"),
        ([[0.2, "0.1 mm"], [0.2, "0.1 mm"]], f"sweep.{TOGETHER}: has [0.2, '0.1 mm'] twice, needs every value once"),
    ],
)
def test_mistakes_in_values_that_change_together_are_named(values: list[Any], message: str) -> None:
    assert mistakes({TOGETHER: values}) == [message]


def test_paths_that_change_together_are_judged() -> None:
    (unknown,) = mistakes({"contact.friction_coefficient, time.stp": [[0.2, "1 ms"]]})
    assert unknown.startswith("sweep.contact.friction_coefficient, time.stp: has 'time.stp', which is not known, needs")
    assert unknown.endswith("did you mean 'time.step'?")
    (inside, _) = mistakes({"depth, time.step": [["1 mm", "1 ms"]], "time.step": ["2 ms"]})
    assert "is a part of the swept 'time.step'" in inside
    (inside,) = mistakes({"depth, depth": [["1 mm", "2 mm"]]})
    assert "is a part of the swept 'depth'" in inside
