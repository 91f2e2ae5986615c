"""A study runs from any script, notebook or pipe."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from unit.study.block import FRICTIONS

SCRIPT = """
import fingerslip as fs
from fingerslip.study.running import runner

print("the script runs")
runner.write_report = lambda *_: None
result = fs.run_study("block.yaml", workers=2)
print(*result.computed)
"""
PRINTED = ["the script runs", " ".join(f"friction_coefficient-{friction}" for friction in FRICTIONS)]


@pytest.mark.parametrize(
    "arguments",
    [
        pytest.param(["script.py"], marks=pytest.mark.slow),
        pytest.param(["-"], marks=pytest.mark.slow),
        pytest.param(["-m", "script"], marks=pytest.mark.slow),
    ],
    ids=["script", "standard input", "module"],
)
def test_a_script_without_a_main_guard_runs_a_study_with_several_workers(
    write_study: Callable[..., Path], arguments: list[str]
) -> None:
    folder = write_study().parent
    (folder / "script.py").write_text(SCRIPT, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, *arguments],
        input=SCRIPT if arguments == ["-"] else "",
        cwd=folder,
        env=os.environ | {"PYTHONWARNINGS": "default"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.splitlines() == PRINTED, done.stderr
    assert "Traceback" not in done.stderr
