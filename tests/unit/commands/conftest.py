"""The command in an empty folder, and a small study for it."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import typer.testing
from typer.testing import CliRunner

from fingerslip.commands.app import app
from unit.study.block import block_values
from unit.study.conftest import draw_nothing, fails, settled, write_study

__all__ = ["fails", "settled", "write_study"]

# The verbs and their options are read once and not by each call.
typer.testing._get_command = functools.cache(typer.testing._get_command)


@pytest.fixture
def invoke(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Return a function that calls the command in an empty folder, and holds that it ends with an exit code."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")

    def call(*arguments: object, code: int = 0) -> Any:
        result = CliRunner().invoke(app, [str(argument) for argument in arguments])
        assert result.exit_code == code, result.output
        return result

    return call


@pytest.fixture
def block(write_study: Callable[..., Path]) -> Callable[..., Path]:
    """Return a function that writes the study of a block, with some values changed, and its mesh."""

    def write(curvature: float = 0.0, **changes: Any) -> Path:
        return write_study(block_values() | {"sweep": {}} | changes, curvature=curvature)

    return write


@pytest.fixture
def no_report(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the figures and the page out."""
    draw_nothing(monkeypatch)


def contents(folder: Path) -> list[str]:
    """Return the relative paths of all files and folders below a folder, sorted."""
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))
