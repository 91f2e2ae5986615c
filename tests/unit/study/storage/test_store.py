"""What is stored of a run."""

from __future__ import annotations

from pathlib import Path

import pytest

from fingerslip.study.storage.store import read_result


@pytest.mark.parametrize("text", ["", "{", "not json"])
def test_damaged_result_counts_as_none(tmp_path: Path, text: str) -> None:
    (tmp_path / "events.json").write_text(text)
    (tmp_path / "history.nc").write_text("")
    assert read_result(tmp_path) is None


def test_result_without_its_history_counts_as_none(tmp_path: Path) -> None:
    (tmp_path / "events.json").write_text("{}")
    assert read_result(tmp_path) is None
