"""Names of runs: safe as folders, short, and different for different values."""

from __future__ import annotations

import itertools
import re

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fingerslip.study.definition.runs import expand, run_names
from fingerslip.study.definition.spec import read_study
from places import STUDIES

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


def test_paths_with_one_last_name_are_told_apart() -> None:
    swept = {"programme.0.press.speed": "1 mm/s", "programme.1.slide.speed": "2 mm/s"}
    assert run_names([swept]) == ["programme-0-press-speed-1mm-per-s_programme-1-slide-speed-2mm-per-s"]


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
