"""Computing runs side by side, each in a process of its own."""

from __future__ import annotations

import contextlib
import multiprocessing
import queue
import signal
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from fingerslip.errors import FingerslipError, ResultError
from fingerslip.study.running.jobs import Computed, Job, groups
from fingerslip.study.running.pictures import Drawing, draw_runs
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.running.spawning import end_with_parent, without_main_module
from fingerslip.study.running.together import compute_group

__all__ = ["WorkerLostError", "compute_all"]

_SECONDS_BETWEEN_LOOKS = 0.1

Failures = dict[str, FingerslipError]
_Found = tuple[Mapping[str, Exception], Mapping[str, Any]]


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
    jobs: Sequence[Job], workers: int, progress: StudyProgress, drawings: Mapping[str, Drawing] | None = None
) -> Computed:
    """Compute all jobs; one that fails does not keep the others from being computed."""
    progress.begin([job.run.name for job in jobs])
    job_groups = groups(jobs, workers)
    at_once = max(min(workers, len(job_groups)), 1)
    threads = workers // at_once
    if at_once == 1:
        return Computed(_compute_here(job_groups, progress, threads))
    return _compute_apart(job_groups, at_once, progress, threads, drawings or {})


def _compute_here(job_groups: Sequence[Sequence[Job]], progress: StudyProgress, threads: int) -> Failures:
    failures: Failures = {}
    for jobs in job_groups:
        outcome = compute_group(jobs, progress.advance, threads)
        failures |= _report(jobs, outcome, progress)
    return failures


def _report(jobs: Sequence[Job], errors: Mapping[str, Exception], progress: StudyProgress) -> Failures:
    """Report jobs as done or failed, and return the errors to keep."""
    failures: Failures = {}
    for job in jobs:
        error = errors.get(job.run.name)
        if error is not None:
            failures[job.run.name] = error if isinstance(error, FingerslipError) else _out_of_memory(job)
        progress.finish(job.run.name, "failed" if error else "done")
    return failures


def _compute_apart(
    job_groups: Sequence[Sequence[Job]],
    workers: int,
    progress: StudyProgress,
    threads: int,
    drawings: Mapping[str, Drawing],
) -> Computed:
    context = multiprocessing.get_context("spawn")
    news, stop = context.Queue(), context.Event()
    pool = ProcessPoolExecutor(workers, context, initializer=_begin_worker, initargs=(news, stop))
    try:
        with _ignore_interrupts(), without_main_module():
            # The workers start here. They inherit the ignored Ctrl-C, which the parent alone answers.
            futures = {pool.submit(_compute_in_worker, jobs, threads, drawings): jobs for jobs in job_groups}
        return _follow(futures, news, progress)
    finally:
        stop.set()
        pool.shutdown(wait=True, cancel_futures=True)
        news.close()


def _follow(futures: Mapping[Future[Any], Sequence[Job]], news: Any, progress: StudyProgress) -> Computed:
    """Wait for all jobs and pass their progress on."""
    computed = Computed()
    waiting = set(futures)
    while waiting:
        done, waiting = wait(waiting, timeout=_SECONDS_BETWEEN_LOOKS, return_when=FIRST_COMPLETED)
        _pass_on(news, progress)
        for future in done:
            outcome, pictures = _outcome_of(future, futures[future])
            computed.failures.update(_report(futures[future], outcome, progress))
            computed.pictures.update(pictures)
    return computed


def _pass_on(news: Any, progress: StudyProgress) -> None:
    with contextlib.suppress(queue.Empty):
        while True:
            name, fraction = news.get_nowait()
            progress.advance(name, fraction)


def _outcome_of(future: Future[_Found], jobs: Sequence[Job]) -> _Found:
    """Return what went wrong in a worker's jobs, and what it drew; what is no error of fingerslip is raised."""
    try:
        return future.result()
    except BrokenProcessPool:
        return {job.run.name: WorkerLostError() for job in jobs}, {}


def _out_of_memory(job: Job) -> ResultError:
    return ResultError(f"{job.run.where}: not enough memory; use larger elements or --workers 1")


@contextlib.contextmanager
def _ignore_interrupts() -> Iterator[None]:
    """Ignore Ctrl-C in the block, where signals can be handled at all."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


_news: Any = None
_stop: Any = None
_told: dict[str, float] = {}


def _begin_worker(news: Any, stop: Any) -> None:
    """Prepare a worker: the parent alone answers Ctrl-C, and no worker outlives the parent."""
    global _news, _stop
    _news, _stop = news, stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()


def _compute_in_worker(jobs: Sequence[Job], threads: int, drawings: Mapping[str, Drawing]) -> _Found:
    outcome = compute_group(jobs, _tell, threads)
    return outcome, draw_runs([job for job in jobs if job.run.name not in outcome], drawings, _stop.is_set)


def _tell(name: str, fraction: float) -> None:
    """Tell how far a run is, no more often than the parent looks: a message takes as long as a part of a step."""
    now = time.monotonic()
    if now - _told.get(name, -_SECONDS_BETWEEN_LOOKS) < _SECONDS_BETWEEN_LOOKS:
        return
    if _stop.is_set():
        raise _StoppedError
    _told[name] = now
    _news.put((name, fraction))
