"""Of runs that are computed together, one that fails does not keep the others from being computed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any

import pytest

import fingerslip as fs
from fingerslip.study.running import together
from fingerslip.study.running.together import compute_group
from problems.pushed import push_and_slide


def job(name: str, model: Any = None) -> Any:
    return SimpleNamespace(run=SimpleNamespace(name=name), model=model or push_and_slide())


NOT_SOLVED = fs.ConvergenceError(0.5, 7, 1e-3, 1e-9, "use a smaller step")


@pytest.mark.parametrize("error", [NOT_SOLVED, MemoryError()])
def test_where_a_group_fails_its_halves_are_computed(monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    alone: list[str] = []
    failed: list[str] = []

    def failing(jobs: Sequence[Any], *_: object) -> None:
        failed.append("".join(one.run.name for one in jobs))
        raise error

    def compute(one: Any, progress: Callable[[float], None], threads: int) -> None:
        progress(1.0)
        alone.append(one.run.name)
        if one.run.name == "b":
            raise error

    monkeypatch.setattr(together, "compute_together", failing)
    monkeypatch.setattr(together, "compute", compute)
    told: list[tuple[str, float]] = []
    found = compute_group([job(name) for name in "abc"], lambda name, fraction: told.append((name, fraction)), 1)
    assert found == {"b": error}
    assert (failed, alone) == (["abc", "bc"], ["a", "b", "c"])
    assert told == [("a", 1.0), ("b", 1.0), ("c", 1.0)]
