"""Computing on a Dask cluster: what a worker returns, and what is written of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import pytest

from fingerslip.errors import InputError, ResultError
from fingerslip.run_folder import stored_result
from fingerslip.study.running import cluster
from fingerslip.study.running.plan import plan_study
from fingerslip.study.running.progress import SilentProgress
from fingerslip.study.running.runner import prepare, run_study

pytestmark = pytest.mark.usefixtures("simulated", "reports")
Write = Callable[..., Path]


def test_a_worker_returns_files_that_become_finished_runs(write_study: Write) -> None:
    path = write_study()
    plan = plan_study(path, path.parent / "results")
    jobs = prepare(plan, plan.runs)
    outcome = cluster.compute_task(cluster._task(jobs), jobs[0].model.mesh)
    assert [sorted(files) for files in outcome.values()] == [["events.json", "history.nc", "log.txt", "run.yaml"]] * 3
    assert [cluster._written(job, outcome[job.run.name]) for job in jobs] == [None] * 3
    assert {stored_result(job.folder).identity for job in jobs} == set(plan.identities.values())
    assert len(plan.finished()) == 3


def test_damaged_files_are_not_written(write_study: Write) -> None:
    path = write_study()
    plan = plan_study(path, path.parent / "results")
    job = prepare(plan, plan.runs)[0]
    files = dict(cluster.compute_task(cluster._task([job]), job.model.mesh)[job.run.name])
    error = cluster._written(job, files | {"history.nc": files["history.nc"][:-7]})
    assert "its checksum is another" in str(error)
    assert not job.folder.exists()
    assert "not enough memory on the worker" in str(cluster._written(job, MemoryError()))
    refused = ResultError("no")
    assert cluster._written(job, refused) is refused


def test_a_worker_of_another_version_is_refused(write_study: Write) -> None:
    plan = plan_study(write_study())
    job = prepare(plan, plan.runs)[0]
    task = dataclasses.replace(cluster._task([job]), version="0.0")
    with pytest.raises(InputError, match=r"worker: has fingerslip .*, this process 0\.0"):
        cluster.compute_task(task, job.model.mesh)


def test_a_scheduler_that_does_not_answer_is_named(write_study: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "_SECONDS_TO_CONNECT", 0.2)
    path = write_study()
    with pytest.raises(InputError, match=r"scheduler: nothing answers at 'tcp://127\.0\.0\.1:9'"):
        run_study(path, results_dir=path.parent / "results", scheduler="tcp://127.0.0.1:9", progress=SilentProgress())
    assert not (path.parent / "results").exists()
