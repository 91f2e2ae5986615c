"""The summary of a study: one row per run, and what made the results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fingerslip.files import json_text, write_text
from fingerslip.report.tables.events import RunEvents, flatten, summary_table
from fingerslip.report.tables.table import to_csv
from fingerslip.slip import events_from_mapping
from fingerslip.study.definition.spec import Study
from fingerslip.study.definition.sweep import Run
from fingerslip.study.storage.provenance import commit, versions

__all__ = ["run_events", "write_manifest", "write_summary"]


def run_events(run: Run, result: Mapping[str, Any], uncertainty: Mapping[str, float]) -> RunEvents:
    """Return the events of a finished run, with all its values.

    Parameters
    ----------
    run : Run
        The run.
    result : mapping
        What is stored of it, as :func:`~fingerslip.study.storage.store.read_result` reads it.
    uncertainty : mapping of str to float
        Numerical uncertainty of its events, as far as it is known.
    """
    events = events_from_mapping(result["events_s"])
    return RunEvents(run.name, run.swept, events, flatten(run.resolved()), uncertainty)


def write_summary(runs: Sequence[RunEvents], path: Path) -> None:
    """Write one row per run as comma-separated values; an event that did not happen is an empty field.

    Raises
    ------
    ResultError
        Where the file cannot be written.
    """
    write_text(path, to_csv(summary_table(runs)))


def write_manifest(
    source: Path, study: Study, results: Mapping[str, Mapping[str, Any]], report: str, path: Path
) -> None:
    """Write what made the results of a study.

    Parameters
    ----------
    source : Path
        The study file.
    study : Study
        What it holds.
    results : mapping of str to mapping
        What is stored of every finished run, by its name.
    report : str
        Hash of what the report shows; empty where there is none yet.
    path : Path
        The file.

    Raises
    ------
    ResultError
        Where the file cannot be written.
    """
    kept = ("identity", "mesh_hash", "wall_time_s", "versions")
    manifest = {
        "study": source.name,
        "title": study.title,
        "compare": list(study.compare),
        "versions": versions(),
        "commit": commit(),
        "wall_time_s": round(sum(result["wall_time_s"] for result in results.values()), 3),
        "report": report,
        "runs": {name: {key: result[key] for key in kept} for name, result in results.items()},
    }
    write_text(path, json_text(manifest))
