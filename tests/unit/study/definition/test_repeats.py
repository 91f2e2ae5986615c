"""Repeats: what scatters from trial to trial."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.study.definition.runs import expand, expand_mapping
from fingerslip.study.definition.samples import RepeatSettings, scatter_values
from fingerslip.study.definition.spec import parse_study
from fingerslip.study.running.plan import plan_mapping
from unit.study.block import FRICTIONS, block_values

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
