"""The summary of a study: a row per run, and what made the results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fingerslip.errors import DamagedError, ResultError
from fingerslip.files import read_json, write_json, write_text
from fingerslip.report.tables.summary import summary_table
from fingerslip.report.tables.table import to_csv
from fingerslip.results import RunResult
from fingerslip.study.definition.spec import Study
from fingerslip.study.storage.provenance import commit, versions

__all__ = ["MANIFEST", "SUMMARY", "identities", "read_manifest", "stored_manifest", "write_manifest", "write_summary"]

#: Files in the folder of a study.
MANIFEST, SUMMARY = "manifest.json", "summary.csv"


def write_summary(runs: Sequence[RunResult], path: Path) -> None:
    """Write one row per run as comma-separated values, see :func:`~fingerslip.report.tables.summary.summary_table`.

    Raises
    ------
    ResultError
        Where the file cannot be written.
    """
    write_text(path, to_csv(summary_table(runs)))


def write_manifest(
    source: Path, study: Study, results: Sequence[RunResult], report: str, path: Path, *, given: Sequence[str] = ()
) -> None:
    """Write what made the results of a study.

    Parameters
    ----------
    source : Path
        The study file.
    study : Study
        What it holds.
    results : sequence of RunResult
        The finished runs.
    report : str
        Hash of what the report shows; empty where there is none yet.
    path : Path
        The file.
    given : sequence of str, optional
        Dotted paths of the values that the study file gives.

    Raises
    ------
    ResultError
        Where the file cannot be written.
    """
    manifest = {
        "study": source.name,
        "title": study.title,
        "compare": list(study.compare),
        "given": list(given),
        "versions": versions(),
        "commit": commit(),
        "wall_time_s": round(sum(result.seconds for result in results), 3),
        "report": report,
        "runs": {result.name: _entry(result) for result in results},
    }
    write_json(path, manifest)


def read_manifest(folder: Path) -> dict[str, Any]:
    """Return what made the results of a study; empty where there are none, or where the file is damaged."""
    try:
        return stored_manifest(folder)
    except ResultError:
        return {}


def stored_manifest(folder: Path) -> dict[str, Any]:
    """Return what made the results of a study.

    Raises
    ------
    ResultError
        Where there are none, or the file is damaged.
    """
    needed = f"{folder}: holds no results of a study; needs a folder that fingerslip run wrote"
    try:
        return read_json(folder / MANIFEST, "run the study again")
    except (FileNotFoundError, NotADirectoryError):
        raise ResultError(needed) from None
    except DamagedError as error:
        raise ResultError(f"{needed}: {error}") from None


def identities(manifest: Mapping[str, Any]) -> dict[str, str]:
    """Return the hash of the inputs of every run in a manifest, by its name."""
    return {name: str(run["identity"]) for name, run in manifest["runs"].items()}


def _entry(result: RunResult) -> dict[str, Any]:
    return {
        "identity": result.identity,
        "mesh_hash": result.mesh_hash,
        "wall_time_s": round(result.seconds, 3),
        "versions": dict(result.versions),
    }
