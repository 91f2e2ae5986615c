"""Samples and repeats: what may stand in a study file, and which values they take."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.parameters import as_mapping
from fingerslip.study.definition.runs import expand, expand_mapping, read_runs
from fingerslip.study.definition.samples import RepeatSettings, SampleSettings, drawn, sample_mistakes, scatter_values
from fingerslip.study.definition.spec import parse_study, read_study
from fingerslip.study.running.plan import plan_mapping
from unit.study.block import FRICTIONS, block_values, finger_values

SOURCE = Path("studies/x.yaml")


HEIGHT, CLEARANCE = "fingertip.sagittal.half_height", "contact.clearance"


RATIO = "fingertip.materials.tissue.poisson_ratio"


def finger(**sample: Any) -> dict[str, Any]:
    return finger_values(sample={"count": 4, "ranges": {HEIGHT: ["6 mm", "7 mm"]}} | sample)


def test_every_part_of_a_range_holds_one_sample() -> None:
    samples = drawn(SampleSettings({"a": ("10 mm", "20 mm"), "b": (-1, 1)}, count=10))
    parts = [sorted(int(float(sample["a"].removesuffix(" mm")) - 10.0) for sample in samples)]
    parts.append(sorted(int(5 * (sample["b"] + 1.0)) for sample in samples))
    assert parts == [list(range(10))] * 2
    assert {sample["a"].split()[1] for sample in samples} == {"mm"}


def test_a_sobol_sequence_fills_every_part_and_every_quarter_of_pairs() -> None:
    samples = drawn(SampleSettings({"a": (0, 1), "b": (0, 1)}, count=16, method="sobol"))
    values = np.array([[sample["a"], sample["b"]] for sample in samples])
    assert sorted((16 * values[:, 0]).astype(int)) == list(range(16))
    quarters, counts = np.unique((4 * values).astype(int), axis=0, return_counts=True)
    assert (len(quarters), set(counts)) == (16, {1})


def test_independent_values_are_uniform() -> None:
    values = np.array([one["a"] for one in drawn(SampleSettings({"a": (2, 4)}, count=2000, method="random"))])
    assert values.mean() == pytest.approx(3.0, abs=0.05)
    assert values.std() == pytest.approx(2.0 / np.sqrt(12.0), rel=0.05)
    assert values.min() >= 2.0
    assert values.max() <= 4.0


@pytest.mark.parametrize("method", ["latin_hypercube", "sobol", "random"])
def test_the_seed_decides_the_samples(method: str) -> None:
    ranges = {"a": ("10 mm", "20 mm"), "b": (-1, 1)}
    first, again, other = (drawn(SampleSettings(ranges, count=8, seed=seed, method=method)) for seed in (1, 1, 2))
    assert first == again
    assert first != other


def test_ranges_come_together_at_random() -> None:
    samples = drawn(SampleSettings({"a": (0, 1), "b": (0, 1)}, count=200))
    values = np.array([[sample["a"], sample["b"]] for sample in samples])
    assert abs(np.corrcoef(values.T)[0, 1]) < 0.15


def test_equal_values_follow_a_sampled_one() -> None:
    settings = SampleSettings({"a": (0, 1)}, count=2, equal={"b": "a", "c": "a"})
    assert settings.values({"a": 0.3}) == {"a": 0.3, "b": 0.3, "c": 0.3}


def test_long_values_are_cut() -> None:
    with pytest.raises(InputError) as caught:
        parse_study(finger(ranges={HEIGHT: [{"count": 500 * "9"}, "7 mm"]}), SOURCE)
    assert f"sample.ranges.{HEIGHT}: got {{'count': '{69 * '9'}..., needs numbers or quantities" in str(caught.value)


def test_an_end_that_makes_another_value_wrong_says_which() -> None:
    path = "fingertip.layers.epidermis_thickness"
    with pytest.raises(InputError) as caught:
        parse_study(finger(ranges={path: ["0.02 mm", "0.5 mm"]}), SOURCE)
    assert f"sample.ranges.{path}.0: makes " in str(caught.value)


def test_all_mistakes_come_together() -> None:
    ranges = {RATIO: [0.45, 0.6], "contact.clearanc": ["0 mm", "1 mm"]}
    with pytest.raises(InputError) as caught:
        parse_study(finger(ranges=ranges), SOURCE)
    assert [error.where.removeprefix("studies/x.yaml: sample.ranges.") for error in caught.value.all] == [
        f"{RATIO}.1",
        "contact.clearanc",
    ]


def test_a_path_is_swept_or_sampled() -> None:
    values = finger() | {"sweep": {"fingertip.sagittal": [{"half_height": "6 mm"}]}}
    with pytest.raises(InputError, match=r"sample\.ranges\.fingertip.*: is swept too, by 'fingertip\.sagittal'"):
        parse_study(values, SOURCE)


def test_mistakes_have_their_lines(tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    path.write_text(
        "fingertip: {preset: wang2014-2d}\ntime: {step: 5 ms}\ncontact: {friction_coefficient: 0.6}\n"
        f"sample:\n  count: 4\n  ranges:\n    {RATIO}: [0.45, 0.6]\n"
    )
    with pytest.raises(InputError) as caught:
        read_study(path)
    assert str(caught.value).endswith("(line 7)")


def test_a_study_with_samples_reads_back_the_same_and_gives_its_ranges(tmp_path: Path) -> None:
    values = finger(equal={"fingertip.transverse.half_height": HEIGHT})
    study = parse_study(values, SOURCE)
    assert parse_study(as_mapping(study), SOURCE) == study
    path = tmp_path / "x.yaml"
    path.write_text(str(values).replace("'", '"'))
    assert read_runs(path).given[-2:] == (HEIGHT, "fingertip.transverse.half_height")


def test_a_study_that_is_wrong_in_its_samples_has_no_further_mistakes_in_them() -> None:
    known = [InputError("sample.count", "is missing", "needs a value")]
    assert sample_mistakes(block_values() | {"sample": {}}, known, {}, lambda _: []) == []


@pytest.mark.parametrize(
    ("sample", "said"),
    [
        ({"choices": {"word": ("a", "b", "a")}}, "choices.word: has 'a' twice"),
        ({"choices": {"word": ("a", "b"), "b": (1, 2)}}, "choices.b: has a range too"),
        ({"choices": {"b.c": (1, 2)}}, "choices.b.c: is a part of the sampled 'b'"),
        ({"equal": {"b.c": "b"}}, "equal.b.c: is a part of the sampled 'b'"),
        ({"method": "morris", "choices": {"word": tuple("abcde")}}, "choices.word: has 5 values, may have 4"),
        ({"count": 10**9}, "count: makes 1000000000 samples"),
        ({"count": 2**16, "method": "saltelli"}, "count: makes 196608 samples"),
    ],
)
def test_samples_that_cannot_be_meant_are_refused(sample: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        SampleSettings(**({"ranges": {"b": (0, 1)}, "count": 4} | sample))


def test_every_choice_is_drawn() -> None:
    for method, count in (("latin_hypercube", 30), ("saltelli", 16), ("morris", 30)):
        samples = drawn(SampleSettings({"b": (0, 1)}, count=count, method=method, choices={"word": tuple("abcd")}))
        counts = {sample["word"] for sample in samples}
        assert counts == set("abcd"), method


REPEATS = {"count": 3, "scatter": {"contact.friction_coefficient": 0.02, "programme.0.press.depth": "0.01 mm"}}


def test_every_run_is_repeated_with_the_same_draws() -> None:
    runs = expand(parse_study(block_values() | {"repeats": REPEATS}, Path("x.yaml")), Path("x.yaml"))
    assert [run.name for run in runs[:2]] == [f"friction_coefficient-0.2_repeat-{number}" for number in (1, 2)]
    assert len(runs) == 9
    off = np.array([run.sampled["contact.friction_coefficient"] for run in runs]) - np.repeat(FRICTIONS, 3)
    assert off.reshape(3, 3) == pytest.approx(np.tile(off[:3], (3, 1)), abs=1e-6)
    assert len(set(off[:3])) == 3
    assert runs[0].study.contact.friction_coefficient == runs[0].sampled["contact.friction_coefficient"]


def test_draws_have_the_standard_deviation_and_follow_from_the_seed() -> None:
    settings = RepeatSettings(count=400, scatter={"a": "0.1 mm"})
    drawn = [scatter_values(settings, number, {"a": "1.5 mm"})["a"] for number in range(1, 401)]
    values = np.array([float(text.removesuffix(" m")) for text in drawn])
    assert values.mean() == pytest.approx(1.5e-3, abs=2e-5)
    assert values.std() == pytest.approx(1e-4, rel=0.1)
    other = RepeatSettings(count=400, scatter={"a": "0.1 mm"}, seed=2)
    assert scatter_values(settings, 1, {"a": "1 mm"}) == scatter_values(settings, 1, {"a": "1 mm"})
    assert scatter_values(settings, 1, {"a": "1 mm"}) != scatter_values(other, 1, {"a": "1 mm"})


@pytest.mark.parametrize(
    ("scatter", "said"),
    [
        ({"contact.x": 0.1}, r"x\.yaml: repeats\.scatter\.contact\.x: is not known"),
        ({"title": 0.1}, r"leads to 'Block on a plate"),
        ({"time.step": "1 mm"}, r"needs a unit of \[s\]"),
        ({"time.step": "0 ms"}, r"needs a standard deviation above 0"),
    ],
)
def test_wrong_scatter_is_refused(scatter: dict[str, object], said: str) -> None:
    values = block_values() | {"repeats": {"count": 2, "scatter": scatter}}
    with pytest.raises(InputError, match=said):
        plan_mapping(values, Path("x.yaml"), Path("results"))


def test_impossible_draws_are_refused_alone() -> None:
    values = block_values() | {"repeats": {"count": 20, "scatter": {"contact.friction_coefficient": 0.2}}, "sweep": {}}
    values["contact"]["friction_coefficient"] = 0.1
    expansion = expand_mapping(values, Path("x.yaml"))
    assert expansion.refused
    assert expansion.runs
    assert all(one.sampled["contact.friction_coefficient"] < 0.0 for one in expansion.refused)


def test_repeats_and_samples_do_not_go_together(write_study: Callable[..., Path]) -> None:
    sample = {"count": 2, "ranges": {"time.step": ["1 ms", "2 ms"]}}
    with pytest.raises(InputError, match=r"repeats: is given with sample"):
        parse_study(block_values() | {"repeats": REPEATS, "sample": sample}, Path("x.yaml"))


@pytest.mark.parametrize("scatter", [{}, {"contact.friction_coefficient": math.inf}, {"depth": "nan mm"}])
def test_repeats_that_do_not_differ_or_cannot_be_drawn_are_refused(scatter: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="scatter"):
        RepeatSettings(count=2, scatter=scatter)
