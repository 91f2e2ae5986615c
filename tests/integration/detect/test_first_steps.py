"""The small data set that ships goes through every command of the detectors with their defaults."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from fingerslip.commands.app import app


@pytest.mark.slow
def test_the_small_data_set_is_simulated_learned_and_evaluated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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
        result = CliRunner().invoke(app, command.split())
        assert result.exit_code == 0, (command, result.output)
    assert (tmp_path / "evaluation" / "1-accuracy-on-frames.csv").is_file()
