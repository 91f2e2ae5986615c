"""Samples: what may stand in a study file, and which values they take."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.study.definition.runs import read_runs
from fingerslip.study.definition.samples import SampleSettings, drawn, sample_mistakes
from fingerslip.study.definition.spec import parse_study, read_study, study_mapping
from unit.study.block import block_values

SOURCE = Path("studies/x.yaml")
HEIGHT, CLEARANCE = "fingertip.sagittal.half_height", "contact.clearance"
RATIO = "fingertip.materials.tissue.poisson_ratio"


def finger(**sample: Any) -> dict[str, Any]:
    return {
        "fingertip": {"preset": "wang2014-2d"},
        "contact": {"friction_coefficient": 0.6},
        "programme": [{"press": {"depth": "1.5 mm", "speed": "1.5 mm/s"}}],
        "time": {"step": "5 ms"},
        "sample": {"count": 4, "ranges": {HEIGHT: ["6 mm", "7 mm"]}} | sample,
    }


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


@pytest.mark.parametrize(
    ("sample", "message"),
    [
        ({"count": 1}, "sample.count: got 1, needs a number >= 2"),
        (
            {"count": 6, "method": "sobol"},
            "sample.count: got 6 for a Sobol sequence, needs a power of two; write count: 4 or count: 8",
        ),
        ({"seed": -1}, "sample.seed: got -1, needs a number >= 0"),
        ({"ranges": {}}, "sample.ranges: is empty, needs a range by dotted path; write path: [smallest, largest]"),
        ({"ranges": {HEIGHT: ["6 mm"]}}, f"sample.ranges.{HEIGHT}: has 1 values, needs two: [smallest, largest]"),
        (
            {"ranges": {HEIGHT: ["7 mm", "6 mm"]}},
            f"sample.ranges.{HEIGHT}: goes from 7 mm to 6 mm, needs the smallest value first, then the largest",
        ),
        (
            {"ranges": {HEIGHT: ["0.6 cm", "7 mm"]}},
            f"sample.ranges.{HEIGHT}: goes from '0.6 cm' to '7 mm', needs both ends in the same unit",
        ),
        (
            {"ranges": {"fingertip.phalanx.variant": ["original", "scaled"]}},
            (
                "sample.ranges.fingertip.phalanx.variant: got 'original', needs numbers or quantities; "
                "sweep what has no order"
            ),
        ),
        (
            {"ranges": {HEIGHT: [{"count": 500 * "9"}, "7 mm"]}},
            f"sample.ranges.{HEIGHT}: got {{'count': '{69 * '9'}..., needs numbers or quantities; sweep what",
        ),
        (
            {"ranges": {HEIGHT: [6, 7]}},
            f"sample.ranges.{HEIGHT}.0: '6' has no unit, needs a unit of [m]; write '6 mm' or '6 m'",
        ),
        (
            {"ranges": {"fingertip.sagitta.half_height": ["6 mm", "7 mm"]}},
            (
                "sample.ranges.fingertip.sagitta.half_height: is not known, needs the dotted path of a value of the "
                f"study; did you mean '{HEIGHT}'?"
            ),
        ),
        ({"ranges": {RATIO: [0.45, 0.6]}}, f"sample.ranges.{RATIO}.1: got 0.6, needs a number <= 0.5"),
        (
            {"ranges": {CLEARANCE: ["0 mm", "1 mm"]}, "equal": {HEIGHT: "contact.clearances"}},
            f"sample.equal.{HEIGHT}: got 'contact.clearances', needs one of contact.clearance",
        ),
        (
            {"equal": {HEIGHT: HEIGHT}},
            f"sample.equal.{HEIGHT}: is sampled itself, needs the path of a value without a range",
        ),
        (
            {"equal": {"fingertip.transverse.half_heigth": HEIGHT}},
            "sample.equal.fingertip.transverse.half_heigth: is not known",
        ),
    ],
)
def test_mistakes_are_named_with_their_repair(sample: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_study(finger(**sample), SOURCE)
    assert str(caught.value).startswith(f"studies/x.yaml: {message}")


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
    assert parse_study(study_mapping(study), SOURCE) == study
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
