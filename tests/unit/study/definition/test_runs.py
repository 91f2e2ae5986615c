"""Sweeps: all combinations in order, each with its values and a folder name of its own, and what is wrong in them."""

from __future__ import annotations

import dataclasses
import itertools
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fingerslip.errors import InputError
from fingerslip.mesh.source import MeshFile
from fingerslip.study.definition import sweep
from fingerslip.study.definition.runs import expand, expand_mapping, run_names
from fingerslip.study.definition.spec import parse_study, read_study
from fingerslip.study.definition.sweep import check_sweep, combinations, with_values
from places import STUDIES
from unit.study.block import block_values, finger_values

SOURCE = Path("studies/x.yaml")


def runs_of(swept: dict[str, Any], values: dict[str, Any] | None = None) -> tuple[sweep.Run, ...]:
    return expand(parse_study((values or block_values()) | {"sweep": swept}, SOURCE), SOURCE)


def test_first_path_varies_slowest() -> None:
    runs = runs_of(
        {"fingertip.phalanx.variant": ["original", "scaled"], "contact.friction_coefficient": [0.2, 0.6]},
        finger_values(),
    )
    assert [run.name for run in runs] == [
        "variant-original_friction_coefficient-0.2",
        "variant-original_friction_coefficient-0.6",
        "variant-scaled_friction_coefficient-0.2",
        "variant-scaled_friction_coefficient-0.6",
    ]
    assert [run.study.contact.friction_coefficient for run in runs if run.study.contact] == [0.2, 0.6, 0.2, 0.6]
    assert [run.specimen.phalanx.variant for run in runs if run.specimen] == ["original"] * 2 + ["scaled"] * 2


def test_study_without_sweep_is_one_run() -> None:
    (run,) = runs_of({})
    assert (run.name, dict(run.swept), run.where) == ("run", {}, "studies/x.yaml")


def test_values_inside_lists_can_be_swept() -> None:
    runs = runs_of({"programme.0.press.depth": ["0.1 mm", "0.2 mm"]})
    assert [run.study.programme[0].depth for run in runs] == [1e-4, 2e-4]
    assert [run.name for run in runs] == ["depth-0.1mm", "depth-0.2mm"]


def test_optional_values_that_are_not_in_the_file_can_be_swept() -> None:
    runs = runs_of({"contact.normal_penalty": ["1e9 Pa/m", "1e10 Pa/m"]})
    assert [run.study.contact.normal_penalty for run in runs if run.study.contact] == [1e9, 1e10]


def test_swept_mesh_file_is_relative_to_the_study() -> None:
    runs = runs_of({"mesh.file": ["coarse.msh", "fine.msh"]})
    folder = SOURCE.parent.resolve()
    assert [run.study.mesh for run in runs] == [MeshFile(str(folder / f"{n}.msh")) for n in ("coarse", "fine")]


@pytest.mark.parametrize(
    ("path", "repair"),
    [
        ("contact.coefficient", "did you mean 'contact.friction_coefficient'?"),
        ("phalanx.variant", "did you mean 'fingertip.phalanx.variant'?"),
        ("fingertip.phalanx.varient", "did you mean 'fingertip.phalanx.variant'?"),
        ("time.stp", "did you mean 'time.step'?"),
        ("programme.7.press.depth", "did you mean 'programme.0.press.depth'?"),
        ("qqq", "fingerslip show STUDY lists all paths"),
    ],
)
def test_unknown_path_is_refused_with_the_nearest(path: str, repair: str) -> None:
    with pytest.raises(InputError) as caught:
        runs_of({path: [1]}, finger_values())
    assert caught.value.where == f"studies/x.yaml: sweep.{path}"
    assert caught.value.repair == repair


@pytest.mark.parametrize("path", ["title", "sweep", "compare"])
def test_what_is_no_value_of_the_model_cannot_be_swept(path: str) -> None:
    with pytest.raises(InputError, match="is not known"):
        runs_of({path: ["a"]})


def test_every_swept_value_is_checked() -> None:
    with pytest.raises(InputError) as caught:
        runs_of({"contact.friction_coefficient": [0.2, -0.4]})
    expected = "studies/x.yaml: sweep.contact.friction_coefficient.1: got -0.4, needs a number >= 0"
    assert str(caught.value) == expected


def test_runs_of_a_study_made_in_python_are_checked_too() -> None:
    study = dataclasses.replace(parse_study(block_values(), SOURCE), sweep={"tme.step": (1,), "time.step": ("1 mm",)})
    with pytest.raises(InputError) as caught:
        expand(study, SOURCE)
    assert [error.where for error in caught.value.all] == [
        "studies/x.yaml: sweep.tme.step",
        "studies/x.yaml: sweep.time.step.0",
    ]


def test_resolved_run_has_every_value_of_the_fingertip() -> None:
    (run,) = runs_of({"fingertip.phalanx.variant": ["scaled"]}, finger_values())
    resolved = run.plain_values()
    assert resolved["fingertip"]["phalanx"]["variant"] == "scaled"
    assert resolved["fingertip"]["layers"]["skin_thickness"] == "0.0015 m"
    assert "sweep" not in resolved
    (again,) = expand(parse_study(resolved, SOURCE), SOURCE)
    assert again.specimen == run.specimen


def sampled(**sample: Any) -> dict[str, Any]:
    ranges = {"fingertip.sagittal.half_height": ["6 mm", "7 mm"]}
    return finger_values() | {"sample": {"count": 12, "ranges": ranges} | sample}


def test_every_combination_is_run_with_every_sample() -> None:
    values = sampled() | {"sweep": {"fingertip.phalanx.variant": ["original", "scaled"]}}
    runs = expand(parse_study(values, SOURCE), SOURCE)
    assert len(runs) == 24
    assert [runs[0].name, runs[-1].name] == ["variant-original_sample-01", "variant-scaled_sample-12"]
    assert runs[12].swept == {"fingertip.phalanx.variant": "scaled", "sample": 1}
    assert runs[0].sampled == runs[12].sampled
    height = float(str(runs[0].sampled["fingertip.sagittal.half_height"]).split()[0])
    assert runs[0].specimen.sagittal.half_height == pytest.approx(1e-3 * height)  # type: ignore[union-attr]
    assert runs[0].where == "studies/x.yaml (fingertip.phalanx.variant = original, sample = 1)"


def test_a_sampled_run_is_a_study_file_of_its_own() -> None:
    run = expand(parse_study(sampled(), SOURCE), SOURCE)[3]
    assert "sample" not in run.plain_values()
    (again,) = expand(parse_study(run.plain_values(), SOURCE), SOURCE)
    assert again.specimen == run.specimen


def test_equal_values_change_together() -> None:
    equal = {"fingertip.transverse.half_height": "fingertip.sagittal.half_height"}
    for run in expand(parse_study(sampled(equal=equal), SOURCE), SOURCE):
        assert run.specimen is not None
        assert run.specimen.transverse.half_height == run.specimen.sagittal.half_height  # type: ignore[attr-defined]


def test_samples_that_do_not_fit_together_are_refused_and_the_others_stay() -> None:
    """Each of the ends is right on its own, but a thin skin has no room for a thick epidermis."""
    ranges = {
        "fingertip.layers.skin_thickness": ["0.7 mm", "2 mm"],
        "fingertip.layers.epidermis_thickness": ["0.3 mm", "1.2 mm"],
    }
    expansion = expand_mapping(sampled(ranges=ranges), SOURCE)
    assert len(expansion.runs) + len(expansion.refused) == 12
    assert expansion.refused
    for one in expansion.refused:
        thickness = {path: float(str(value).split()[0]) for path, value in one.sampled.items()}
        skin, epidermis = thickness.values()
        assert epidermis >= skin or "skin" in one.reason
        assert one.name == f"sample-{one.swept['sample']:02}"
    assert "fingertip.layers.epidermis_thickness: got " in expansion.refused[0].reason


def mistakes(swept: dict[str, Any], **changes: Any) -> list[str]:
    """Return the lines about a study with a sweep; none where it is right."""
    try:
        parse_study(block_values() | changes | {"sweep": swept}, SOURCE)
    except InputError as error:
        return [line.removeprefix("studies/x.yaml: ") for line in str(error).splitlines()]
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


def finger_with_mesh(**swept: list[str]) -> dict[str, Any]:
    mesh, sweep = {"contact_size": "0.5 mm", "bulk_size": "1 mm"}, {f"mesh.{name}": swept[name] for name in swept}
    values = finger_values(mesh=mesh, sweep=sweep)
    del values["programme"]
    return values


def test_what_the_sweep_replaces_does_not_matter() -> None:
    """A bulk size of 0.3 mm is too small for the contact size of the file, which no run has."""
    study = parse_study(finger_with_mesh(contact_size=["0.1 mm", "0.2 mm"], bulk_size=["0.3 mm", "0.4 mm"]), SOURCE)
    assert len(study.sweep) == 2


def test_a_mistake_between_values_names_the_run() -> None:
    with pytest.raises(InputError) as caught:
        parse_study(finger_with_mesh(contact_size=["0.1 mm", "2 mm"]), SOURCE)
    assert str(caught.value) == (
        "studies/x.yaml: mesh.bulk_size: got 1 mm in the run with mesh.contact_size = 2 mm, "
        "needs >= 2 mm (contact_size)"
    )


def test_values_of_the_fingertip_are_judged() -> None:
    values = finger_with_mesh() | {
        "sweep": {"fingertip.phalanx.variant": ["scaled", "flat"], "fingertip.preset": ["wang"]}
    }
    with pytest.raises(InputError) as caught:
        parse_study(values, SOURCE)
    assert "studies/x.yaml: sweep.fingertip.preset.0: 'wang' is not known" in str(caught.value)


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


PATHS = ["contact.friction_coefficient", "time.step", "fingertip.fingerprint.enabled"]


numbers = st.floats(allow_nan=False) | st.integers(-100, 100)


quantities = st.builds("{} {}".format, numbers, st.sampled_from(["mm", "deg", "mm/s", "kPa"]))


values = st.one_of(
    st.booleans(),
    numbers,
    quantities,
    st.text(max_size=40),
    st.lists(st.integers(-1, 1), max_size=3),
    st.dictionaries(st.sampled_from(["plane", "sphere"]), quantities, max_size=2),
    st.sampled_from(["1 mm/s", "1mm/s", "A", "a", "../../x", ".5 mm", "5 mm", "x", "-x"]),
)


@given(lists=st.lists(st.lists(values, min_size=1, max_size=4, unique_by=repr), min_size=1, max_size=3))
def test_names_are_safe_short_and_different(lists: list[list[object]]) -> None:
    combinations = [dict(zip(PATHS, items, strict=False)) for items in itertools.product(*lists)]
    names = run_names(combinations)
    assert len({name.lower() for name in names}) == len(combinations)
    for name in names:
        assert re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._+-]*", name)
        assert len(name) <= 110
        assert not name.endswith(".")


@given(pair=st.lists(numbers, min_size=2, max_size=2, unique=True), unit=st.sampled_from(["mm", "deg", "kPa"]))
@example(pair=[-15, 15], unit="deg")
@example(pair=[0.1234567, 0.1234568], unit="mm")
@example(pair=[0.5, 5], unit="mm")
@example(pair=[0.6, 0.6000000000000001], unit="mm")
def test_different_numbers_have_different_names_without_a_hash(pair: list[float], unit: str) -> None:
    """Both as numbers and as quantities; a hash would say nothing to the reader."""
    for swept in (pair, [f"{value!r} {unit}" for value in pair]):
        names = run_names([{"x": value} for value in swept])
        assert len({name.lower() for name in names}) == 2
        assert not [name for name in names if re.search(r"-[0-9a-f]{8}$", name)]


@pytest.mark.parametrize(
    ("swept", "name"),
    [
        ({"fingertip.finger_angle": "-15 deg"}, "finger_angle--15deg"),
        ({"fingertip.finger_angle": "15 deg"}, "finger_angle-15deg"),
        ({"contact.offset": "-.5 mm"}, "offset--.5mm"),
        ({"time.alpha": -0.41421}, "alpha--0.41421"),
        ({"contact.friction_coefficient": 0.1234567891}, "friction_coefficient-0.1234567891"),
        ({"contact.friction_coefficient": 0.1 * 6}, "friction_coefficient-0.6"),
        ({"mesh.contact_size": f"{0.1 * 3} mm"}, "contact_size-0.3mm"),
        ({"a.b": [0.1 * 6, {"c": "-0.30000000000000004 mm/s"}]}, "b-0.6_c--0.3mm-per-s"),
        ({"contact.normal_penalty": 1e12}, "normal_penalty-1e+12"),
        ({"programme.1.slide.direction": [-1, 0, 1]}, "direction--1_0_1"),
        ({"contact.counterface": {"plane": {"offset": "-1 mm"}}}, "counterface-plane-offset--1mm"),
        ({"fingertip.fingerprint.enabled": True}, "fingerprint-true"),
        ({"supports.my layer": ["x"]}, "my-layer-x"),
        ({"fingertip.formulation": "plane_stress"}, "formulation-plane-stress"),
        (
            {"programme.0.press.speed": "1 mm/s", "programme.1.slide.speed": "2 mm/s"},
            "programme-0-press-speed-1mm-per-s_programme-1-slide-speed-2mm-per-s",
        ),
        ({}, "run"),
    ],
)
def test_names_of_single_runs(swept: dict[str, object], name: str) -> None:
    assert run_names([swept]) == [name]


def test_values_that_look_alike_are_told_apart_by_a_hash() -> None:
    names = run_names([{"mesh.file": value} for value in ("a b.msh", "a-b.msh", "A-b.msh", "c.msh")])
    assert [name.startswith(("file-a-b.msh-", "file-A-b.msh-")) for name in names] == [True, True, True, False]
    assert len(set(names)) == 4
    assert names == run_names([{"mesh.file": value} for value in ("a b.msh", "a-b.msh", "A-b.msh", "c.msh")])


@pytest.mark.parametrize(
    ("study", "name"),
    [
        ("directions_3d", "direction--1_0_-1"),
        ("wang2014_damping", "alpha--0.41421_friction_coefficient-0.2"),
        ("wang2014_thickness", "tissue_thickness-2.5mm"),
        ("wang2014_formulation", "formulation-plane-stress_variant-original"),
    ],
)
def test_finished_runs_of_shipped_studies_keep_their_folders(study: str, name: str) -> None:
    path = STUDIES / f"{study}.yaml"
    assert name in [run.name for run in expand(read_study(path), path)]
