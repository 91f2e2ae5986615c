"""What ``fingerslip export`` writes: the history of a run, or the table of a study's runs."""

from __future__ import annotations

from pathlib import Path

from fingerslip.history import read_history
from fingerslip.run_folder import HISTORY
from fingerslip.study.opened import open_study
from fingerslip.study.storage.reporting import read_stored_run
from fingerslip.study.storage.summary import read_manifest

__all__ = ["export_result"]


def export_result(target: Path, kind: str, output: Path | None = None) -> Path:
    """Write a result for other programs, whole or not at all."""
    # Data frames and the formats are slow to load: what is wrong with the result is said before.
    folder = output or target / f"export-{kind}"
    if read_manifest(target).get("runs"):
        study = open_study(target)
        from fingerslip.export.formats import export_tables

        return export_tables({"runs": study.to_dataframe()}, folder, kind)
    read_stored_run(target)
    from fingerslip.export.formats import export_history

    return export_history(read_history(target / HISTORY), folder, kind)
