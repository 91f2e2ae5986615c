"""The command line: every verb is found, has help, completes names, and turns errors into lines and exit codes."""

import ast
import json
import os
import re
import signal
import subprocess
import sys
import time
import warnings
from importlib import metadata
from pathlib import Path

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from fingerslip import commands
from fingerslip.commands import shared
from fingerslip.commands.app import app, command_line
from fingerslip.commands.shared import exit_code
from fingerslip.errors import ConvergenceError, InputError, ResultError
from fingerslip.storage.files import new_folder
from fingerslip.study.running import build as prepare
from fingerslip.study.running.compute import WorkerLostError
from fingerslip.study.running.runner import StudyFailedError
from places import ROOT, parsed

FOLDER = Path(commands.__file__).parent
VERBS = sorted(get_command(app).commands)


def test_every_file_of_the_folder_is_a_documented_verb_of_arguments_and_one_call():
    files = {path.stem for path in FOLDER.glob("*.py")} - {"__init__", "app", "shared"}
    assert files == set(VERBS) >= {"check", "converge", "mesh", "report", "run", "show", "validate", "verify", "view"}
    first_steps = (ROOT / "docs" / "start.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"^\| `fingerslip (\w+)[^`]*` \|", first_steps, re.MULTILINE)) == VERBS
    for verb in VERBS:
        tree = parsed(FOLDER / f"{verb}.py")
        function = next(node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == verb)
        assert len(function.body) <= 7, f"{verb} does more than call into the package"


def test_every_verb_has_help_the_version_is_said_and_wrong_use_is_exit_code_2(invoke):
    text = invoke("--help").output
    assert all(word in text for word in (*VERBS, "Exit codes", "130"))
    assert invoke("--version").output == f"fingerslip {metadata.version('fingerslip')}\n"
    for verb in VERBS:
        assert "Usage" in invoke(verb, "--help").output
    for wrong in (["fly"], ["run"], ["run", "a.yaml", "--workers", "0"], ["check", "--slow", "a.yaml"]):
        invoke(*wrong, code=2)


@pytest.mark.filterwarnings("always")
def test_a_warning_is_one_line_without_the_code_that_gave_it(invoke, monkeypatch):
    monkeypatch.setattr(
        "fingerslip.study.inspection.show.show", lambda *_: warnings.warn("too coarse", stacklevel=1) or ()
    )
    assert invoke("show").stderr == "warning: too coarse\n"


def test_not_enough_memory_is_one_line_and_debug_shows_where_an_error_comes_from(invoke, block, monkeypatch):
    def failing(*_):
        raise MemoryError

    monkeypatch.setattr(prepare, "build_mesh", failing)
    result = invoke("run", block(), code=2)
    assert result.stderr.strip() == "error: not enough memory; use larger elements or fewer --workers"
    assert isinstance(invoke("--debug", "run", "gone.yaml", code=1).exception, InputError)


@pytest.mark.parametrize("ending", ["SIGTERM", "SIGHUP", "SIGINT"])
def test_every_verb_that_is_ended_leaves_nothing_half_written(tmp_path, monkeypatch, ending):
    def train():
        with new_folder(tmp_path / "detector"):
            os.kill(os.getpid(), getattr(signal, ending))
            time.sleep(10.0)

    def other():
        pass

    monkeypatch.setattr("fingerslip.commands.app._verbs", lambda: iter([(train, ()), (other, ())]))
    # A shell in the background ignores Ctrl-C, and so do the tests that it runs.
    before = signal.signal(getattr(signal, ending), signal.SIG_DFL)
    try:
        done = CliRunner().invoke(command_line(), ["train"])
    finally:
        signal.signal(getattr(signal, ending), before)
    assert (done.exit_code, list(tmp_path.iterdir())) == (130, [])
    assert "stopped: what is finished is kept, and nothing half; the same command does the rest" in done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("words", [("show", "wang2014-2d"), ("--version",), ("--help",)])
def test_output_that_has_no_room_is_one_line(words):
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        command = [sys.executable, "-m", "fingerslip", *words]
        made = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert made.returncode == 2
    assert made.stderr.strip() == "error: standard output: takes no more, needs room; write to another disk"


def test_exit_code_is_that_of_what_the_user_can_repair():
    solved = ConvergenceError(0.5, 7, 1e-3, 1e-9, "use a smaller step")
    full = ResultError("no space")
    assert [exit_code(error) for error in (solved, full, InputError("a", "b", "c"))] == [1, 2, 2]
    assert exit_code(StudyFailedError({"a": solved, "b": solved}, ())) == 1
    assert exit_code(StudyFailedError({"a": solved, "b": full}, ())) == 2
    assert exit_code(StudyFailedError({"a": solved, "b": WorkerLostError()}, ())) == 1


def test_tables_in_a_pipe_are_not_cut_and_are_json_as_the_schema_is(invoke, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    lines = invoke("show", "wang2014-2d").output.splitlines()
    assert max(len(line) for line in lines) > 100
    assert any("phalanx.sagittal.concavity_position" in line for line in lines)
    for verb in (["show", "wang2014-2d"], ["examples"]):
        tables = json.loads(invoke(*verb, "--json").output)
        assert all(table["rows"] and len(table["rows"][0]) == len(table["columns"]) for table in tables)
    assert json.loads(invoke("schema").output)["title"] == "Study"


@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_shells_complete_the_names_that_commands_take(shell, monkeypatch):
    assert shared.specimens("wang") == ["wang2014-2d", "wang2014-3d"]
    assert shared.shipped_studies("creep") == ["creep"]
    assert shared.cameras("o") == ["oblique"]
    assert shared.fields("re") == ["region"]
    assert shared.figure_kinds("lat") == ["latency"]
    more = {"bash": {"COMP_WORDS": "fingerslip show wang", "COMP_CWORD": "2"}, "zsh": {}}[shell]
    for name, value in {**more, "_TYPER_COMPLETE_ARGS": "fingerslip show wang"}.items():
        monkeypatch.setenv(name, value)
    result = CliRunner().invoke(app, [], env={"_FINGERSLIP_COMPLETE": f"complete_{shell}"}, prog_name="fingerslip")
    assert "wang2014-2d" in result.output
    assert "wang2014-3d" in result.output
