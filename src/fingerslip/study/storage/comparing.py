"""The report of two studies side by side, from their stored results."""

from __future__ import annotations

from pathlib import Path

from fingerslip.report.page.comparison import ComparedStudy, comparison_report
from fingerslip.report.page.page import write_page
from fingerslip.results import RUN
from fingerslip.study.storage.reporting import provenance_of, read_results, slide_starts
from fingerslip.study.storage.summary import read_manifest
from fingerslip.study.storage.values import read_run_values, value_rows

__all__ = ["compare_studies"]


def compare_studies(first: str | Path, second: str | Path, output: Path | None = None) -> Path:
    """Write the page of two studies side by side."""
    folders = Path(first), Path(second)
    compared = [_compare(folder) for folder in folders]
    provenance = {
        f"{side}: {name}": value
        for side, folder in zip("AB", folders, strict=True)
        for name, value in provenance_of(folder, read_manifest(folder)).items()
    }
    path = output or folders[0] / f"comparison-{folders[1].resolve().name}.html"
    write_page(comparison_report(compared[0], compared[1], provenance), path)
    return path


def _compare(folder: Path) -> ComparedStudy:
    study = read_results(folder)
    specified = [read_run_values(folder / run.name / RUN) for run in study.runs]
    values = value_rows(specified, read_manifest(folder).get("given") or None)
    return ComparedStudy(study, values, slide_starts(study))
