"""Groups of runs side by side, each in a process of its own.

Workers do not import the user's script, and none outlives the process that started it.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import queue
import signal
import sys
import threading
import time
import types
from collections.abc import Generator, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import TYPE_CHECKING, Any

from fingerslip.errors import FingerslipError
from fingerslip.study.running.plan import Job, Outcome, groups
from fingerslip.study.running.progress import StudyProgress

if TYPE_CHECKING:
    from fingerslip.study.running.pictures import Drawing

_SECONDS_BETWEEN_LOOKS = 0.1


class WorkerLostError(FingerslipError):
    """A process that computed runs ended without saying why."""

    def __str__(self) -> str:
        return (
            "a process that computed runs was ended from outside, perhaps because there was not enough memory: "
            "finished runs are kept, the others need another try; run the same command again with --workers 1"
        )


class _StoppedError(Exception):
    """The study is being ended."""


def compute_all(
    jobs: Sequence[Job], workers: int, progress: StudyProgress, drawings: Mapping[str, Drawing]
) -> Generator[Outcome, None, None]:
    """Compute all jobs and yield what became of each group; one that fails does not keep the others from it."""
    job_groups = groups(jobs, workers)
    at_once = max(min(workers, len(job_groups)), 1)
    threads = workers // at_once
    if at_once > 1:
        yield from _compute_apart(job_groups, at_once, progress, threads, drawings)
        return
    from fingerslip.study.running.compute import compute_group

    for part in job_groups:
        yield Outcome(part, compute_group(part, progress.advance, threads))


def _compute_apart(
    job_groups: Sequence[Sequence[Job]],
    workers: int,
    progress: StudyProgress,
    threads: int,
    drawings: Mapping[str, Drawing],
) -> Generator[Outcome, None, None]:
    context = multiprocessing.get_context("spawn")
    news, stop = context.Queue(), context.Event()
    pool = ProcessPoolExecutor(workers, context, initializer=_begin_worker, initargs=(news, stop))
    try:
        with hold_interrupts(), without_main_module():
            # The workers start here. They inherit that Ctrl-C does not reach them: the parent alone answers it.
            futures = {pool.submit(_compute_in_worker, jobs, threads, drawings): jobs for jobs in job_groups}
        yield from _follow(futures, news, progress)
    finally:
        stop.set()
        pool.shutdown(wait=True, cancel_futures=True)
        news.close()


def _follow(
    futures: Mapping[Future[Any], Sequence[Job]], news: Any, progress: StudyProgress
) -> Generator[Outcome, None, None]:
    """Wait for all jobs and pass their progress on; what is no error of fingerslip is raised."""
    waiting = set(futures)
    while waiting:
        done, waiting = wait(waiting, timeout=_SECONDS_BETWEEN_LOOKS, return_when=FIRST_COMPLETED)
        with contextlib.suppress(queue.Empty):
            while True:
                progress.advance(*news.get_nowait())
        for future in done:
            jobs = futures[future]
            try:
                errors, pictures = future.result()
            except BrokenProcessPool:
                errors, pictures = {job.run.name: WorkerLostError() for job in jobs}, {}
            yield Outcome(jobs, errors, pictures)


@contextlib.contextmanager
def hold_interrupts() -> Iterator[None]:
    """Keep Ctrl-C from the block and from processes that start in it; where it can wait, it comes at the end."""
    if threading.current_thread() is not threading.main_thread():
        yield
    elif hasattr(signal, "pthread_sigmask"):
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
    else:
        handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, handler)


_news: Any = None
_stop: Any = None
_told: dict[str, float] = {}


def _begin_worker(news: Any, stop: Any) -> None:
    """Prepare a worker: the parent alone answers Ctrl-C, and no worker outlives the parent."""
    global _news, _stop
    _news, _stop = news, stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()


def _compute_in_worker(
    jobs: Sequence[Job], threads: int, drawings: Mapping[str, Drawing]
) -> tuple[Mapping[str, Exception], Mapping[str, Any]]:
    """Return what went wrong in jobs, and what was drawn of the others."""
    from fingerslip.study.running.compute import compute_group
    from fingerslip.study.running.pictures import draw_runs

    errors = compute_group(jobs, _tell, threads)
    return errors, draw_runs([job for job in jobs if job.run.name not in errors], drawings, _stop.is_set)


def _tell(name: str, fraction: float) -> None:
    """Tell how far a run is, no more often than the parent looks: a message takes as long as a part of a step."""
    now = time.monotonic()
    if now - _told.get(name, -_SECONDS_BETWEEN_LOOKS) < _SECONDS_BETWEEN_LOOKS:
        return
    if _stop.is_set():
        raise _StoppedError
    _told[name] = now
    _news.put((name, fraction))


def end_with_parent() -> None:
    """End this process as soon as the one that started it has ended, however that was, and whatever it computes."""
    threading.Thread(target=_wait_for_parent, daemon=True).start()


def _wait_for_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@contextlib.contextmanager
def without_main_module() -> Iterator[None]:
    """Start processes in the block that do not import the main module of this one.

    A process that multiprocessing spawns imports the main module of its parent first. A script without
    ``if __name__ == "__main__":`` would so run its study once more in every worker, and a script that is read from
    standard input has no file to import. Jobs need nothing of the main module: all they hold is the package's.
    """
    main = sys.modules["__main__"]
    sys.modules["__main__"] = types.ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main
