"""``python -m fingerslip`` is the command, and importing it runs nothing."""

import runpy
import subprocess
import sys
from importlib import import_module
from importlib.metadata import version

import pytest

from fingerslip.commands.app import app


def test_module_runs_as_the_command():
    done = subprocess.run([sys.executable, "-m", "fingerslip", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"fingerslip {version('fingerslip')}\n"


def test_usage_names_the_command_and_not_the_file(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["/somewhere/__main__.py", "run", "--help"])
    with pytest.raises(SystemExit) as end:
        runpy.run_module("fingerslip", run_name="__main__")
    assert end.value.code == 0
    assert "Usage: fingerslip run" in capsys.readouterr().out


def test_importing_it_runs_nothing(capsys):
    assert import_module("fingerslip.__main__").app is app
    assert capsys.readouterr() == ("", "")
