"""Jobs computed, in this process or in several side by side, and their folders written.

Each of several processes computes groups of runs. Workers do not import the user's script, and none outlives the
process that started it. Who has computed a run draws it, with the mesh that it has, so that a study never uses more
processes than it was given. What is drawn stays in memory until the report is written; a picture that cannot be drawn
is left to the report, which then says why.
"""

from __future__ import annotations

import contextlib
import logging
import multiprocessing
import os
import queue
import shutil
import signal
import sys
import threading
import time
import types
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from fingerslip.errors import ConvergenceError, FingerslipError, ResultError
from fingerslip.history import write_history
from fingerslip.libraries import xr
from fingerslip.results import HISTORY, LOG, RunResult, failure_folder
from fingerslip.storage.files import new_folder, writing
from fingerslip.study.definition.runs import Plan
from fingerslip.study.running.build import Job, groups, name_errors
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.storage.store import BasisFolder, write_run

if TYPE_CHECKING:
    from fingerslip.report.content import RunPictures

#: Folder of the reduced bases in the results of a study.
BASES = ".bases"

_LOG_FORMAT = "%(asctime)s %(levelname)s %(name)s: %(message)s"
_logger = logging.getLogger("fingerslip.study")


@dataclass(frozen=True)
class Outcome:
    """What became of jobs that were computed together."""

    jobs: Sequence[Job]  # the jobs
    errors: Mapping[str, Exception]  # what went wrong, by the name of the run
    pictures: Mapping[str, RunPictures] = field(default_factory=dict)  # what was drawn already


#: A run whose folder is written: its result, without its values, and its history.
Finished: TypeAlias = "tuple[RunResult, xr.Dataset]"


def compute_group(
    jobs: Sequence[Job],
    tell: Callable[[str, float], None],
    threads: int,
    show: Callable[[Finished], None] = lambda _: None,
) -> dict[str, Exception]:
    """Compute jobs together, or in halves where that fails; return what went wrong, by run.

    `tell` receives the name of a run and how much of it is done, `show` every finished run before others are computed:
    none is held where there was no memory for all.
    """

    def tell_all(fraction: float) -> None:
        for job in jobs:
            tell(job.run.name, fraction)

    try:
        finished = compute(jobs, tell_all, threads)
    except (FingerslipError, MemoryError) as error:
        if len(jobs) == 1:
            return {jobs[0].run.name: error}
    else:
        for run in finished:
            show(run)
        return {}
    # Behind the clause, whose error holds all that the group had in memory.
    halves = jobs[: len(jobs) // 2], jobs[len(jobs) // 2 :]
    return {name: error for half in halves for name, error in compute_group(half, tell, threads, show).items()}


def compute(jobs: Sequence[Job], progress: Callable[[float], None], threads: int | None = None) -> list[Finished]:
    """Simulate runs that share a matrix and write their folders, all whole or none."""
    finished = []
    with contextlib.ExitStack() as stack:
        folders = [stack.enter_context(new_folder(job.folder)) for job in jobs]
        with contextlib.ExitStack() as logs:
            for job, folder in zip(jobs, folders, strict=True):
                logs.enter_context(_log(folder / LOG))
                _logger.info("run %s of %s, identity %s", job.run.name, job.run.where, job.identity)
                if job.run.mesh_copy:
                    _logger.info("mesh %s, a copy of %s", job.run.mesh_copy, job.run.plain_values["mesh"]["file"])
            started = time.perf_counter()
            try:
                histories = _simulate(jobs, folders, progress, threads)
            except ConvergenceError as error:
                _write_failure(jobs, folders, error)
                raise
            seconds = time.perf_counter() - started
        for job, folder, history in zip(jobs, folders, histories, strict=True):
            with _log(folder / LOG):
                _logger.info("simulated %d records in %.1f s", history.sizes["time"], seconds)
                doubts = tuple(doubt.text for doubt in job.doubts if not doubt.is_measured)
                about = {"inputs": job.identity, "mesh": job.model.mesh, "seconds": seconds, "doubts": doubts}
                finished.append((write_run(folder, job.run, history, **about), history))
    return finished


def _write_failure(jobs: Sequence[Job], folders: Sequence[Path], error: ConvergenceError) -> None:
    """Write history and log of a run that failed beside its folder, where nothing takes them for a result."""
    history, error.history = error.history, None
    if len(jobs) == 1 and history is not None and not jobs[0].run.study.reaction:
        _logger.error("%s", error)
        with contextlib.suppress(ResultError, OSError), new_folder(failure_folder(jobs[0].folder)) as folder:
            write_history(history, folder / HISTORY)
            shutil.copyfile(folders[0] / LOG, folder / LOG)


def _simulate(
    jobs: Sequence[Job], folders: Sequence[Path], progress: Callable[[float], None], threads: int | None
) -> Sequence[Any]:
    # The process that only waits for others loads nothing that computes.
    from fingerslip.dynamics.simulation import simulate, simulate_together

    bases = BasisFolder(jobs[0].folder.parent / BASES)
    reaction, held = jobs[0].run.study.reaction, jobs[0].run.study.held_object
    with name_errors(jobs[0].run):
        if reaction is not None and held is not None:
            from fingerslip.react.run import compute_reactions

            return [compute_reactions(reaction, held, jobs[0].model, folders[0], bases=bases, progress=progress)]
        if len(jobs) == 1:
            return [simulate(jobs[0].model, progress=progress, threads=threads, bases=bases)]
        return simulate_together([job.model for job in jobs], progress=progress, threads=threads, bases=bases)


class _LogFile(logging.FileHandler):
    """A log that ends the run where it cannot be written, as on a full disk; logging itself prints a traceback."""

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: ARG002, N802  the name is that of logging
        """Raise what went wrong."""
        with writing(Path(self.baseFilename)):
            raise  # noqa: PLE0704  called while an error is handled


@contextlib.contextmanager
def _log(path: Path) -> Iterator[None]:
    """Write what the package logs to a file."""
    logger = logging.getLogger("fingerslip")
    with writing(path):
        handler = _LogFile(path, encoding="utf-8")
    handler.setFormatter(logging.Formatter(_LOG_FORMAT))
    level = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.setLevel(level)
        logger.removeHandler(handler)
        with writing(path):
            handler.close()


_SECONDS_BETWEEN_LOOKS = 0.1
# Time that a worker has for the step in which it is told to stop.
_SECONDS_TO_STOP = 60.0


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
    for part in job_groups:
        yield Outcome(part, *_compute_and_draw(part, threads, drawings, progress.advance))


def _compute_and_draw(
    jobs: Sequence[Job], threads: int, drawings: Mapping[str, Drawing], tell: Callable[[str, float], None]
) -> tuple[Mapping[str, Exception], Mapping[str, RunPictures]]:
    """Return what went wrong in jobs, and what was drawn of the others."""
    pictures: dict[str, RunPictures] = {}

    def draw(run: Finished) -> None:
        (result, history), drawing = run, drawings.get(run[0].name)
        if drawing is None or (_stop and _stop.value):
            return
        # Whatever goes wrong here goes wrong in the report too, which tells the user.
        with contextlib.suppress(Exception):
            # What draws is slow to import, and a worker of a sweep mostly draws nothing.
            from fingerslip.report.content import RunSubject
            from fingerslip.report.labels import run_title
            from fingerslip.report.page.pictures import draw_ahead

            title = run_title(result, "the run")
            subject = RunSubject(history, result.events, name=result.name, title=title)
            pictures[result.name] = draw_ahead(subject, contact=drawing.contact, model=drawing.model)

    return compute_group(jobs, tell, threads, draw), pictures


def _compute_apart(
    job_groups: Sequence[Sequence[Job]],
    workers: int,
    progress: StudyProgress,
    threads: int,
    drawings: Mapping[str, Drawing],
) -> Generator[Outcome, None, None]:
    prepare_workers()
    context = multiprocessing.get_context(_METHOD)
    # A plain number has no lock, with which a worker might end.
    news, stop = context.Queue(), context.RawValue("b", 0)
    pool = ProcessPoolExecutor(workers, context, initializer=_begin_worker, initargs=(news, stop))
    try:
        with hold_interrupts(), without_main_module():
            # The workers start here. They inherit that Ctrl-C does not reach them: the parent alone answers it.
            futures = {pool.submit(_compute_and_draw, jobs, threads, drawings, _tell): jobs for jobs in job_groups}
        yield from _follow(futures, news, progress)
    finally:
        stop.value = 1
        pool.shutdown(wait=True, cancel_futures=True)
        news.close()


def in_worker(function: Callable[..., None], *arguments: Any) -> None:
    """Call a function in a process like those that compute, which has loaded what draws."""
    context = multiprocessing.get_context(_METHOD)
    with ProcessPoolExecutor(1, context, initializer=_begin_worker, initargs=(None, context.RawValue("b", 0))) as pool:
        with hold_interrupts(), without_main_module():
            future = pool.submit(function, *arguments)
        try:
            future.result()
        except BrokenProcessPool:
            raise WorkerLostError from None


# What macOS computes with does not bear to be forked.
_METHOD = "forkserver" if sys.platform == "linux" else "spawn"


def prepare_workers() -> None:
    """Begin to load what workers need, in a process that they are forked from, where the system bears that."""
    if _METHOD == "forkserver":
        # Windows does not have the module.
        from multiprocessing import forkserver

        forkserver.set_forkserver_preload(["fingerslip.study.running.preload"])
        with hold_interrupts():
            forkserver.ensure_running()


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
    """Keep Ctrl-C from the block and from processes that start in it; it comes at the end."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    handler = signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    # Processes inherit the mask. It does not keep a signal from other threads, which Python would answer here.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if hasattr(signal, "pthread_sigmask") else None
    try:
        yield
    finally:
        if before is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        signal.signal(signal.SIGINT, handler or signal.SIG_DFL)
        if came:
            signal.raise_signal(signal.SIGINT)


# What a worker tells its parent through, what tells it to stop, and when it has told of each run.
_news: Any = None
_stop: Any = None
_told: dict[str, float] = {}


def _begin_worker(news: Any, stop: Any) -> None:
    """Prepare a worker: the parent alone answers Ctrl-C, and no worker outlives the parent."""
    global _news, _stop
    _news, _stop = news, stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()

    def wait_for_stop() -> None:
        while not stop.value:
            time.sleep(_SECONDS_BETWEEN_LOOKS)
        time.sleep(_SECONDS_TO_STOP)
        os._exit(1)

    # A worker that waits for jobs which nobody hands out any more would be waited for as well.
    threading.Thread(target=wait_for_stop, daemon=True).start()


def _tell(name: str, fraction: float) -> None:
    """Tell how far a run is, no more often than the parent looks: a message takes as long as a part of a step."""
    now = time.monotonic()
    if now - _told.get(name, -_SECONDS_BETWEEN_LOOKS) < _SECONDS_BETWEEN_LOOKS:
        return
    if _stop.value:
        raise _StoppedError
    _told[name] = now
    _news.put((name, fraction))


def end_with_parent() -> None:
    """End this process as soon as the one that started it has ended, however that was, and whatever it computes."""
    parent = multiprocessing.parent_process()

    def wait_for_parent() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=wait_for_parent, daemon=True).start()


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


@dataclass(frozen=True)
class Drawing:
    """What a report will show of a run alone."""

    contact: bool  # whether the run is shown in detail
    model: bool  # whether its model is shown at the start


def drawings_of(plan: Plan, jobs: Sequence[Job]) -> dict[str, Drawing]:
    """Return what to draw of runs that are to be computed, by their names; nothing of samples.

    A report shows its first runs in detail, of many the first one, and the model of the first run with each mesh.
    """
    from fingerslip.report.content import detailed_of

    if plan.study.sample or plan.study.reaction:
        return {}
    first = {run.name for run in plan.runs[: detailed_of(len(plan.runs))]}
    models = {id(job.model.mesh): job.run.name for job in reversed(jobs)}.values()
    named = {job.run.name: Drawing(job.run.name in first, job.run.name in models) for job in jobs}
    return {name: drawing for name, drawing in named.items() if drawing.contact or drawing.model}
