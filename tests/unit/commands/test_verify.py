"""``fingerslip verify``: one table and an exit code."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest


def replace_problems(monkeypatch: pytest.MonkeyPatch, *problems: Any) -> None:
    from fingerslip.verification import catalogue, verify

    known = {one.name: one for one in problems}
    monkeypatch.setattr(catalogue, "FILES", {"made": tuple(known)})
    monkeypatch.setattr(verify, "problem", known.__getitem__)


def test_verify_prints_one_table_and_fails_where_a_check_does(
    invoke: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from fingerslip.verification.problem import Problem, relative

    def problem(name: str, got: float) -> Problem:
        return Problem(name, "Half", "Arithmetic", slow=False, compute=lambda: (relative("half", 0.5, got, 1e-3),))

    replace_problems(monkeypatch, problem("right", 0.5), problem("wrong", 0.6))
    right = invoke("verify", "--only", "right", "--markdown")
    assert right.exit_code == 0
    assert "| right | half | 0.5 | 0.5 | 0.0e+00 | 1.0e-03 | yes |" in right.stdout
    wrong = invoke("verify")
    assert wrong.exit_code == 1
    assert "1 of 2 checks passed" in wrong.stdout
    unknown = invoke("verify", "--only", "rihgt")
    assert unknown.exit_code == 2
    assert "may be one of right, wrong" in unknown.stderr


def test_verify_goes_on_where_a_problem_cannot_be_computed(
    invoke: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from fingerslip.errors import ConvergenceError
    from fingerslip.verification.problem import Problem, relative

    def fail() -> Any:
        raise ConvergenceError(0.5, 7, 1e-3, 1e-10, "try a smaller time step")

    whole = Problem("whole", "One", "Arithmetic", slow=False, compute=lambda: (relative("one", 1.0, 1.0, 1e-3),))
    replace_problems(monkeypatch, Problem("lost", "Lost", "None", slow=False, compute=fail), whole)
    done = invoke("verify")
    assert done.exit_code == 1
    assert "could not be computed" in done.stdout
    assert "1 of 2 checks passed" in done.stdout


def test_verify_can_be_quiet(invoke: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    from fingerslip.verification.problem import Problem, relative

    found = Problem("right", "Half", "Arithmetic", slow=False, compute=lambda: (relative("half", 0.5, 0.5, 1e-3),))
    replace_problems(monkeypatch, found)
    assert invoke("verify").stderr
    assert not invoke("verify", "--quiet").stderr


def test_json_has_numbers_and_nothing_else_is_printed(invoke: Callable[..., Any]) -> None:
    done = invoke("verify", "--only", "patch", "--json")
    (table,) = json.loads(done.stdout, parse_constant=pytest.fail)
    assert [column["name"] for column in table["columns"]][2:7] == [
        "expected",
        "got",
        "error",
        "allowed",
        "kind of error",
    ]
    assert all(isinstance(cell, float) for row in table["rows"] for cell in row[2:6])


def test_names_are_listed_without_computing(invoke: Callable[..., Any]) -> None:
    done = invoke("verify", "--list")
    assert (done.exit_code, done.stderr) == (0, "")
    assert {"patch", "cattaneo", "cook"} <= set(done.stdout.split())
