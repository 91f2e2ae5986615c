"""``fingerslip run``: results, exit codes, and one line per mistake with nothing written."""

import errno
import json
import os
import re
import signal
import subprocess
import sys
import time

import pytest

from fingerslip.study.storage import store
from unit.commands.conftest import contents


@pytest.mark.usefixtures("no_report")
def test_run_shows_events_second_time_nothing_is_done_and_quiet_hides_the_progress_and_no_answer(invoke, block):
    path = block()
    first = invoke("run", path, "--quiet")
    assert first.stderr == ""
    assert "Slip events" in first.stdout
    again = invoke("run", path, "-q", "--json")
    assert again.stderr == ""
    assert json.loads(again.stdout)[0]["rows"]
    again = invoke("run", path)
    assert "block/run: unchanged" in again.stderr
    assert "Slip events" in again.output
    assert "Measures" in invoke("show", "results/block/run").output


CONTACT = {"friction_coefficient": 0.6, "boundary": "bottom"}
MISTAKES = {
    "missing unit": ({"depth": 1}, "depth: '1' has no unit, needs a unit of [m]; write '1 mm' or '1 m'"),
    "no such boundary": (
        {"contact": CONTACT | {"boundary": "pulp"}},
        "boundary 'pulp' not in mesh, it has: bottom, top",
    ),
}


@pytest.fixture
def refused(invoke, tmp_path):
    """Return a function that runs a study that is refused, and returns the lines of the errors; nothing is written."""

    def refuse(path):
        before = contents(tmp_path)
        result = invoke("run", path, code=2)
        assert contents(tmp_path) == before
        assert "Traceback" not in result.output
        return [line for line in result.stderr.splitlines() if line]

    return refuse


@pytest.mark.parametrize(("changes", "message"), MISTAKES.values(), ids=MISTAKES)
def test_mistake_gives_one_error_and_nothing_is_written(refused, block, changes, message):
    path = block(**changes)
    (error,) = refused(path)
    assert error.startswith(f"error: {path}: ")
    assert message in error


def test_mistakes_of_all_studies_come_together(invoke, block):
    path = block(depth=1, sweep={"time.end": ["1 s", 2]})
    lines = invoke("check", path, "gone.yaml", code=2).stderr.splitlines()
    assert [line.split(": ")[:2] for line in lines] == [["error", str(path)]] * 2 + [["error", "gone.yaml"]]
    assert re.search(r"depth: '1' has no unit.* \(line \d+\)$", lines[0])


def test_contact_outside_the_candidates_and_a_full_disk_are_exit_code_2(refused, block, monkeypatch):
    # A rounded bottom of which only the lowest nodes may touch is pressed flat.
    error = " ".join(refused(block(curvature=10.0, contact=CONTACT | {"search_distance": "0.001 mm"})))
    assert "reached the counterface but is no contact candidate" in error
    assert "write a larger search_distance" in error

    def full(*arguments, **options):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(store, "write_snapshots", full)
    error = " ".join(refused(block()))
    assert "No space left on device" in error
    assert "free some space or choose another folder" in error


@pytest.mark.usefixtures("no_report")
def test_finished_runs_are_shown_also_where_others_failed(invoke, block, fails):
    fails(friction=0.4)
    result = invoke("run", block(sweep={"contact.friction_coefficient": [0.2, 0.4]}), "--workers", "1", code=1)
    assert re.search(r"^ *0\.2 ", result.output, re.MULTILINE)
    assert not re.search(r"^ *0\.4 ", result.output, re.MULTILINE)
    assert "error: block/friction_coefficient-0.4: contact at t = 0.5 s" in result.stderr
    assert "1 of 2 runs failed, the others are finished" in result.stderr


@pytest.fixture
def long_study(block):
    """Return a study of several runs that take some seconds each."""
    return block(time={"step": "0.02 ms"}, sweep={"contact.friction_coefficient": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]})


def _started(path, results):
    command = [sys.executable, "-m", "fingerslip", "run", str(path), "--results", str(results)]
    # A new session, so that only the command itself gets the signal, as from a job scheduler. Tests that run in the
    # background inherit that Ctrl-C is ignored: here it counts, as on a terminal.
    with subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # noqa: PLW1509
    ) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_stopped_study_leaves_finished_runs_alone(long_study, tmp_path, sent):
    folder = tmp_path / "results" / "block"
    for process in _started(long_study, tmp_path / "results"):
        deadline = time.monotonic() + 240.0
        while not list(folder.glob(".*.partial")) and time.monotonic() < deadline:
            time.sleep(0.02)
        assert list(folder.glob(".*.partial"))
        process.send_signal(sent)
        _, said = process.communicate(timeout=60)
        assert process.returncode == 130
        assert "the same command does the rest" in said
        assert "Traceback" not in said
    assert list((tmp_path / "results").rglob(".*")) == []
