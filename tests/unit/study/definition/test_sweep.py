"""What changes from run to run: sweeps, samples and repeats, each run with its values and a name of its own."""

import itertools
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fingerslip.errors import InputError
from fingerslip.mesh.source import MeshFile
from fingerslip.parameters import as_mapping
from fingerslip.study.definition.runs import expand_mapping, read_runs, run_names
from fingerslip.study.definition.spec import parse_study, read_study
from fingerslip.study.definition.sweep import (
    RepeatSettings,
    SampleSettings,
    check_sweep,
    combinations,
    drawn,
    sample_mistakes,
    scatter_values,
    with_values,
)
from unit.study.block import FRICTIONS, block_values, finger_values

SOURCE = Path("studies/x.yaml")


def runs_of(swept, values=None):
    return expand_mapping((values or block_values()) | {"sweep": swept}, SOURCE).runs


def test_first_path_varies_slowest_without_any_there_is_one_run_and_equal_values_change_together():
    swept = {"fingertip.phalanx.variant": ["original", "scaled"], "contact.friction_coefficient": [0.2, 0.6]}
    runs, pairs = runs_of(swept, finger_values()), itertools.product(*swept.values())
    assert [run.name for run in runs] == [f"variant-{name}_friction_coefficient-{mu}" for name, mu in pairs]
    assert [run.study.contact.friction_coefficient for run in runs if run.study.contact] == [0.2, 0.6, 0.2, 0.6]
    assert [run.specimen.phalanx.variant for run in runs if run.specimen] == ["original"] * 2 + ["scaled"] * 2
    (run,) = runs_of({})
    assert (run.name, dict(run.swept), run.where) == ("run", {}, "studies/x.yaml")
    equal = {"fingertip.transverse.half_height": "fingertip.sagittal.half_height"}
    for run in expand_mapping(sampled(equal=equal), SOURCE).runs:
        assert run.specimen is not None
        assert run.specimen.transverse.half_height == run.specimen.sagittal.half_height


HERE = SOURCE.parent.resolve()


@pytest.mark.parametrize(
    ("path", "values", "read", "expected"),
    [
        # inside a list, not in the file, and relative to the study
        ("programme.0.press.depth", ["0.1 mm", "0.2 mm"], lambda study: study.programme[0].depth, [1e-4, 2e-4]),
        ("contact.normal_penalty", ["1e9 Pa/m"], lambda study: study.contact.normal_penalty, [1e9]),
        ("mesh.file", ["a.msh", "b.msh"], lambda study: study.mesh, [MeshFile(str(HERE / f"{n}.msh")) for n in "ab"]),
    ],
)
def test_values_anywhere_can_be_swept(path, values, read, expected):
    assert [read(run.study) for run in runs_of({path: values})] == expected


def sampled(**sample):
    ranges = {"fingertip.sagittal.half_height": ["6 mm", "7 mm"]}
    return finger_values() | {"sample": {"count": 12, "ranges": ranges} | sample}


def test_every_combination_is_run_with_every_sample():
    values = sampled() | {"sweep": {"fingertip.phalanx.variant": ["original", "scaled"]}}
    runs = expand_mapping(values, SOURCE).runs
    assert len(runs) == 24
    assert [runs[0].name, runs[-1].name] == ["variant-original_sample-01", "variant-scaled_sample-12"]
    assert runs[12].swept == {"fingertip.phalanx.variant": "scaled", "sample": 1}
    assert runs[0].sampled == runs[12].sampled
    height = float(str(runs[0].sampled["fingertip.sagittal.half_height"]).split()[0])
    assert runs[0].specimen.sagittal.half_height == pytest.approx(1e-3 * height)
    assert runs[0].where == "studies/x.yaml (fingertip.phalanx.variant = original, sample = 1)"


def test_samples_that_do_not_fit_together_are_refused_and_the_others_stay():
    """Each of the ends is right on its own, but a thin skin has no room for a thick epidermis."""
    skin, epidermis = "fingertip.layers.skin_thickness", "fingertip.layers.epidermis_thickness"
    expansion = expand_mapping(sampled(ranges={skin: ["0.7 mm", "2 mm"], epidermis: ["0.3 mm", "1.2 mm"]}), SOURCE)
    assert len(expansion.runs) + len(expansion.refused) == 12
    assert expansion.refused
    for one in expansion.refused:
        thickness = {path: float(str(value).split()[0]) for path, value in one.sampled.items()}
        assert thickness[epidermis] >= thickness[skin] or "skin" in one.reason
        assert one.name == f"sample-{one.swept['sample']:02}"
    assert "fingertip.layers.epidermis_thickness: got " in expansion.refused[0].reason
    ranges = {skin: ["0.7 mm", "0.75 mm"], epidermis: ["1 mm", "1.2 mm"]}
    with pytest.raises(InputError, match="epidermis_thickness: got "):  # where all are refused, the study is wrong
        expand_mapping(sampled(ranges=ranges), SOURCE)


def mistakes(swept, **changes):
    """Return the lines about a study with a sweep; none where it is right."""
    try:
        parse_study(block_values() | changes | {"sweep": swept}, SOURCE)
    except InputError as error:
        return [line.removeprefix("studies/x.yaml: ") for line in str(error).splitlines()]
    return []


TOGETHER = "contact.friction_coefficient, programme.0.press.depth"


def test_what_is_no_number_may_differ_in_spaces_and_paths_into_a_wrong_field_are_judged_by_their_values():
    assert check_sweep({"a": ("a b", "ab"), "ab": (1,)})
    # A bulk size of 0.3 mm is too small for the contact size of the file, which no run has.
    study = parse_study(finger_with_mesh(contact_size=["0.1 mm", "0.2 mm"], bulk_size=["0.3 mm", "0.4 mm"]), SOURCE)
    assert len(study.sweep) == 2
    contact = {"friction_coefficient": 0.6, "boundary": 3}
    swept = {"contact.friction_coefficient": [0.1, -1], "contact.frictoin": [1, 2], "contact.boundary.x": [1]}
    assert mistakes(swept, contact=contact) == [
        "contact.boundary: got 3, needs text",
        "sweep.contact.friction_coefficient.1: got -1, needs a number >= 0",
        mistakes({}, contact=contact | {"frictoin": 1})[1].replace("contact.frictoin", "sweep.contact.frictoin"),
    ]


def finger_with_mesh(**swept):
    mesh, sweep = {"contact_size": "0.5 mm", "bulk_size": "1 mm"}, {f"mesh.{name}": swept[name] for name in swept}
    values = finger_values(mesh=mesh, sweep=sweep)
    del values["programme"]
    return values


def test_values_are_put_into_a_copy_and_those_that_change_together_are_runs_side_by_side():
    values = block_values()
    changed = with_values(values, {"contact.friction_coefficient": 0.1, "damping.stiffness": "1 s"})
    contact = {"friction_coefficient": 0.1, "boundary": "bottom"}
    assert changed == values | {"contact": contact, "damping": {"stiffness": "1 s"}, "sweep": {}}
    assert values == block_values()
    assert combinations({}) == [{}]
    swept = {TOGETHER: [[0.2, "0.1 mm"], [0.4, "0.2 mm"]], "time.step": ["2 ms", "1 ms"]}
    found = combinations(parse_study(block_values() | {"sweep": swept}, SOURCE).sweep)
    pairs = [(0.2, "0.1 mm"), (0.4, "0.2 mm")]
    assert [tuple(one.values()) for one in found] == [(*pair, step) for pair in pairs for step in ("2 ms", "1 ms")]
    said = "mesh.bulk_size: got 1 mm in the run with mesh.contact_size = 2 mm, needs >= 2 mm (contact_size)"
    with pytest.raises(InputError, match=f"^studies/x.yaml: {re.escape(said)}$"):
        parse_study(finger_with_mesh(contact_size=["0.1 mm", "2 mm"]), SOURCE)


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
@example(lists=[["a" * 40], ["b" * 40], ["c" * 40]])
def test_names_are_safe_short_and_different(lists):
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
def test_different_numbers_have_different_names_without_a_hash(pair, unit):
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
def test_names_of_single_runs(swept, name):
    assert run_names([swept]) == [name]


def test_values_that_look_alike_are_told_apart_by_a_hash():
    values = [{"mesh.file": value} for value in ("a b.msh", "a-b.msh", "A-b.msh", "c.msh")]
    names = run_names(values)
    assert [name.startswith(("file-a-b.msh-", "file-A-b.msh-")) for name in names] == [True, True, True, False]
    assert len(set(names)) == 4
    assert names == run_names(values)


HEIGHT = "fingertip.sagittal.half_height"
RATIO = "fingertip.materials.tissue.poisson_ratio"


def finger(**sample):
    return finger_values(sample={"count": 4, "ranges": {HEIGHT: ["6 mm", "7 mm"]}} | sample)


def test_samples_fill_their_ranges_and_come_together_at_random():
    samples = drawn(SampleSettings({"a": ("10 mm", "20 mm"), "b": (-1, 1)}, count=10))
    parts = [sorted(int(float(sample["a"].removesuffix(" mm")) - 10.0) for sample in samples)]
    parts.append(sorted(int(5 * (sample["b"] + 1.0)) for sample in samples))
    assert parts == [list(range(10))] * 2
    assert {sample["a"].split()[1] for sample in samples} == {"mm"}
    # A Sobol sequence fills every part of both ranges, and every quarter of pairs.
    samples = drawn(SampleSettings({"a": (0, 1), "b": (0, 1)}, count=16, method="sobol"))
    values = np.array([[sample["a"], sample["b"]] for sample in samples])
    assert sorted((16 * values[:, 0]).astype(int)) == list(range(16))
    quarters, counts = np.unique((4 * values).astype(int), axis=0, return_counts=True)
    assert (len(quarters), set(counts)) == (16, {1})
    # Independent values are uniform.
    values = np.array([one["a"] for one in drawn(SampleSettings({"a": (2, 4)}, count=2000, method="random"))])
    assert values.mean() == pytest.approx(3.0, abs=0.05)
    assert values.std() == pytest.approx(2.0 / np.sqrt(12.0), rel=0.05)
    assert values.min() >= 2.0
    assert values.max() <= 4.0
    samples = drawn(SampleSettings({"a": (0, 1), "b": (0, 1)}, count=200))
    values = np.array([[sample["a"], sample["b"]] for sample in samples])
    assert abs(np.corrcoef(values.T)[0, 1]) < 0.15
    for method, count in (("latin_hypercube", 30), ("saltelli", 16), ("morris", 30)):
        samples = drawn(SampleSettings({"b": (0, 1)}, count=count, method=method, choices={"word": tuple("abcd")}))
        assert {sample["word"] for sample in samples} == set("abcd"), method


def test_the_seed_decides_samples_those_that_are_equal_follow_and_wrong_ones_are_told_once():
    ranges = {"a": ("10 mm", "20 mm"), "b": (-1, 1)}
    for method in ("latin_hypercube", "sobol", "random"):
        first, again, other = (drawn(SampleSettings(ranges, count=8, seed=seed, method=method)) for seed in (1, 1, 2))
        assert first == again != other, method
    samples = drawn(SampleSettings({"time.step": ("1 ms", "3 ms")}, count=2))
    assert samples == ({"time.step": "1.4882 ms"}, {"time.step": "2.0495 ms"}), "finished runs are found again"
    settings = SampleSettings({"a": (0, 1)}, count=2, equal={"b": "a", "c": "a"})
    assert settings.values({"a": 0.3}) == {"a": 0.3, "b": 0.3, "c": 0.3}
    known = [InputError("sample.count", "is missing", "needs a value")]
    assert sample_mistakes(block_values() | {"sample": {}}, known, {}, lambda _: []) == []


def test_a_value_without_a_unit_hides_no_path_and_no_end_of_a_range_of_its_group():
    ranges = {"programme.0.press.zork": [0.1, 0.2], "programme.0.press.speed": [1, 2]}
    values = finger(ranges={HEIGHT: ["6 mm", "7 mm"]} | ranges)
    values["programme"][0]["press"]["depth"] = 45
    with pytest.raises(InputError) as caught:
        parse_study(values, SOURCE)
    places = [mistake.where.removeprefix(f"{SOURCE}: ") for mistake in caught.value.all]
    assert places == [
        "programme.0.press.depth",
        "sample.ranges.programme.0.press.zork",
        *(f"sample.ranges.programme.0.press.speed.{number}" for number in range(2)),
    ]


def test_ends_of_a_range_of_a_field_that_the_file_leaves_out_are_refused():
    with pytest.raises(InputError, match=r"sample\.ranges\.depth\.0: got '?-1"):
        parse_study(finger(ranges={"depth": ["-1 mm", "2 mm"]}), SOURCE)


def test_a_study_with_samples_reads_back_the_same_and_gives_its_ranges_and_the_lines_of_mistakes(tmp_path):
    path = tmp_path / "x.yaml"
    path.write_text(
        "fingertip: {preset: wang2014-2d}\ntime: {step: 5 ms}\ncontact: {friction_coefficient: 0.6}\n"
        f"sample:\n  count: 4\n  ranges:\n    {RATIO}: [0.45, 0.6]\n"
    )
    with pytest.raises(InputError, match=r"\(line 7\)$"):
        read_study(path)
    values = finger(equal={"fingertip.transverse.half_height": HEIGHT})
    study = parse_study(values, SOURCE)
    assert parse_study(as_mapping(study), SOURCE) == study
    path.write_text(str(values).replace("'", '"'))
    assert read_runs(path).given[-2:] == (HEIGHT, "fingertip.transverse.half_height")


REPEATS = {"count": 3, "scatter": {"contact.friction_coefficient": 0.02, "programme.0.press.depth": "0.01 mm"}}


def test_every_run_is_repeated_with_the_same_draws_and_impossible_ones_are_refused_alone():
    runs = expand_mapping(block_values() | {"repeats": REPEATS}, Path("x.yaml")).runs
    assert [run.name for run in runs[:2]] == [f"friction_coefficient-0.2_repeat-{number}" for number in (1, 2)]
    assert len(runs) == 9
    off = np.array([run.sampled["contact.friction_coefficient"] for run in runs]) - np.repeat(FRICTIONS, 3)
    assert off.reshape(3, 3) == pytest.approx(np.tile(off[:3], (3, 1)), abs=1e-6)
    assert len(set(off[:3])) == 3
    assert runs[0].study.contact.friction_coefficient == runs[0].sampled["contact.friction_coefficient"]
    values = block_values() | {"repeats": {"count": 20, "scatter": {"contact.friction_coefficient": 0.2}}, "sweep": {}}
    values["contact"]["friction_coefficient"] = 0.1
    expansion = expand_mapping(values, Path("x.yaml"))
    assert expansion.refused
    assert expansion.runs
    assert all(one.sampled["contact.friction_coefficient"] < 0.0 for one in expansion.refused)


def test_draws_have_the_standard_deviation_and_follow_from_the_seed():
    settings = RepeatSettings(count=400, scatter={"a": "0.1 mm"})
    drawn = [scatter_values(settings, number, {"a": "1.5 mm"})["a"] for number in range(1, 401)]
    values = np.array([float(text.removesuffix(" m")) for text in drawn])
    assert values.mean() == pytest.approx(1.5e-3, abs=2e-5)
    assert values.std() == pytest.approx(1e-4, rel=0.1)
    other = RepeatSettings(count=400, scatter={"a": "0.1 mm"}, seed=2)
    assert scatter_values(settings, 1, {"a": "3 mm"}) == {"a": "0.00308945 m"}
    assert scatter_values(settings, 1, {"a": "1 mm"}) == scatter_values(settings, 1, {"a": "1 mm"})
    assert scatter_values(settings, 1, {"a": "1 mm"}) != scatter_values(other, 1, {"a": "1 mm"})
