"""Runs side by side: every failure is told by the name of the run."""

from __future__ import annotations

import pickle
import queue
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fingerslip.errors import ConvergenceError, FingerslipError, ResultError
from fingerslip.report.page.content import RunPictures
from fingerslip.study.running import pool, together
from fingerslip.study.running.jobs import Computed
from fingerslip.study.running.pool import WorkerLostError, compute_all
from fingerslip.study.running.progress import SilentProgress
from unit.study.block import FRICTIONS

Write = Callable[..., Path]
NAMES = [f"friction_coefficient-{friction}" for friction in FRICTIONS]


class Telling(SilentProgress):
    """Keeps what it is told."""

    def __init__(self) -> None:
        self.told: list[tuple[Any, ...]] = []

    def begin(self, names: Any) -> None:
        self.told.append(("begin", *names))

    def advance(self, name: str, fraction: float) -> None:
        self.told.append((name, fraction))

    def finish(self, name: str, outcome: str) -> None:
        self.told.append((name, outcome))


def job(name: str) -> Any:
    small = SimpleNamespace(materials={}, mesh=SimpleNamespace(p=np.zeros((2, 9)), dim=lambda: 2))
    return SimpleNamespace(run=SimpleNamespace(name=name, where=f"x.yaml ({name})"), model=small)


NOT_SOLVED = ConvergenceError(0.5, 7, 1e-3, 1e-9, "use a smaller step")


def test_failures_in_this_process_are_kept_by_name_and_the_others_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    ends = {"a": NOT_SOLVED, "b": None, "c": MemoryError()}

    def compute(one: Any, progress: Callable[[float], None], threads: int) -> None:
        progress(0.5)
        if ends[one.run.name] is not None:
            raise ends[one.run.name]

    monkeypatch.setattr(together, "compute", compute)
    progress = Telling()
    failures = compute_all([job(name) for name in ends], 1, progress).failures
    assert failures["a"] is NOT_SOLVED
    assert isinstance(failures["c"], ResultError)
    assert str(failures["c"]) == "x.yaml (c): not enough memory; use larger elements or --workers 1"
    assert list(failures) == ["a", "c"]
    assert progress.told == [
        ("begin", "a", "b", "c"),
        *(("a", 0.5), ("a", "failed")),
        *(("b", 0.5), ("b", "done")),
        *(("c", 0.5), ("c", "failed")),
    ]


def test_what_is_no_error_of_the_package_ends_the_study(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(together, "compute", broken)
    with pytest.raises(ZeroDivisionError):
        compute_all([job("a")], 1, SilentProgress())


@pytest.mark.parametrize(("workers", "count", "apart"), [(1, 5, 0), (4, 1, 0), (4, 2, 2), (2, 5, 2)])
def test_no_more_processes_than_runs_and_none_for_a_single_one(
    monkeypatch: pytest.MonkeyPatch, workers: int, count: int, apart: int
) -> None:
    started: list[int] = []
    monkeypatch.setattr(together, "compute", lambda *_: None)
    monkeypatch.setattr(pool, "_compute_apart", lambda _, number, *__: started.append(number) or Computed())
    assert compute_all([job(str(number)) for number in range(count)], workers, SilentProgress()) == Computed()
    assert sum(started) == apart


def finished(outcome: BaseException | dict[str, Exception]) -> Future[Any]:
    future: Future[Any] = Future()
    if isinstance(outcome, dict):
        future.set_result((outcome, {"d": RunPictures()} if "d" in outcome else {}))
    else:
        future.set_exception(outcome)
    return future


def test_failures_of_workers_are_told_by_the_name_of_the_run() -> None:
    """Of the two runs that one worker computes together, one fails."""
    outcomes = {"ab": {"b": NOT_SOLVED}, "c": BrokenProcessPool(), "d": {"d": MemoryError()}}
    futures = {finished(outcome): [job(name) for name in names] for names, outcome in outcomes.items()}
    news: queue.Queue[tuple[str, float]] = queue.Queue()
    news.put(("a", 0.25))
    progress = Telling()
    computed = pool._follow(futures, news, progress)
    assert progress.told[0] == ("a", 0.25)
    assert set(progress.told[1:]) == {("a", "done"), ("b", "failed"), ("c", "failed"), ("d", "failed")}
    assert computed.pictures == {"d": RunPictures()}
    assert {name: type(error) for name, error in computed.failures.items()} == {
        "b": ConvergenceError,
        "c": WorkerLostError,
        "d": ResultError,
    }


def test_an_unknown_error_of_a_worker_is_raised() -> None:
    with pytest.raises(ZeroDivisionError):
        pool._follow({finished(ZeroDivisionError()): [job("a")]}, queue.Queue(), SilentProgress())


@pytest.mark.parametrize("stopping", [False, True])
def test_a_worker_tells_how_far_it_is_until_it_has_to_stop(monkeypatch: pytest.MonkeyPatch, stopping: bool) -> None:
    news: queue.Queue[tuple[str, float]] = queue.Queue()
    monkeypatch.setattr(pool, "_news", news)
    monkeypatch.setattr(pool, "_stop", SimpleNamespace(is_set=lambda: stopping))
    monkeypatch.setattr(pool, "_told", {})
    if stopping:
        with pytest.raises(pool._StoppedError):
            pool._tell("a", 0.5)
        assert news.empty()
    else:
        for fraction in (0.5, 0.51):
            pool._tell("a", fraction)
        pool._tell("b", 0.51)
        # The parent does not look again so soon.
        assert [news.get(), news.get()] == [("a", 0.5), ("b", 0.51)]
        assert news.empty()


def test_a_lost_worker_says_what_to_do_also_after_the_way_between_processes() -> None:
    error = pickle.loads(pickle.dumps(WorkerLostError()))
    assert isinstance(error, FingerslipError)
    assert "run the same command again with --workers 1" in str(error)
