"""``fingerslip run`` as a program that may write no more: it says so, leaves nothing half done, and goes on later."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from fingerslip.mesh.io import write_mesh
from fingerslip.results import read_result
from places import ROOT
from unit.study.block import FRICTIONS, block_mesh, block_values

resource = pytest.importorskip("resource")
pytestmark = pytest.mark.slow

MOST_BYTES = 30_000  # a history has more


def run(path: Path, most_bytes: int | None) -> subprocess.CompletedProcess[str]:
    """Run a study in a process whose files may not grow beyond a size; the system refuses to write more."""

    def limit() -> None:
        if most_bytes is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))

    command = [sys.executable, "-m", "fingerslip", "run", path.name, "--workers", "1", "--quiet"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    return subprocess.run(
        command, cwd=path.parent, env=environment, preexec_fn=limit, capture_output=True, text=True, check=False
    )


def test_a_study_that_cannot_be_written_says_so_and_goes_on_later(tmp_path: Path) -> None:
    write_mesh(block_mesh(0.0), tmp_path / "block.msh")
    path = tmp_path / "block.yaml"
    path.write_text(yaml.safe_dump(block_values(), sort_keys=False))
    refused = run(path, MOST_BYTES)
    assert refused.returncode != 0
    assert "history.nc: cannot be written (File too large)" in refused.stderr
    assert "Traceback" not in refused.stderr
    assert not (tmp_path / "results").exists() or not list((tmp_path / "results").rglob("*.nc"))
    assert not list(tmp_path.rglob("*.partial*"))
    assert run(path, None).returncode == 0
    folder = tmp_path / "results" / "block"
    assert all(read_result(folder / f"friction_coefficient-{friction}") for friction in FRICTIONS)
