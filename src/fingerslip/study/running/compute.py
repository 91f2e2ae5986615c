"""Computing one run and writing its folder."""

from __future__ import annotations

import contextlib
import logging
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fingerslip.digest import digest
from fingerslip.dynamics.simulation import simulate, simulate_together
from fingerslip.errors import InputError
from fingerslip.files import json_text, new_folder, write_text, writing
from fingerslip.history import write_history
from fingerslip.model import Model
from fingerslip.slip import acceleration_peaks, events_mapping, find_events
from fingerslip.study.definition.sweep import Run
from fingerslip.study.definition.yaml import write_mapping
from fingerslip.study.running.build import located
from fingerslip.study.storage.numbers import key_numbers
from fingerslip.study.storage.provenance import versions
from fingerslip.study.storage.snapshots import write_snapshots

__all__ = ["Job", "compute", "compute_together", "mesh_hash", "mesh_size"]

_LOG_FORMAT = "%(asctime)s %(levelname)s %(name)s: %(message)s"
_logger = logging.getLogger("fingerslip.study")


@dataclass(frozen=True)
class Job:
    """A run with its model, ready to be computed.

    Parameters
    ----------
    run : Run
        The run.
    model : Model
        Its model.
    identity : str
        Hash of its inputs.
    folder : Path
        Where its results go.
    """

    run: Run
    model: Model
    identity: str
    folder: Path


def compute(job: Job, progress: Callable[[float], None], threads: int | None = None) -> None:
    """Simulate a run and write its folder, whole or not at all.

    Parameters
    ----------
    job : Job
        What to compute.
    progress : callable
        Receives the fraction done, from 0 to 1; what it raises ends the run.
    threads : int, optional
        Threads to use at most; see :func:`fingerslip.dynamics.simulation.simulate`.

    Raises
    ------
    InputError
        Where contact leaves its candidates.
    ConvergenceError
        Where the contact of a step was not solved.
    ResultError
        Where the folder cannot be written.
    """
    compute_together([job], progress, threads)


def compute_together(jobs: Sequence[Job], progress: Callable[[float], None], threads: int | None = None) -> None:
    """Simulate runs that share a matrix and write their folders, all whole or none; see :func:`compute`.

    Parameters
    ----------
    jobs : sequence of Job
        What to compute.
    progress : callable
        Receives the fraction done of all of them, from 0 to 1; what it raises ends the runs.
    threads : int, optional
        Threads to use at most.
    """
    with contextlib.ExitStack() as stack:
        folders = [stack.enter_context(new_folder(job.folder)) for job in jobs]
        with contextlib.ExitStack() as logs:
            for job, folder in zip(jobs, folders, strict=True):
                logs.enter_context(_log(folder / "log.txt"))
                _logger.info("run %s of %s, identity %s", job.run.name, job.run.where, job.identity)
            started = time.perf_counter()
            histories = _simulate(jobs, progress, threads)
            seconds = time.perf_counter() - started
        for job, folder, history in zip(jobs, folders, histories, strict=True):
            _write(job, folder, history, seconds)


def _write(job: Job, folder: Path, history: Any, seconds: float) -> None:
    with _log(folder / "log.txt"):
        _logger.info("simulated %d records in %.1f s", history.sizes["time"], seconds)
        for name, value in (history.attrs | key_numbers(history)).items():
            _logger.info("%s: %s", name, value)
        write_history(history, folder / "history.nc")
        with writing(folder):
            write_mapping(job.run.resolved(), folder / "run.yaml", comment="fingerslip run run.yaml repeats this run")
            write_snapshots(history, folder)
        write_text(folder / "events.json", json_text(_result(job, history, seconds)))


def mesh_hash(mesh: Any) -> str:
    """Return a hash of the points and cells of a mesh."""
    return digest(mesh.p, mesh.t)


def mesh_size(mesh: Any) -> float:
    """Return the representative element size N^(-1/dim) of a mesh of N cells, for the ratio of two meshes of a body."""
    return float(mesh.t.shape[1] ** (-1.0 / mesh.dim()))


def _simulate(jobs: Sequence[Job], progress: Callable[[float], None], threads: int | None) -> Sequence[Any]:
    try:
        if len(jobs) == 1:
            return [simulate(jobs[0].model, progress=progress, threads=threads)]
        return simulate_together([job.model for job in jobs], progress=progress, threads=threads)
    except InputError as error:
        raise located(error, jobs[0].run.where, jobs[0].run.study) from None


def _result(job: Job, history: Any, seconds: float) -> Mapping[str, Any]:
    table = acceleration_peaks(history)
    return {
        "run": job.run.name,
        "identity": job.identity,
        "swept": dict(job.run.swept),
        "events_s": events_mapping(find_events(history)),
        "acceleration_peaks": [
            {"time_s": peak.time, "height_m_per_s2": peak.height, "prominence_m_per_s2": peak.prominence}
            for peak in table.peaks
        ],
        "numbers": key_numbers(history),
        "mesh_hash": mesh_hash(job.model.mesh),
        "mesh_size": mesh_size(job.model.mesh),
        "wall_time_s": round(seconds, 3),
        "versions": versions(),
    }


@contextlib.contextmanager
def _log(path: Path) -> Iterator[None]:
    """Write what the package logs to a file."""
    logger = logging.getLogger("fingerslip")
    with writing(path):
        handler = logging.FileHandler(path, encoding="utf-8")
    handler.setFormatter(logging.Formatter(_LOG_FORMAT))
    level = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.setLevel(level)
        logger.removeHandler(handler)
        handler.close()
