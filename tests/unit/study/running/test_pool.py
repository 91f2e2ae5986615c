"""Runs side by side: which are computed together, and every failure told by the name of the run."""

from __future__ import annotations

import dataclasses
import os
import pickle
import queue
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import fingerslip as fs
from fingerslip.dynamics.step import sharing
from fingerslip.errors import ConvergenceError, FingerslipError, ResultError
from fingerslip.report.content import RunPictures
from fingerslip.study.running import compute, cost, pool
from fingerslip.study.running.compute import compute_group
from fingerslip.study.running.plan import Computed, Outcome, groups
from fingerslip.study.running.pool import WorkerLostError, compute_all, without_main_module
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.running.runner import compute_jobs
from problems.pushed import push_and_slide
from unit.study.told import Told


def job(name: str, model: Any = None, folder: Path = Path("none")) -> Any:
    run = SimpleNamespace(name=name, where=f"x.yaml ({name})")
    return SimpleNamespace(run=run, model=model or push_and_slide(), folder=folder / name)


def names(parts: Sequence[Sequence[Any]]) -> list[str]:
    return ["".join(job.run.name for job in part) for part in parts]


NOT_SOLVED = ConvergenceError(0.5, 7, 1e-3, 1e-9, "use a smaller step")


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
    ("bytes_together", "at_once", "together_are", "parts"),
    [
        (1.0, 1, "abcdefgh", ["abcdefgh"]),
        (1.0, 1, "abcdefghij", ["abcde", "fghij"]),
        (1.0, 1, "a", ["a"]),
        (1e9, 1, "abcdefghij", ["abcdefghij"]),
        (1e9, 2, "abcd", ["ab", "cd"]),
        (1e9, 1, "a" * 40, ["a" * 20] * 2),
    ],
)
def test_no_group_is_too_large_and_all_workers_are_busy(
    bytes_together: float, at_once: int, together_are: str, parts: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cost, "_BYTES_TOGETHER", bytes_together)
    assert names(groups([job(name) for name in together_are], at_once)) == parts


def test_small_runs_stay_apart() -> None:
    assert names(groups([job("a"), job("b")])) == ["a", "b"]


@pytest.mark.parametrize("error", [NOT_SOLVED, MemoryError()])
def test_where_a_group_fails_its_halves_are_computed(monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    tried: list[str] = []

    def failing(jobs: Sequence[Any], progress: Callable[[float], None], _: int) -> None:
        tried.append("".join(one.run.name for one in jobs))
        if len(jobs) > 1:
            raise error
        progress(1.0)
        if tried[-1] == "b":
            raise error

    monkeypatch.setattr(compute, "compute", failing)
    told: list[tuple[str, float]] = []
    errors = compute_group([job(name) for name in "abc"], lambda name, fraction: told.append((name, fraction)), 1)
    assert errors == {"b": error}
    assert tried == ["abc", "a", "bc", "b", "c"]
    assert told == [("a", 1.0), ("b", 1.0), ("c", 1.0)]


def test_failures_are_kept_by_name_and_the_others_go_on(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    ends = {"a": NOT_SOLVED, "b": None, "c": MemoryError()}

    def compute_one(jobs: Any, progress: Callable[[float], None], _: int) -> None:
        progress(0.5)
        if ends[jobs[0].run.name] is not None:
            raise ends[jobs[0].run.name]

    monkeypatch.setattr(compute, "compute", compute_one)
    progress = Told()
    plan: Any = SimpleNamespace(folder=tmp_path)
    jobs = [job(name, folder=tmp_path) for name in ends]
    failures = compute_jobs(plan, jobs, lambda *given: compute_all(given[0], 1, *given[1:]), progress).failures
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
    assert compute_jobs(plan, [], 1, progress) == Computed()


def test_what_is_no_error_of_the_package_ends_the_study(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(compute, "compute", broken)
    with pytest.raises(ZeroDivisionError):
        list(compute_all([job("a")], 1, StudyProgress(), {}))


@pytest.mark.parametrize(("workers", "count", "apart"), [(1, 5, 0), (4, 1, 0), (4, 2, 2), (2, 5, 2)])
def test_no_more_processes_than_runs_and_none_for_a_single_one(
    monkeypatch: pytest.MonkeyPatch, workers: int, count: int, apart: int
) -> None:
    started: list[int] = []
    monkeypatch.setattr(compute, "compute", lambda *_: None)
    monkeypatch.setattr(pool, "_compute_apart", lambda _, number, *__: started.append(number) or ())
    outcomes = list(compute_all([job(str(number)) for number in range(count)], workers, StudyProgress(), {}))
    assert all(outcome.errors == {} for outcome in outcomes)
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
    ends = {"ab": {"b": NOT_SOLVED}, "c": BrokenProcessPool(), "d": {"d": MemoryError()}}
    futures = {finished(end): [job(name) for name in together] for together, end in ends.items()}
    news: queue.Queue[tuple[str, float]] = queue.Queue()
    news.put(("a", 0.25))
    progress = Told()
    outcomes: list[Outcome] = list(pool._follow(futures, news, progress))
    assert progress.told == [("a", 0.25)]
    errors = {name: type(error) for outcome in outcomes for name, error in outcome.errors.items()}
    assert errors == {"b": ConvergenceError, "c": WorkerLostError, "d": MemoryError}
    assert sorted(names([outcome.jobs for outcome in outcomes])) == ["ab", "c", "d"]
    assert [outcome.pictures for outcome in outcomes if outcome.pictures] == [{"d": RunPictures()}]


def test_an_unknown_error_of_a_worker_is_raised() -> None:
    with pytest.raises(ZeroDivisionError):
        list(pool._follow({finished(ZeroDivisionError()): [job("a")]}, queue.Queue(), StudyProgress()))


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


def test_the_main_module_is_there_again_behind_the_block() -> None:
    main = sys.modules["__main__"]
    with without_main_module():
        assert sys.modules["__main__"] is not main
        assert not hasattr(sys.modules["__main__"], "__file__")
    assert sys.modules["__main__"] is main
    with pytest.raises(ZeroDivisionError), without_main_module():
        raise ZeroDivisionError
    assert sys.modules["__main__"] is main


# Its worker says who it is and would then wait for an hour.
PARENT = """
import multiprocessing, os, signal, time
from concurrent.futures import ProcessPoolExecutor
from fingerslip.study.running.pool import without_main_module
from fingerslip.study.trials.simulate import _begin_worker
pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), initializer=_begin_worker, initargs=((),))
with without_main_module():
    first, _ = pool.submit(os.getpid), pool.submit(time.sleep, 3600.0)
print(first.result(), flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")
def test_a_worker_of_a_killed_process_ends() -> None:
    """The pipe to this process is closed when the last of both has ended."""
    with subprocess.Popen([sys.executable, "-c", PARENT], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        worker = int(parent.stdout.readline())
        try:
            parent.communicate(timeout=60.0)
        except subprocess.TimeoutExpired:
            os.kill(worker, signal.SIGKILL)
            raise
    assert parent.returncode == -signal.SIGKILL


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_while_workers_start_is_not_lost() -> None:
    """A signal goes to any thread that does not block it, so that it may come before the end of the block."""
    with pytest.raises(KeyboardInterrupt), pool.hold_interrupts():
        os.kill(os.getpid(), signal.SIGINT)
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())
