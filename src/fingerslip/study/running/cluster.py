"""Computing runs on a Dask cluster: the workers compute, this process alone writes the results.

A worker gets the runs of a group and their mesh, computes them in a folder of its own, and returns the files. So no
disk has to be shared, a worker that dies leaves nothing behind, and what a finished run is, is decided in one place.
The scheduler gives what a dead worker had begun to another one; what was written is never asked for again. A worker of
another version that joins later is sent away, and what it was given goes to the others.
"""

from __future__ import annotations

import contextlib
import importlib
import itertools
import logging
import re
import sys
import tempfile
import threading
from collections.abc import Generator, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from importlib import metadata
from pathlib import Path
from typing import Any

from fingerslip.errors import FingerslipError, InputError, ResultError, optional_module
from fingerslip.results import stored_result
from fingerslip.storage.files import new_folder, writing
from fingerslip.study.definition.runs import Run
from fingerslip.study.running.build import Job, build_model, groups
from fingerslip.study.running.compute import Outcome, compute_group
from fingerslip.study.running.progress import StudyProgress

# Groups that wait for each core of the cluster, so that no worker waits for this process.
_AHEAD = 2
_SECONDS_TO_CONNECT = 20
# Dask takes other text for a host, and leaves threads that fail when the process ends.
_ADDRESS = re.compile(r"(?:tcp|tls|wss?|ucx)://\S+:\d+|inproc://\S+")
_SAME, _REPAIR = "needs the same version", "install the same environment on the cluster"
_KILLED = "the workers that computed it died again and again, perhaps because there was not enough memory"
# Several threads of one worker would share its logs and limits.
_ONE_AT_A_TIME = threading.Lock()

_Outcome = Mapping[str, Mapping[str, bytes] | Exception]


class SchedulerLostError(FingerslipError):
    """The scheduler ended, or cannot be reached any more."""

    def __str__(self) -> str:
        return (
            f"scheduler: the connection to '{self.args[0]}' is lost: finished runs are kept, the others need another "
            "try; start the scheduler and run the same command again"
        )


def compute_task(runs: Sequence[tuple[Run, str]], version: str, mesh: Any) -> _Outcome:
    """Compute runs in a folder that is removed, and return their files or errors by the names of the runs.

    Each stands beside the hash of its inputs; `version` is that of the fingerslip that asks for them.
    """
    if difference := _difference(metadata.version("fingerslip"), version):
        raise InputError("worker", difference, _SAME, _REPAIR)
    dask = sys.modules.get("dask")
    # Libraries that know Dask, such as xarray's writer, would ask the scheduler for locks.
    alone = contextlib.nullcontext() if dask is None else dask.config.set(scheduler="synchronous")
    with _ONE_AT_A_TIME, alone, tempfile.TemporaryDirectory(prefix="fingerslip-") as name:
        jobs = [Job(run, build_model(run, mesh), identity, Path(name) / run.name) for run, identity in runs]
        failures = compute_group(jobs, lambda *_: None, 1)
        return {job.run.name: failures.get(job.run.name) or _files(job.folder) for job in jobs}


def _files(folder: Path) -> dict[str, bytes]:
    """Return the files of a folder by their paths in it."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def _difference(version: object, needed: str) -> str:
    """Say which version of fingerslip a worker has, if any, where another one is needed; empty where it has that."""
    has = f"has fingerslip {version}" if isinstance(version, str) else "has no fingerslip"
    return "" if version == needed else f"{has}, this process {needed}"


def compute_on_cluster(jobs: Sequence[Job], address: str, progress: StudyProgress) -> Generator[Outcome, None, None]:
    """Compute jobs on the workers of a Dask cluster, write their folders here as they come, and yield what they are."""
    waiting = {job.run.name: job for job in jobs}
    try:
        with _connect(address) as client:
            _check_workers(client, progress)
            cores = max(1, sum(client.ncores().values()))
            for part, outcome in _outcomes(client, groups(jobs, cores), cores, progress):
                errors = {job.run.name: _write_files(job, outcome) for job in part}
                waiting = {name: job for name, job in waiting.items() if name not in errors}
                yield Outcome(part, {name: error for name, error in errors.items() if error})
    except SchedulerLostError as error:
        yield Outcome(tuple(waiting.values()), dict.fromkeys(waiting, error))


def _differences(client: Any) -> dict[str, str]:
    """Return what each worker has in the place of this version, empty where it has this one."""
    # A function of the standard library, for the worker has to find it; one without fingerslip returns an error.
    versions = client.run(metadata.version, "fingerslip", on_error="return")
    return {worker: _difference(version, metadata.version("fingerslip")) for worker, version in versions.items()}


def _check_workers(client: Any, progress: StudyProgress) -> None:
    """Refuse workers that cannot compute: one without fingerslip would die of its first task without a word."""
    differences = _differences(client)
    for worker, difference in differences.items():
        if difference:
            raise InputError(f"worker {worker}", difference, _SAME, _REPAIR)
    if not differences:
        progress.say("the cluster has no workers yet; the study waits for them")


def _refuse_workers(client: Any, progress: StudyProgress) -> list[str]:
    """Send workers away that cannot compute, which have joined meanwhile, and return their addresses."""
    wrong = {worker: difference for worker, difference in _differences(client).items() if difference}
    for worker, difference in wrong.items():
        progress.say(f"worker {worker}: {difference}; it is sent away; {_REPAIR}")
    if wrong:
        client.retire_workers(list(wrong))
    return list(wrong)


@contextlib.contextmanager
def _connect(address: str) -> Iterator[Any]:
    """Give a client of a scheduler; Dask is optional."""
    allowed = "needs the address of a Dask scheduler such as tcp://host:8786"
    if not _ADDRESS.fullmatch(address):
        raise InputError("scheduler", f"got '{address}'", allowed)
    distributed = optional_module("distributed", "cluster", "scheduler", "Dask needs it; runs without it are local")
    try:
        client = distributed.Client(address, timeout=_SECONDS_TO_CONNECT, set_as_default=False)
    except (OSError, ValueError) as error:
        fault = f"nothing answers at '{address}' ({type(error).__name__})"
        raise InputError("scheduler", fault, allowed) from None
    # What goes wrong is said here; Dask's log adds tracebacks.
    with distributed.utils.silence_logging_cmgr(logging.CRITICAL), client:
        try:
            yield client
        except (distributed.comm.CommClosedError, CancelledError, TimeoutError) as error:
            raise SchedulerLostError(address) from error


def _outcomes(
    client: Any, job_groups: Sequence[Sequence[Job]], cores: int, progress: StudyProgress
) -> Iterator[tuple[Sequence[Job], _Outcome]]:
    """Yield what became of each group, as the workers finish them; only so many wait at once."""
    distributed: Any = importlib.import_module("distributed")
    meshes: dict[int, Any] = {}
    waiting = iter(job_groups)
    sent: dict[Any, tuple[Sequence[Job], int]] = {}
    refused: list[str] = []

    def send(part: Sequence[Job]) -> Any:
        mesh = part[0].model.mesh
        if id(mesh) not in meshes:
            # Submitted, not scattered: the scheduler makes it again where the workers that held it have died.
            meshes[id(mesh)] = client.submit(_give, mesh, pure=False)
        runs, version = [(job.run, job.identity) for job in part], metadata.version("fingerslip")
        future = client.submit(compute_task, runs, version, meshes[id(mesh)], pure=False)
        sent[future] = part, len(refused)
        return future

    first = [send(part) for part in itertools.islice(waiting, _AHEAD * cores)]
    completed = distributed.as_completed(first, loop=client.loop)
    try:
        for future in completed:
            part, refused_before = sent.pop(future)
            if future.cancelled():
                raise CancelledError
            error = future.exception()
            refused += _refuse_workers(client, progress) if error else []
            if error and len(refused) > refused_before:
                meshes.clear()  # they may have been on that worker
                completed.add(send(part))
                continue
            if isinstance(error, distributed.KilledWorker):
                error = ResultError(f"cluster: {_KILLED}; give each worker more memory")
            if error and not isinstance(error, FingerslipError):
                raise error
            yield part, {job.run.name: error for job in part} if error else future.result()
            following = next(waiting, None)
            if following is not None:
                completed.add(send(following))
    finally:
        with contextlib.suppress(Exception):  # the scheduler may be gone
            client.cancel(list(sent))


def _give(mesh: Any) -> Any:
    return mesh


def _write_files(job: Job, outcome: _Outcome) -> FingerslipError | None:
    """Write the files of a run, whole or not at all, where their checksums are right; return what went wrong."""
    files = outcome[job.run.name]
    if isinstance(files, MemoryError):
        return ResultError(f"{job.run.where}: not enough memory on the worker; use larger elements")
    if isinstance(files, FingerslipError):
        return files
    if isinstance(files, Exception):
        raise files
    try:
        with new_folder(job.folder) as folder:
            with writing(folder):
                for name, content in files.items():
                    (folder / name).parent.mkdir(parents=True, exist_ok=True)
                    (folder / name).write_bytes(content)
            stored_result(folder)
    except ResultError as error:
        return error
    return None
