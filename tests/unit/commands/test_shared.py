"""What verbs share: tables on the screen and exit codes."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest


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
