"""Computing runs and writing their folders."""

from __future__ import annotations

import contextlib
import logging
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from fingerslip.dynamics.simulation import simulate, simulate_together
from fingerslip.errors import FingerslipError, InputError
from fingerslip.results import LOG
from fingerslip.storage.files import new_folder, writing
from fingerslip.study.running.build import locate_error
from fingerslip.study.running.plan import Job
from fingerslip.study.storage.store import BasisFolder, write_run

#: Folder of the reduced bases in the results of a study.
BASES = ".bases"

_LOG_FORMAT = "%(asctime)s %(levelname)s %(name)s: %(message)s"
_logger = logging.getLogger("fingerslip.study")


Tell = Callable[[str, float], None]


def compute_group(jobs: Sequence[Job], tell: Tell, threads: int) -> dict[str, FingerslipError | MemoryError]:
    """Compute jobs together, or in halves where that fails, so that only those fail that would fail alone.

    `tell` receives the name of a run and how much of it is done; returns what went wrong by the names of the runs.
    """

    def tell_all(fraction: float) -> None:
        for job in jobs:
            tell(job.run.name, fraction)

    try:
        compute(jobs, tell_all, threads)
    except (FingerslipError, MemoryError) as error:
        if len(jobs) == 1:
            return {jobs[0].run.name: error}
        half = len(jobs) // 2
        return compute_group(jobs[:half], tell, threads) | compute_group(jobs[half:], tell, threads)
    return {}


def compute(jobs: Sequence[Job], progress: Callable[[float], None], threads: int | None = None) -> None:
    """Simulate runs that share a matrix and write their folders, all whole or none."""
    with contextlib.ExitStack() as stack:
        folders = [stack.enter_context(new_folder(job.folder)) for job in jobs]
        with contextlib.ExitStack() as logs:
            for job, folder in zip(jobs, folders, strict=True):
                logs.enter_context(_log(folder / LOG))
                _logger.info("run %s of %s, identity %s", job.run.name, job.run.where, job.identity)
            started = time.perf_counter()
            histories = _simulate(jobs, progress, threads)
            seconds = time.perf_counter() - started
        for job, folder, history in zip(jobs, folders, histories, strict=True):
            with _log(folder / LOG):
                _logger.info("simulated %d records in %.1f s", history.sizes["time"], seconds)
                write_run(folder, job.run, history, inputs=job.identity, mesh=job.model.mesh, seconds=seconds)


def _simulate(jobs: Sequence[Job], progress: Callable[[float], None], threads: int | None) -> Sequence[Any]:
    bases = BasisFolder(jobs[0].folder.parent / BASES)
    try:
        if len(jobs) == 1:
            return [simulate(jobs[0].model, progress=progress, threads=threads, bases=bases)]
        return simulate_together([job.model for job in jobs], progress=progress, threads=threads, bases=bases)
    except InputError as error:
        raise locate_error(error, jobs[0].run.where, jobs[0].run.study) from None


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
