"""The commands of the detectors, as pages print them."""

import re
import shlex
import textwrap
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fingerslip.commands.app import app
from fingerslip.detect.labels import write_onsets
from fingerslip.detect.samples import benchmark_test_trials
from fingerslip.detect.trials import open_trials
from places import DOCS

pytestmark = pytest.mark.slow


def test_the_small_data_set_is_simulated_learned_and_evaluated(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    commands = (
        "examples bulens2023_dataset_small",
        "detect simulate bulens2023_dataset_small.yaml",
        "detect train trials",
        "detect evaluate trials",
        "detect inquire trials",
        "detect run trials/trial-0000/tracks.nc",
    )
    for command in commands:
        run(command)
    assert (tmp_path / "evaluation" / "1-accuracy-on-frames.csv").is_file()


PAGE = (DOCS / "tutorial-detector.md").read_text(encoding="utf-8")
# A command goes on in the next line after a backslash.
COMMANDS = re.findall(r"^ *\$ fingerslip (.*)$", PAGE.replace("\\\n", " "), re.MULTILINE)


def test_ten_commands_make_a_detector(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    making, submitting = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(compile(making, "tutorial-detector.md", "exec"), {})
    assert len(list(Path("recordings").glob("*.mkv"))) == 24
    assert len(COMMANDS) == 10
    printed = [run(command) for command in COMMANDS[:9]]
    assert Path("recordings/slide-0000_tracks/quality.html").is_file()
    assert "trials: 12 trials" in printed[1]
    assert "Accuracy on frames" in printed[2]
    assert len(list(Path("inquiry").glob("*.png"))) == 3
    assert "no guarantee" in printed[4]
    assert printed[4].endswith("test trials, not seen: slide-0004, slide-0011\n")
    assert all("processed a second" in text for text in printed[5:7])
    assert "found before gross slip" in printed[8]
    exec(compile(textwrap.dedent(submitting), "tutorial-detector.md", "exec"), {})
    assert "onset error" in run(COMMANDS[9])
    trials = open_trials("trials")
    tests = benchmark_test_trials(trials.names)
    write_onsets({name: trials.onsets()[name] for name in tests}, "submission.csv")
    assert "0.000" in run(COMMANDS[9])


def run(command):
    """Run a command of the page and return what it prints."""
    found = CliRunner().invoke(app, shlex.split(command))
    assert found.exit_code == 0, f"{command}\n{found.output}"
    return str(found.stdout)
