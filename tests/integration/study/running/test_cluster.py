"""A study on a Dask cluster of separate worker processes, one of which is killed on the way."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from fingerslip.history import read_history
from fingerslip.mesh.io import write_mesh
from fingerslip.run_folder import stored_result
from fingerslip.study.running.progress import SilentProgress
from fingerslip.study.running.runner import run_study
from unit.study.block import block_mesh, block_values

distributed = pytest.importorskip("distributed")
pytestmark = pytest.mark.slow

FRICTIONS = [round(0.2 + 0.02 * number, 2) for number in range(24)]


class Killer(SilentProgress):
    """Kills a worker that computes when the third run is done, and keeps the outcomes of all runs."""

    def __init__(self, cluster: Any) -> None:
        self.cluster, self.outcomes = cluster, []
        self.killed: int | None = None

    def finish(self, name: str, outcome: str) -> None:
        self.outcomes.append((name, outcome))
        if len(self.outcomes) == 3:
            with distributed.Client(self.cluster, set_as_default=False) as client:
                processing = client.processing()
                pids = client.run(os.getpid)
                busy = next(worker for worker, tasks in processing.items() if tasks)
                self.killed = pids[busy]
            os.kill(self.killed, signal.SIGKILL)


@pytest.fixture
def cluster() -> Iterator[Any]:
    """Start a scheduler and three worker processes with a thread each."""
    with distributed.LocalCluster(
        n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs="CRITICAL"
    ) as found:
        yield found


@pytest.mark.usefixtures("reports")
@pytest.mark.filterwarnings("ignore")
def test_a_killed_worker_loses_nothing_and_nothing_is_done_twice(tmp_path: Path, cluster: Any) -> None:
    write_mesh(block_mesh(0.0), tmp_path / "block.msh")
    values = block_values() | {"sweep": {"contact.friction_coefficient": FRICTIONS}, "time": {"step": "0.5 ms"}}
    path = tmp_path / "block.yaml"
    path.write_text(yaml.safe_dump(values, sort_keys=False))
    killer = Killer(cluster.scheduler_address)
    result = run_study(path, results_dir=tmp_path / "results", scheduler=cluster.scheduler_address, progress=killer)
    assert killer.killed is not None
    assert sorted(killer.outcomes) == sorted((f"friction_coefficient-{one:g}", "done") for one in FRICTIONS)
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
