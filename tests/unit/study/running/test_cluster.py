"""Computing on a Dask cluster: what a worker returns, and what is written of it."""

import dataclasses
import threading
from importlib import metadata

import pytest

from fingerslip.errors import InputError, ResultError
from fingerslip.results import stored_result
from fingerslip.study.definition.runs import plan_study
from fingerslip.study.running import cluster
from fingerslip.study.running.build import prepare
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.running.runner import run_study
from unit.study.told import Told

pytestmark = pytest.mark.usefixtures("simulated", "reports")


@pytest.fixture
def plan(write_study, tmp_path):
    return plan_study(write_study(), tmp_path / "results")


def test_files_that_a_worker_returns_become_finished_runs_but_damaged_ones_and_errors_do_not(plan):
    jobs = prepare(plan, plan.runs)
    outcome = cluster.compute_task(cluster._task(jobs), jobs[0].model.mesh)
    assert [sorted(files) for files in outcome.values()] == [["events.json", "history.nc", "log.txt", "run.yaml"]] * 3
    name, files = jobs[0].run.name, dict(outcome[jobs[0].run.name])
    error = cluster._write_files(jobs[0], {name: files | {"history.nc": files["history.nc"][:-7]}})
    assert "its checksum is another" in str(error)
    assert "not enough memory on the worker" in str(cluster._write_files(jobs[0], {name: MemoryError()}))
    refused = ResultError("no")
    assert cluster._write_files(jobs[0], {name: refused}) is refused
    assert not jobs[0].folder.exists()
    assert [cluster._write_files(job, outcome) for job in jobs] == [None] * 3
    assert {stored_result(job.folder).identity for job in jobs} == set(plan.identities.values())
    assert len(plan.finished_runs()) == 3


def test_a_worker_of_another_version_is_refused(plan):
    (job, *_) = prepare(plan, plan.runs)
    task = dataclasses.replace(cluster._task([job]), version="0.0")
    with pytest.raises(InputError, match=r"worker: has fingerslip .*, this process 0\.0"):
        cluster.compute_task(task, job.model.mesh)


def test_text_that_is_no_address_and_a_scheduler_that_does_not_answer_are_named(write_study, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "_SECONDS_TO_CONNECT", 0.2)
    path = write_study()
    for address in ("nonsense", "", "http://x:1", "tcp://host", "tcp://:x"):
        said = rf"scheduler: got '{address}', needs the address"
        with pytest.raises(InputError, match=said), cluster._connect(address):
            pass
    with pytest.raises(InputError, match=r"scheduler: nothing answers at 'tcp://127\.0\.0\.1:9'"):
        run_study(path, results_dir=path.parent / "results", scheduler="tcp://127.0.0.1:9", progress=StudyProgress())
    assert not (path.parent / "results").exists()


class Client:
    """A client whose workers have these versions of fingerslip."""

    def __init__(self, versions):
        self.versions = versions

    def run(self, *_, on_error):
        assert on_error == "return"
        return self.versions


def test_workers_that_cannot_compute_are_named_before_anything_is_sent():
    same, told = metadata.version("fingerslip"), Told()
    cluster._check_workers(Client({"tcp://a:1": same, "tcp://b:2": same}), told)
    with pytest.raises(InputError, match=r"worker tcp://b:2: has no fingerslip, .*needs the same version; install"):
        cluster._check_workers(Client({"tcp://a:1": same, "tcp://b:2": metadata.PackageNotFoundError()}), told)
    with pytest.raises(InputError, match=r"worker tcp://b:2: has fingerslip 0\.0"):
        cluster._check_workers(Client({"tcp://b:2": "0.0"}), told)
    assert told.messages == []
    cluster._check_workers(Client({}), told)
    assert told.messages == ["the cluster has no workers yet; the study waits for them"]


def test_threads_of_a_worker_compute_one_after_the_other(plan, monkeypatch):
    (job, *_) = prepare(plan, plan.runs)
    begun = threading.Event()
    monkeypatch.setattr(cluster, "compute_group", lambda *_: begun.set() or {job.run.name: ResultError("no")})
    thread = threading.Thread(target=cluster.compute_task, args=(cluster._task([job]), job.model.mesh))
    with cluster._ONE_AT_A_TIME:
        thread.start()
        assert not begun.wait(0.3)
    assert begun.wait(10.0)
    thread.join()
