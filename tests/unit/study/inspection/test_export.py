"""Results of a study for other programs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from fingerslip.errors import InputError, ResultError
from fingerslip.study.inspection.show import export_result
from fingerslip.study.running.runner import run_study
from unit.study.block import FRICTIONS

pytestmark = pytest.mark.usefixtures("reports", "simulated")


@pytest.fixture
def folder(write_study: Callable[..., Path]) -> Path:
    path = write_study()
    return run_study(path, results_dir=path.parent / "results", workers=1).folder


def test_a_study_is_a_table_of_its_runs(folder: Path) -> None:
    written = export_result(folder, "parquet")
    assert written == folder / "export-parquet"
    frame = pd.read_parquet(written / "runs.parquet")
    assert frame["contact.friction_coefficient"].tolist() == FRICTIONS


def test_a_run_is_the_tables_of_its_history(folder: Path, tmp_path: Path) -> None:
    written = export_result(folder / "friction_coefficient-0.2", "csv", tmp_path / "out")
    assert written == tmp_path / "out"
    assert "time_s" in (written / "series.csv").read_text(encoding="utf-8")


def test_what_is_no_result_is_refused(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(ResultError, match="holds no finished run"):
        export_result(tmp_path, "csv")
    with pytest.raises(InputError, match="format: got 'vtu', needs one of csv, json, mat, parquet"):
        export_result(folder, "vtu")
