"""A study on a Dask cluster of separate worker processes, one of which is killed on the way."""

import os
import re
import signal
import socket
import subprocess
import sys

import numpy as np
import pytest

from fingerslip.history import read_history
from fingerslip.results import stored_result
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.running.runner import StudyFailedError, run_study
from places import DOCS, ROOT
from robustness.block import write_block

distributed = pytest.importorskip("distributed")
pytestmark = pytest.mark.slow
FRICTIONS = [round(0.2 + 0.02 * number, 2) for number in range(24)]


class Meanwhile(StudyProgress):
    """Does something when the third run is done, and keeps the outcomes of all runs and what is said."""

    def __init__(self, act):
        self.act, self.said, self.outcomes = act, list[str](), list[tuple[str, str]]()

    def say(self, message):
        self.said.append(message)

    def finish(self, name, outcome):
        self.outcomes.append((name, outcome))
        if len(self.outcomes) == 3:
            self.act()


def kill_a_busy_worker(scheduler):
    with distributed.Client(scheduler, set_as_default=False) as client:
        processing, pids = client.processing(), client.run(os.getpid)
    os.kill(pids[next(worker for worker, tasks in processing.items() if tasks)], signal.SIGKILL)


@pytest.fixture
def cluster():
    """Start a scheduler and three worker processes with a thread each."""
    with distributed.LocalCluster(
        n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs="CRITICAL"
    ) as found:
        yield found


def write_sweep(folder):
    return write_block(folder, sweep={"contact.friction_coefficient": FRICTIONS}, time={"step": "0.5 ms"})


@pytest.mark.usefixtures("reports")
@pytest.mark.filterwarnings("ignore")
def test_a_killed_worker_loses_nothing_and_nothing_is_done_twice(tmp_path, cluster):
    path = write_sweep(tmp_path)
    meanwhile = Meanwhile(lambda: kill_a_busy_worker(cluster.scheduler_address))
    result = run_study(path, results_dir=tmp_path / "results", scheduler=cluster.scheduler_address, progress=meanwhile)
    assert sorted(meanwhile.outcomes) == sorted((f"friction_coefficient-{one:g}", "done") for one in FRICTIONS)
    assert len(result.computed) == len(FRICTIONS)
    for run in result.runs:
        assert stored_result(result.folder / run.name).identity == run.identity

    written = {run.name: (result.folder / run.name / "history.nc").stat().st_mtime_ns for run in result.runs}
    again = run_study(path, results_dir=tmp_path / "results", scheduler=cluster.scheduler_address)
    assert again.computed == ()
    assert written == {name: (result.folder / name / "history.nc").stat().st_mtime_ns for name in written}

    local = run_study(path, results_dir=tmp_path / "local", workers=1)
    for run in local.runs[::8]:
        here, there = (read_history(one.folder / run.name / "history.nc") for one in (local, result))
        for name in ("counterface_force", "contact_displacement"):
            np.testing.assert_allclose(there[name].values, here[name].values, rtol=1e-12, atol=1e-15)


class Processes:
    """A scheduler and workers as the programs that a user starts."""

    def __init__(self, folder):
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
        self.folder = folder
        self.started = [self._start("scheduler", "--host", self.address, path="")]
        self.add_worker()

    def add_worker(self, path=""):
        """Start a worker, and wait until the scheduler knows it."""
        self.started.append(self._start("worker", self.address, "--nthreads", "1", "--no-nanny", path=path))
        with distributed.Client(self.address, set_as_default=False, timeout=60) as client:
            client.wait_for_workers(len(self.started) - 1)

    def add_worker_of_another_version(self):
        """Start a worker whose environment calls fingerslip 0.0."""
        described = self.folder / "other" / "fingerslip-0.0.dist-info"
        described.mkdir(parents=True)
        (described / "METADATA").write_text("Metadata-Version: 2.1\nName: fingerslip\nVersion: 0.0\n")
        self.add_worker(f"{described.parent}:")

    def _start(self, *arguments, path):
        environment = {**os.environ, "PYTHONPATH": f"{path}{ROOT / 'src'}:{ROOT / 'tests'}"}
        command = [sys.executable, "-m", "dask", *arguments, "--no-dashboard"]
        return subprocess.Popen(command, cwd=self.folder, env=environment, stderr=subprocess.DEVNULL)


@pytest.fixture
def processes(tmp_path):
    made = Processes(tmp_path)
    yield made
    for process in made.started:
        process.kill()
        process.wait()


@pytest.mark.usefixtures("reports")
@pytest.mark.filterwarnings("ignore")
def test_what_is_finished_is_kept_when_the_scheduler_is_killed(tmp_path, processes, capfd):
    meanwhile = Meanwhile(processes.started[0].kill)
    options = {"results_dir": tmp_path / "results", "scheduler": processes.address, "progress": meanwhile}
    lost = r"is lost: finished runs are kept.*run the same command again"
    with pytest.raises(StudyFailedError, match=lost) as failed:
        run_study(write_sweep(tmp_path), **options)
    assert len(set(map(str, failed.value.errors.values()))) == 1
    done = sum(outcome == "done" for _, outcome in meanwhile.outcomes)
    assert 3 <= done < len(FRICTIONS) == len(meanwhile.outcomes)
    folder = tmp_path / "results" / "block"
    assert len([stored_result(path.parent) for path in folder.glob("*/events.json")]) == done
    assert (folder / "summary.csv").is_file()
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.usefixtures("reports")
@pytest.mark.filterwarnings("ignore")
def test_a_worker_of_another_version_that_joins_later_fails_no_run(tmp_path, processes):
    meanwhile = Meanwhile(processes.add_worker_of_another_version)
    run_study(write_sweep(tmp_path), results_dir=tmp_path / "results", scheduler=processes.address, progress=meanwhile)
    assert [outcome for _, outcome in meanwhile.outcomes] == ["done"] * len(FRICTIONS)
    (said,) = meanwhile.said
    assert re.fullmatch(r"worker tcp://\S+: has fingerslip 0\.0, this process .*; it is sent away; install .*", said)
    assert processes.started[2].wait(60.0) == 0


RECIPE = re.search(
    r"^```py\n(from dask_jobqueue.*?)^```", (DOCS / "howto" / "clusters.md").read_text(), re.DOTALL | re.MULTILINE
)
SBATCH = """#!/bin/sh
# Stands for SLURM: runs the job here, with its output beside it.
bash "$1" > "$1.out" 2>&1 &
echo $! >> {jobs}
echo "Submitted batch job $!"
"""
SCANCEL = """#!/bin/sh
kill $(pgrep -P "$1") "$1" 2> /dev/null || true
"""


def script(cores, jobs):
    """Return the documented script for a machine with fewer cores."""
    assert RECIPE is not None
    small = RECIPE[1].replace("cores=16, processes=16", f"cores={cores}, processes={cores}")
    return small.replace("32GB", "2GB").replace("scale(jobs=4)", f"scale(jobs={jobs})") + "\ncluster.close()\n"


@pytest.mark.filterwarnings("ignore")
def test_the_documented_lines_ask_slurm_for_workers_with_one_thread_each():
    jobqueue = pytest.importorskip("dask_jobqueue")
    assert RECIPE is not None
    (call,) = re.findall(r"SLURMCluster\((.*?)\n\)", RECIPE[1], re.DOTALL)
    options = eval(f"dict({call})")
    with jobqueue.SLURMCluster(**options, scheduler_options={"dashboard_address": None}) as cluster:
        lines = cluster.job_script().splitlines()
    asked = {line.removeprefix("#SBATCH ") for line in lines if line.startswith("#SBATCH")}
    assert {"-p normal", "-n 1", "--cpus-per-task=16", "--mem=30G", "-t 02:00:00", "--account=NAME"} <= asked
    assert "--nthreads 1 " in lines[-1]
    assert "--nworkers 16 " in lines[-1]


def test_the_documented_script_runs_a_study_where_sbatch_starts_its_jobs(tmp_path):
    pytest.importorskip("dask_jobqueue")
    write_block(tmp_path).rename(tmp_path / "study.yaml")
    (tmp_path / "cluster.py").write_text(script(cores=1, jobs=2))
    for name, text in (("sbatch", SBATCH.format(jobs=tmp_path / "jobs")), ("scancel", SCANCEL)):
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o755)
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src"), "PATH": f"{tmp_path}:{os.environ['PATH']}"}
    options = {"cwd": tmp_path, "env": environment, "capture_output": True, "text": True, "timeout": 300}
    done = subprocess.run([sys.executable, "cluster.py"], check=False, **options)
    assert done.returncode == 0, done.stderr
    assert len((tmp_path / "jobs").read_text().split()) == 2
    folder = tmp_path / "results" / "study"
    assert len([stored_result(path.parent) for path in folder.glob("*/events.json")]) == 3
    assert (folder / "report.html").is_file()
