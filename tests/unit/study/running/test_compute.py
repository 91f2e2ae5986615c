"""Runs computed, side by side and on a cluster: each folder whole or not at all, every failure told by its run."""

import dataclasses
import errno
import json
import logging
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
import weakref
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

import fingerslip as fs
from fingerslip.dynamics.step import sharing
from fingerslip.errors import ConvergenceError, FingerslipError, InputError, ResultError, SlipOutsideContactError
from fingerslip.history import read_history
from fingerslip.report.content import RunPictures
from fingerslip.results import stored_result
from fingerslip.slip import find_events
from fingerslip.slip.events import events_from_mapping
from fingerslip.study.definition.runs import plan_study
from fingerslip.study.running import cluster, compute, cost
from fingerslip.study.running.build import groups, prepare
from fingerslip.study.running.compute import WorkerLostError, compute_all, compute_group, without_main_module
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.running.runner import Engine, StudyFailedError, compute_jobs, run_study
from fingerslip.study.storage import store
from fingerslip.study.storage.store import mesh_hash
from problems.pushed import push_and_slide
from unit.study.block import Told, run_block
from unit.study.conftest import NOT_SOLVED

VERSION = metadata.version("fingerslip")


def no_space(*_, **__):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def half_written(self, _):
    with self.open("wb") as file:
        file.write(b"half of it")
    no_space()


@pytest.mark.usefixtures("simulated", "reports")
@pytest.mark.parametrize(
    ("owner", "name", "full"),
    [(store, "write_mapping", no_space), (Path, "write_bytes", half_written), (Path, "mkdir", no_space)],
)
def test_full_disk_leaves_no_partial_run(write_study, monkeypatch, owner, name, full):
    path = write_study()
    with monkeypatch.context() as patch:
        patch.setattr(owner, name, full)
        with pytest.raises(StudyFailedError, match="No space left on device") as caught:
            run_block(path)
    error = next(iter(caught.value.errors.values()))
    assert isinstance(error, ResultError)
    assert str(error).endswith("free some space or choose another folder")
    assert not (path.parent / "results").exists()


@pytest.fixture
def job(write_study, tmp_path):
    """Return the second of three runs, ready to be computed."""
    plan = plan_study(write_study(), tmp_path / "results")
    return prepare(plan, plan.runs[1:2])[0]


@pytest.mark.usefixtures("simulated")
def test_what_is_stored_beside_the_history_and_in_the_log_says_what_happened(job):
    logger, told = logging.getLogger("fingerslip"), []
    before = (logger.level, list(logger.handlers))
    compute.compute([job], told.append)
    assert (logger.level, list(logger.handlers)) == before
    assert told == [0.5]
    stored = json.loads((job.folder / "events.json").read_text())
    assert (stored["run"], stored["swept"]) == ("friction_coefficient-0.4", {"contact.friction_coefficient": 0.4})
    assert (stored["identity"], stored["mesh_hash"]) == (job.identity, mesh_hash(job.model.mesh))
    history = read_history(job.folder / "history.nc")
    assert events_from_mapping(stored["events_s"]) == find_events(history)
    assert [peak["time_s"] for peak in stored["acceleration_peaks"]] == pytest.approx([1.53, 1.63, 1.71], abs=5.1e-3)
    assert stored["numbers"]["records"] == history.sizes["time"]
    # Few steps of the slide and few nodes are told by numbers.
    assert [text.partition(" takes")[0] for text in stored["doubts"]] == ["programme.0: the press"]
    assert len(job.doubts) == 3
    values = yaml.safe_load((job.folder / "run.yaml").read_text())
    assert values["contact"]["friction_coefficient"] == 0.4
    assert "sweep" not in values
    text = (job.folder / "log.txt").read_text()
    for line in (f"identity {job.identity}", "simulated 401 records", "over normal force at the end of the slide: 0.4"):
        assert line in text


def test_a_failing_or_stopped_run_leaves_neither_folder_nor_handler(job, simulated, fails):
    def stop(_):
        raise InputError("here", "stopped", "goes on")

    with pytest.raises(InputError, match="stopped"):
        compute.compute([job], stop)
    assert simulated == [0.4]
    assert not list(job.folder.parent.iterdir())
    fails(SlipOutsideContactError("contacts.0", "a", "b", "c"))
    with pytest.raises(SlipOutsideContactError) as caught:
        compute.compute([job], lambda _: None)
    assert str(caught.value).endswith("block.yaml (contact.friction_coefficient = 0.4): contact: a, b; c (line 15)")
    assert not list(job.folder.parent.iterdir())
    assert not logging.getLogger("fingerslip").handlers


def job_of(name, model=None, folder=Path("none")):
    run = SimpleNamespace(name=name, where=f"x.yaml ({name})", study=SimpleNamespace(reaction=None), written_values={})
    return SimpleNamespace(run=run, model=model or push_and_slide(), folder=folder / name)


def names(parts):
    return ["".join(job.run.name for job in part) for part in parts]


def test_runs_that_share_a_matrix_make_a_group_that_is_not_too_large(monkeypatch):
    assert names(groups([job_of("a"), job_of("b")])) == ["a", "b"], "small runs stay apart"
    monkeypatch.setattr(sharing, "_WORTH_SHARING", {2: 0, 3: 0})
    model = push_and_slide()
    stiff = dataclasses.replace(model, materials={"bulk": fs.Elastic(1e6, 0.3, 1000.0)})
    jobs = [job_of("a", model), job_of("b", stiff), job_of("c", push_and_slide(friction=0.9)), job_of("d", stiff)]
    assert names(groups(jobs)) == ["ac", "bd"]
    for bytes_together, at_once, together_are, parts in (
        (1.0, 1, "abcdefgh", ["abcdefgh"]),
        (1.0, 1, "abcdefghij", ["abcde", "fghij"]),
        (1.0, 1, "a", ["a"]),
        (1e9, 1, "abcdefghij", ["abcdefghij"]),
        (1e9, 2, "abcd", ["ab", "cd"]),
        (1e9, 1, "a" * 40, ["a" * 20] * 2),
    ):
        monkeypatch.setattr(cost, "_BYTES_TOGETHER", bytes_together)
        assert names(groups([job_of(name, model) for name in together_are], at_once)) == parts


@pytest.mark.parametrize("error", [NOT_SOLVED, MemoryError()])
def test_where_a_group_fails_its_halves_are_computed(monkeypatch, error):
    tried = []

    def failing(jobs, progress, _):
        tried.append("".join(one.run.name for one in jobs))
        if len(jobs) > 1:
            raise error
        progress(1.0)
        if tried[-1] == "b":
            raise error
        return [tried[-1]]

    monkeypatch.setattr(compute, "compute", failing)
    told, jobs = [], [job_of(name) for name in "abc"]
    errors = compute_group(jobs, lambda *news: told.append(news), 1, lambda run: tried.append(f"{run} shown"))
    assert errors == {"b": error}
    assert tried == ["abc", "a", "a shown", "bc", "b", "c", "c shown"], "what is finished is let go before the next"
    assert told == [("a", 1.0), ("b", 1.0), ("c", 1.0)]


def test_what_a_group_had_in_memory_is_let_go_before_its_halves_are_computed(monkeypatch):
    held = []

    def failing(jobs, *_):
        assert [array for array in held if array() is not None] == []
        array = np.zeros(3)
        held.append(weakref.ref(array))
        if len(jobs) > 1:
            raise MemoryError
        return []

    monkeypatch.setattr(compute, "compute", failing)
    assert compute_group([job_of(name) for name in "abc"], lambda *_: None, 1) == {}
    assert len(held) == 5


def test_failures_are_kept_by_name_and_the_others_go_on(monkeypatch, tmp_path):
    ends = {"a": NOT_SOLVED, "b": None, "c": MemoryError()}

    def compute_one(jobs, progress, _):
        progress(0.5)
        if ends[jobs[0].run.name] is not None:
            raise ends[jobs[0].run.name]
        return []

    monkeypatch.setattr(compute, "compute", compute_one)
    progress = Told()
    plan = SimpleNamespace(folder=tmp_path, runs=())
    jobs = [job_of(name, folder=tmp_path) for name in ends]
    failures = compute_jobs(plan, jobs, Engine(progress, 1))[0]
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
    assert compute_jobs(plan, [], Engine(progress, 1)) == ({}, {})


def test_what_is_no_error_of_the_package_ends_the_study(monkeypatch):
    def broken(*_):
        raise ZeroDivisionError

    monkeypatch.setattr(compute, "compute", broken)
    with pytest.raises(ZeroDivisionError):
        list(compute_all([job_of("a")], 1, StudyProgress(), {}))
    with pytest.raises(ZeroDivisionError):
        list(compute._follow({finished(ZeroDivisionError()): [job_of("a")]}, queue.Queue(), StudyProgress()))


@pytest.mark.parametrize(("workers", "count", "apart"), [(1, 5, 0), (4, 1, 0), (4, 2, 2), (2, 5, 2)])
def test_no_more_processes_than_runs_and_none_for_a_single_one(monkeypatch, workers, count, apart):
    started = []
    monkeypatch.setattr(compute, "compute", lambda *_: [])
    monkeypatch.setattr(compute, "_compute_apart", lambda _, number, *__: started.append(number) or ())
    outcomes = list(compute_all([job_of(str(number)) for number in range(count)], workers, StudyProgress(), {}))
    assert all(outcome.errors == {} for outcome in outcomes)
    assert sum(started) == apart


def finished(outcome):
    future = Future()
    if isinstance(outcome, dict):
        future.set_result((outcome, {"d": RunPictures()} if "d" in outcome else {}))
    else:
        future.set_exception(outcome)
    return future


def test_failures_of_workers_are_told_by_the_name_of_the_run():
    """Of the two runs that one worker computes together, one fails."""
    ends = {"ab": {"b": NOT_SOLVED}, "c": BrokenProcessPool(), "d": {"d": MemoryError()}}
    futures = {finished(end): [job_of(name) for name in together] for together, end in ends.items()}
    news = queue.Queue()
    news.put(("a", 0.25))
    progress = Told()
    outcomes = list(compute._follow(futures, news, progress))
    assert progress.told == [("a", 0.25)]
    errors = {name: type(error) for outcome in outcomes for name, error in outcome.errors.items()}
    assert errors == {"b": ConvergenceError, "c": WorkerLostError, "d": MemoryError}
    assert sorted(names([outcome.jobs for outcome in outcomes])) == ["ab", "c", "d"]
    assert [outcome.pictures for outcome in outcomes if outcome.pictures] == [{"d": RunPictures()}]
    lost = pickle.loads(pickle.dumps(WorkerLostError()))  # on the way between processes
    assert isinstance(lost, FingerslipError)
    assert "run the same command again with --workers 1" in str(lost)


def test_a_worker_tells_how_far_it_is_until_it_has_to_stop(monkeypatch):
    news = queue.Queue()
    monkeypatch.setattr(compute, "_news", news)
    monkeypatch.setattr(compute, "_stop", SimpleNamespace(value=0))
    monkeypatch.setattr(compute, "_told", {})
    for name, fraction in (("a", 0.5), ("a", 0.51), ("b", 0.51)):
        compute._tell(name, fraction)
    # The parent does not look again so soon.
    assert [news.get(), news.get()] == [("a", 0.5), ("b", 0.51)]
    monkeypatch.setattr(compute, "_stop", SimpleNamespace(value=1))
    with pytest.raises(compute._StoppedError):
        compute._tell("c", 0.5)
    assert news.empty()


def test_the_main_module_is_there_again_behind_the_block():
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
from fingerslip.study.running.compute import end_with_parent, without_main_module
pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), initializer=end_with_parent)
with without_main_module():
    first, _ = pool.submit(os.getpid), pool.submit(time.sleep, 3600.0)
print(first.result(), flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")
def test_a_worker_of_a_killed_process_ends():
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


def test_a_worker_that_nobody_ends_ends_by_itself(monkeypatch):
    ended, stop = threading.Event(), SimpleNamespace(value=0)
    for name, value in (("_news", None), ("_stop", None), ("_SECONDS_TO_STOP", 0.0), ("end_with_parent", lambda: None)):
        monkeypatch.setattr(compute, name, value)
    monkeypatch.setattr(compute.os, "_exit", lambda code: code == 1 and ended.set())
    before = signal.getsignal(signal.SIGINT)
    compute._begin_worker(None, stop)
    signal.signal(signal.SIGINT, before)
    assert not ended.wait(0.05)
    stop.value = 1
    assert ended.wait(10.0)


def test_a_worker_for_one_function_has_what_tells_it_to_stop(monkeypatch):
    given, called = [], []

    class Pool(ThreadPoolExecutor):
        def __init__(self, workers, _, initializer, initargs):
            given.append((initializer, *initargs))
            super().__init__(workers)

    monkeypatch.setattr(compute, "ProcessPoolExecutor", Pool)
    compute.in_worker(called.append, 1)
    ((initializer, _, stop),) = given
    assert (initializer, stop.value, called) == (compute._begin_worker, 0, [1])


@pytest.mark.parametrize("with_mask", [False, True])
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_while_workers_start_is_not_lost(monkeypatch, with_mask):
    """A signal to the process goes to any thread that does not block it, and would come at any moment."""
    # Where the tests run in the background, Ctrl-C is ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    done, said = threading.Event(), []

    def interrupted():
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.01)
        said.append("went on")

    def masked(how, signals, mask=signal.pthread_sigmask):
        masks = mask(how, signals)
        if with_mask and how == signal.SIG_BLOCK and not said:
            interrupted()
        return masks

    threading.Thread(target=done.wait, daemon=True).start()
    monkeypatch.setattr(signal, "pthread_sigmask", masked)
    with pytest.raises(KeyboardInterrupt), compute.hold_interrupts():
        _ = with_mask or interrupted()
    done.set()
    assert said == ["went on"]
    assert signal.signal(signal.SIGINT, before) is signal.default_int_handler
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


pytestmark = pytest.mark.usefixtures("simulated", "reports")


@pytest.fixture
def plan(write_study, tmp_path):
    return plan_study(write_study(), tmp_path / "results")


def test_files_that_a_worker_returns_become_finished_runs_but_damaged_ones_and_errors_do_not(plan):
    jobs = prepare(plan, plan.runs)
    outcome = cluster.compute_task([(job.run, job.identity) for job in jobs], VERSION, jobs[0].model.mesh)
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
    with pytest.raises(InputError, match=r"worker: has fingerslip .*, this process 0\.0"):
        cluster.compute_task([(job.run, job.identity)], "0.0", job.model.mesh)


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
    same, told = VERSION, Told()
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
    thread = threading.Thread(target=cluster.compute_task, args=([(job.run, job.identity)], VERSION, job.model.mesh))
    with cluster._ONE_AT_A_TIME:
        thread.start()
        assert not begun.wait(0.3)
    assert begun.wait(10.0)
    thread.join()
