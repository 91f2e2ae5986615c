"""``fingerslip report``: made again from what is stored."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


def test_report_of_a_folder_without_results(invoke: Callable[..., Any], tmp_path: Path) -> None:
    result = invoke("report", tmp_path)
    assert result.exit_code == 2
    assert "holds no results of a study" in result.stderr


def test_a_page_to_write_is_for_two_studies(invoke: Callable[..., Any], tmp_path: Path) -> None:
    result = invoke("report", tmp_path, "-o", tmp_path / "page.html")
    assert result.exit_code == 2
    assert "it is where a comparison goes" in result.stderr


@pytest.mark.usefixtures("no_report")
def test_report_is_made_again_without_computing(
    invoke: Callable[..., Any], block: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from fingerslip.study.running import compute
    from fingerslip.study.storage import reporting

    invoke("run", block())
    made: list[Path] = []
    monkeypatch.setattr(reporting, "write_report", lambda stored: made.append(stored.folder))
    monkeypatch.delattr(compute, "simulate")
    result = invoke("report", "results/block")
    assert result.exit_code == 0
    assert "Slip events from accumulated slip" in result.output
    assert made == [Path("results/block")]
