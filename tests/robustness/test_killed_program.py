"""``fingerslip run`` as a program, killed at any moment: the next goes on, and what was finished stays."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml

from fingerslip.mesh.io import write_mesh
from fingerslip.results import read_result
from places import ROOT
from unit.study.block import block_mesh, block_values

pytestmark = pytest.mark.slow

FRICTIONS = [round(0.2 + 0.05 * number, 2) for number in range(8)]


def start(path: Path) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "fingerslip", "run", path.name, "--workers", "2", "--quiet"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    return subprocess.Popen(command, cwd=path.parent, env=environment, start_new_session=True)


def finished(path: Path) -> dict[str, int]:
    """Return when the history of each finished run was written, by its name."""
    folder = path.parent / "results" / path.stem
    names = [run.name for run in folder.iterdir() if run.is_dir()] if folder.is_dir() else []
    return {name: (folder / name / "history.nc").stat().st_mtime_ns for name in names if read_result(folder / name)}


def test_a_killed_program_is_continued(tmp_path: Path) -> None:
    write_mesh(block_mesh(0.0), tmp_path / "block.msh")
    path = tmp_path / "block.yaml"
    values = block_values() | {"sweep": {"contact.friction_coefficient": FRICTIONS}, "time": {"step": "0.5 ms"}}
    path.write_text(yaml.safe_dump(values, sort_keys=False))
    chance, kept = random.Random(14), dict[str, int]()
    while len(kept) < len(FRICTIONS) // 2:
        program = start(path)
        until = len(kept) + chance.randint(1, 3)
        while program.poll() is None and len(finished(path)) < until:
            time.sleep(0.05)
        os.killpg(program.pid, signal.SIGKILL)
        program.wait()
        now = finished(path)
        assert kept.items() <= now.items(), "what was finished stays as it was"
        kept = now
    assert start(path).wait() == 0
    last = finished(path)
    assert len(last) == len(FRICTIONS)
    assert kept.items() <= last.items()
    folder = tmp_path / "results" / "block"
    assert (folder / "report.html").is_file()
    assert not [left for left in folder.iterdir() if "partial" in left.name]
