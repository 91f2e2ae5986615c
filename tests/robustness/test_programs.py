"""``fingerslip`` as a program that is killed or may write no more: it says so, leaves nothing half done, goes on."""

import os
import random
import signal
import subprocess
import sys
import time

import pytest

from fingerslip.results import read_result
from places import ROOT
from robustness.block import write_block
from unit.study.block import FRICTIONS

resource = pytest.importorskip("resource")
pytestmark = pytest.mark.slow

MANY_FRICTIONS = [round(0.2 + 0.05 * number, 2) for number in range(8)]
MOST_BYTES = 30_000  # a history has more
DISK_BYTES = 600_000  # a study needs more
RUN = ("run", "block.yaml", "--quiet", "--workers")


def start(folder, *arguments, limit=None):
    """Start the program in a folder; `limit` is called in its process before."""
    words = [sys.executable, "-m", "fingerslip", *map(str, arguments)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "start_new_session": True}
    # No threads here.
    return subprocess.Popen(words, cwd=folder, env=environment, preexec_fn=limit, **pipes)  # noqa: PLW1509


def ended(program):
    """Return the exit code of a program at its end, and its errors."""
    _, errors = program.communicate()
    return program.returncode, errors


def finished(study):
    """Return when the history of each finished run was written, by its name."""
    names = [run.name for run in study.iterdir() if run.is_dir()] if study.is_dir() else []
    return {name: (study / name / "history.nc").stat().st_mtime_ns for name in names if read_result(study / name)}


def test_a_killed_program_is_continued_and_what_was_finished_stays(tmp_path):
    sweep = {"contact.friction_coefficient": MANY_FRICTIONS}
    write_block(tmp_path, sweep=sweep, time={"step": "0.5 ms"})
    study, chance, kept = tmp_path / "results" / "block", random.Random(14), dict[str, int]()
    while len(kept) < len(MANY_FRICTIONS) // 2:
        program = start(tmp_path, *RUN, "2")
        until = len(kept) + chance.randint(1, 3)
        while program.poll() is None and len(finished(study)) < until:
            time.sleep(0.05)
        os.killpg(program.pid, signal.SIGKILL)
        ended(program)
        now = finished(study)
        assert kept.items() <= now.items(), "what was finished stays as it was"
        kept = now
    assert ended(start(tmp_path, *RUN, "2"))[0] == 0
    last = finished(study)
    assert len(last) == len(MANY_FRICTIONS)
    assert kept.items() <= last.items()
    assert (study / "report.html").is_file()
    assert not [left for left in study.iterdir() if "partial" in left.name]


def test_files_that_may_not_grow(tmp_path, monkeypatch):
    """The system refuses to write more than some bytes into any file of the program."""
    write_block(tmp_path)
    most = (MOST_BYTES, MOST_BYTES)

    def limited():
        monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")  # Python does not see that it wrote a part of a file only
        return ended(start(tmp_path, *RUN, "1", limit=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, most)))

    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "compiled"))
    code, errors = limited()
    assert code == 2
    assert "error: compiled code: cannot be written (File too large), needs room" in errors
    assert "Traceback" not in errors
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    warm = tmp_path / "warm"
    warm.mkdir()
    write_block(warm)
    assert ended(start(warm, *RUN, "1"))[0] == 0  # so that all is compiled
    code, errors = limited()
    assert code != 0
    assert "history.nc: cannot be written (File too large)" in errors
    assert "Traceback" not in errors
    assert not (tmp_path / "results").exists() or not list((tmp_path / "results").rglob("*.nc"))
    assert not list(tmp_path.rglob("*.partial*"))
    assert ended(start(tmp_path, *RUN, "1"))[0] == 0
    assert len(finished(tmp_path / "results" / "block")) == len(FRICTIONS)


@pytest.fixture
def disk(tmp_path):
    """Mount a small disk, where that is allowed."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={DISK_BYTES}", "tmpfs", str(folder)]
    try:
        allowed = subprocess.run(mount, capture_output=True, check=False).returncode == 0
    except OSError:
        allowed = False
    if not allowed:
        pytest.skip("no disk may be mounted here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def fill(disk, left):
    """Fill a disk but for some bytes."""
    room = os.statvfs(disk)
    (disk / "filler").write_bytes(bytes(max(room.f_bavail * room.f_frsize - left, 0)))


def refused(program):
    code, errors = ended(program)
    assert code == 2
    assert "cannot be written (No space left on device)" in errors
    assert all(line.startswith("error: ") for line in errors.splitlines())


def test_a_full_disk_is_said_and_the_study_goes_on_after_it(tmp_path, disk):
    write_block(tmp_path)
    for left in (0, 16_384):
        fill(disk, left)
        refused(start(tmp_path, *RUN, "1", "--results", disk))
        assert not [path for path in disk.rglob("*") if "partial" in path.name]
        assert all(read_result(path.parent) for path in disk.rglob("events.json"))
        (disk / "filler").unlink()
    assert ended(start(tmp_path, *RUN, "1"))[0] == 0
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
        refused(start(tmp_path, *arguments))
        assert [path.name for path in disk.iterdir()] == ["filler"], arguments
    (disk / "filler").unlink()
    subprocess.run(["mount", "-o", "remount,size=50m", str(disk)], check=True)
    code, errors = ended(start(tmp_path, *RUN, "1", "--results", disk))
    assert code == 0, errors
    assert len(finished(disk / "block")) == len(FRICTIONS)
    assert (disk / "block" / "report.html").is_file()
