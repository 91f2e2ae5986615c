"""Large runs that share a matrix make groups; what is finished needs nothing that computes."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest

import fingerslip as fs
from fingerslip.dynamics.step import sharing
from fingerslip.study.running import cost
from fingerslip.study.running.jobs import groups
from problems.pushed import push_and_slide


def job(name: str, model: Any = None) -> Any:
    return SimpleNamespace(run=SimpleNamespace(name=name), model=model or push_and_slide())


def names(parts: Sequence[Sequence[Any]]) -> list[str]:
    return ["".join(job.run.name for job in part) for part in parts]


@pytest.fixture
def all_are_large(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sharing, "_WORTH_SHARING", {2: 0, 3: 0})


@pytest.mark.usefixtures("all_are_large")
def test_runs_that_share_a_matrix_make_a_group() -> None:
    model = push_and_slide()
    stiff = dataclasses.replace(model, materials={"bulk": fs.Elastic(1e6, 0.3, 1000.0)})
    jobs = [job("a", model), job("b", stiff), job("c", push_and_slide(friction=0.9)), job("d", stiff)]
    assert names(groups(jobs)) == ["ac", "bd"]


@pytest.mark.usefixtures("all_are_large")
@pytest.mark.parametrize(
    ("together_are", "parts"), [("abcdefgh", ["abcdefgh"]), ("abcdefghij", ["abcde", "fghij"]), ("a", ["a"])]
)
def test_no_group_is_too_large(together_are: str, parts: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cost, "_BYTES_TOGETHER", 1.0)
    assert names(groups([job(name) for name in together_are])) == parts


@pytest.mark.usefixtures("all_are_large")
def test_runs_with_small_records_make_a_larger_group() -> None:
    assert names(groups([job(name) for name in "abcdefghij"])) == ["abcdefghij"]
    assert {len(part) for part in groups([job("a") for _ in range(40)])} == {20}


@pytest.mark.usefixtures("all_are_large")
def test_runs_in_the_plane_keep_all_workers_busy() -> None:
    assert names(groups([job(name) for name in "abcd"], 2)) == ["ab", "cd"]


def test_small_runs_stay_apart() -> None:
    assert names(groups([job("a"), job("b")])) == ["a", "b"]
