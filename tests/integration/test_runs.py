"""Runs of a study side by side, together and from any script give what they give one after another."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np
import pytest

from fingerslip.dynamics.step import sharing
from fingerslip.history import read_history
from fingerslip.study.convergence import converge
from fingerslip.study.running import runner
from fingerslip.study.running.runner import run_study
from unit.study.block import FRICTIONS, block_values

pytestmark = pytest.mark.slow
Write = Callable[..., Path]
NAMES = [f"friction_coefficient-{friction}" for friction in FRICTIONS]


def test_runs_side_by_side_give_the_same_as_one_after_another(write_study, reports):
    values = block_values() | {"record": {"snapshots_every": "20 ms"}}
    path = write_study(values)
    apart = run_study(path, results_dir=path.parent / "apart", workers=2)
    here = run_study(path, results_dir=path.parent / "here", workers=1)
    # The number of threads changes the order of sums, so the last digits differ.
    assert apart.runs[0].events.incipient == pytest.approx(here.runs[0].events.incipient, rel=1e-8)
    first, second = (read_history(result.folder / NAMES[2] / "history.nc") for result in (apart, here))
    np.testing.assert_allclose(first["counterface_force"], second["counterface_force"], rtol=1e-9, atol=1e-15)
    assert (apart.folder / NAMES[0] / "log.txt").stat().st_size > 0
    grid = meshio.read(apart.folder / NAMES[0] / "snapshot_0001.vtu")
    assert grid.points.shape == (45, 3)
    # The plate has pressed the bottom upwards by its whole way, less some per cent of penetration.
    assert grid.point_data["displacement"][:, 1].max() == pytest.approx(0.1e-3, rel=0.05)


def test_repetitions_are_computed_by_workers(write_study, reports):
    path = write_study(block_values())
    apart, here = (
        converge(path, results_dir=path.parent / name, only=NAMES[:1], workers=count)
        for name, count in (("apart", 2), ("here", 1))
    )
    assert apart.runs[0].quantities.keys() == here.runs[0].quantities.keys()


def test_workers_draw_what_they_have_computed(write_study, monkeypatch):
    given = []
    monkeypatch.setattr(runner, "write_report", lambda _, pictures: given.append(pictures))
    path = write_study(block_values())
    run_study(path, results_dir=path.parent / "results", workers=2)
    (pictures,) = given
    assert sorted(pictures) == NAMES
    assert [drawn.name for drawn in pictures[NAMES[0]].model] == [f"section-{NAMES[0]}"]
    assert pictures[NAMES[1]].model is None
    assert all(drawn.png.startswith(b"\x89PNG") for own in pictures.values() for drawn in own.contact)


@pytest.mark.usefixtures("reports")
def test_a_study_gives_the_same_together(write_study, monkeypatch):
    path = write_study(block_values())
    apart = run_study(path, results_dir=path.parent / "apart", workers=1)
    monkeypatch.setattr(sharing, "_WORTH_SHARING", {2: 0, 3: 0})
    joint = run_study(path, results_dir=path.parent / "joint", workers=1)
    for name in NAMES:
        one, other = (read_history(result.folder / name / "history.nc") for result in (apart, joint))
        assert (one.attrs["n_simulated_together"], other.attrs["n_simulated_together"]) == (1, len(FRICTIONS))
        np.testing.assert_allclose(other["counterface_force"], one["counterface_force"], rtol=1e-8, atol=1e-14)
        log = (joint.folder / name / "log.txt").read_text(encoding="utf-8")
        assert one.attrs["linear_solver"] in log
        assert "one substitution a step" in log
    assert joint.computed == apart.computed


SCRIPT = """
import fingerslip as fs
from fingerslip.study.running import runner

print("the script runs")
runner.write_report = lambda *_: None
result = fs.run_study("block.yaml", workers=2)
print(*result.computed)
"""


@pytest.mark.parametrize(
    "arguments", [["script.py"], ["-"], ["-m", "script"]], ids=["script", "standard input", "module"]
)
def test_a_script_without_a_main_guard_runs_a_study_with_several_workers(write_study, arguments):
    folder = write_study().parent
    (folder / "script.py").write_text(SCRIPT, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, *arguments],
        input=SCRIPT if arguments == ["-"] else "",
        cwd=folder,
        env=os.environ | {"PYTHONWARNINGS": "default"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.splitlines() == ["the script runs", " ".join(NAMES)], done.stderr
    assert "Traceback" not in done.stderr
