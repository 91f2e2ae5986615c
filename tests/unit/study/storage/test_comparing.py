"""Two studies side by side, from their stored results."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fingerslip.errors import ResultError
from fingerslip.study.running.runner import run_study
from fingerslip.study.storage.comparing import compare_studies

pytestmark = pytest.mark.usefixtures("reports", "simulated")


def test_the_page_stands_in_the_folder_of_the_first(write_study: Callable[..., Path], tmp_path: Path) -> None:
    path = write_study()
    folder = run_study(path, results_dir=path.parent / "results", workers=1).folder
    written = compare_studies(folder, folder)
    assert written == folder / f"comparison-{folder.name}.html"
    page = written.read_text(encoding="utf-8")
    assert "Both studies have the same values." in page
    assert "<dt>B: commit</dt>" in page or "<dt>B: study</dt>" in page
    assert compare_studies(folder, folder, tmp_path / "x.html") == tmp_path / "x.html"
    with pytest.raises(ResultError, match="holds no results of a study"):
        compare_studies(folder, tmp_path / "nowhere")
