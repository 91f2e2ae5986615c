"""Commands on a disk that is really full: a clear error, nothing half done; the study goes on after space was made."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from fingerslip.mesh.io import write_mesh
from fingerslip.results import read_result
from places import ROOT
from unit.study.block import FRICTIONS, block_mesh, block_values

pytestmark = pytest.mark.slow

SIZE = 600_000  # bytes, of which a study needs more


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """Mount a small disk, where that is allowed."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={SIZE}", "tmpfs", str(folder)]
    try:
        allowed = subprocess.run(mount, capture_output=True, check=False).returncode == 0
    except OSError:
        allowed = False
    if not allowed:
        pytest.skip("no disk may be mounted here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def fill(disk: Path, left: int) -> None:
    """Fill a disk but for some bytes."""
    room = os.statvfs(disk)
    (disk / "filler").write_bytes(bytes(max(room.f_bavail * room.f_frsize - left, 0)))


def command(folder: Path, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    words = [sys.executable, "-m", "fingerslip", *map(str, arguments)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    return subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def refused(done: subprocess.CompletedProcess[str]) -> None:
    assert done.returncode == 2, done.stderr
    assert "cannot be written (No space left on device)" in done.stderr
    assert all(line.startswith("error: ") for line in done.stderr.splitlines())


def test_a_full_disk_is_said_and_the_study_goes_on_after_it(tmp_path: Path, disk: Path) -> None:
    write_mesh(block_mesh(0.0), tmp_path / "block.msh")
    (tmp_path / "block.yaml").write_text(yaml.safe_dump(block_values(), sort_keys=False))
    run = ("run", "block.yaml", "--workers", "1", "--quiet", "--results")
    for left in (0, 16_384):
        fill(disk, left)
        refused(command(tmp_path, *run, disk))
        assert not [path for path in disk.rglob("*") if "partial" in path.name]
        assert all(read_result(path.parent) for path in disk.rglob("events.json"))
        (disk / "filler").unlink()
    assert command(tmp_path, *run, "results").returncode == 0
    fill(disk, 0)
    stored = tmp_path / "results" / "block"
    first = stored / f"friction_coefficient-{FRICTIONS[0]}"
    for arguments in (
        ("export", first, "--format", "mat", "-o", disk / "export"),
        ("export", stored, "-o", disk / "table"),
        ("figure", stored, "--kind", "latency", "-o", disk / "latency.pdf"),
        ("report", stored, stored, "-o", disk / "comparison.html"),
        ("mesh", "block.yaml", "-o", disk / "block.msh"),
        ("new", disk / "new.yaml"),
    ):
        refused(command(tmp_path, *arguments))
        assert [path.name for path in disk.iterdir()] == ["filler"], arguments
    (disk / "filler").unlink()
    subprocess.run(["mount", "-o", "remount,size=50m", str(disk)], check=True)
    done = command(tmp_path, *run, disk)
    assert done.returncode == 0, done.stderr
    assert all(read_result(disk / "block" / f"friction_coefficient-{friction}") for friction in FRICTIONS)
    assert (disk / "block" / "report.html").is_file()
