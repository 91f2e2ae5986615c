"""What verbs share: tables on the screen and exit codes."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from typer.testing import CliRunner

from fingerslip.commands import shared
from fingerslip.commands.app import app


def test_exit_code_is_that_of_what_the_user_can_repair() -> None:
    from fingerslip.commands.shared import exit_code
    from fingerslip.errors import ConvergenceError, InputError, ResultError
    from fingerslip.study.running.pool import WorkerLostError
    from fingerslip.study.running.runner import StudyFailedError

    solved = ConvergenceError(0.5, 7, 1e-3, 1e-9, "use a smaller step")
    full = ResultError("no space")
    assert [exit_code(error) for error in (solved, full, InputError("a", "b", "c"))] == [1, 2, 2]
    assert exit_code(StudyFailedError({"a": solved, "b": solved}, ())) == 1
    assert exit_code(StudyFailedError({"a": solved, "b": full}, ())) == 2
    assert exit_code(StudyFailedError({"a": solved, "b": WorkerLostError()}, ())) == 1


def test_tables_in_a_pipe_are_not_cut(invoke: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    lines = invoke("show", "wang2014-2d").output.splitlines()
    assert max(len(line) for line in lines) > 100
    assert any("phalanx.sagittal.concavity_position" in line for line in lines)


@pytest.mark.parametrize("verb", [["show", "wang2014-2d"], ["examples"]])
def test_tables_are_printed_as_json(invoke: Callable[..., Any], verb: list[str]) -> None:
    tables = json.loads(invoke(*verb, "--json").output)
    assert all(table["rows"] and len(table["rows"][0]) == len(table["columns"]) for table in tables)


def test_shells_complete_the_names_that_commands_take() -> None:
    assert shared.specimens("wang") == ["wang2014-2d", "wang2014-3d"]
    assert shared.shipped_studies("creep") == ["creep"]
    assert shared.cameras("o") == ["oblique"]
    assert shared.fields("re") == ["region"]
    assert shared.figure_kinds("lat") == ["latency"]


@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_a_shell_is_told_presets(shell: str, monkeypatch: pytest.MonkeyPatch) -> None:
    more = {"bash": {"COMP_WORDS": "fingerslip show wang", "COMP_CWORD": "2"}, "zsh": {}}[shell]
    for name, value in {**more, "_TYPER_COMPLETE_ARGS": "fingerslip show wang"}.items():
        monkeypatch.setenv(name, value)
    result = CliRunner().invoke(app, [], env={"_FINGERSLIP_COMPLETE": f"complete_{shell}"}, prog_name="fingerslip")
    assert "wang2014-2d" in result.output
    assert "wang2014-3d" in result.output
