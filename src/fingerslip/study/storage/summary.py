"""The summary of a study: a row per run, and what made the results."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NotRequired

import pydantic
from typing_extensions import TypedDict

from fingerslip.errors import DamagedError, ResultError
from fingerslip.report.tables.runs import summary_table
from fingerslip.report.tables.samples import sensitivity_rows
from fingerslip.results import Quantity, RefusedRun, RunResult, StudyResult
from fingerslip.sampling import fits_of
from fingerslip.storage.files import read_json, write_json, write_text
from fingerslip.study.storage.provenance import commit, versions
from fingerslip.tables.table import to_csv

__all__ = [
    "MANIFEST",
    "SENSITIVITY",
    "SUMMARY",
    "identities",
    "read_manifest",
    "refused_in",
    "stored_manifest",
    "stored_study",
    "write_manifest",
    "write_sensitivity",
    "write_summary",
]

#: Files in the folder of a study.
MANIFEST, SUMMARY, SENSITIVITY = "manifest.json", "summary.csv", "sensitivity.csv"

_REPAIR = "run the study again"


class _Run(TypedDict):
    identity: str
    mesh_hash: str
    wall_time_s: pydantic.FiniteFloat
    versions: dict[str, str]


class _Refused(TypedDict):
    swept: dict[str, Any]
    sampled: dict[str, Any]
    reason: str


class _Stored(TypedDict):
    """What the manifest of a study holds."""

    study: str
    title: str
    description: NotRequired[str]
    compare: list[str]
    given: list[str]
    ranges: NotRequired[dict[str, list[Any]]]
    design: NotRequired[dict[str, Any]]
    refused: NotRequired[dict[str, _Refused]]
    versions: dict[str, str]
    commit: str | None
    wall_time_s: pydantic.FiniteFloat
    report: str
    derived: dict[str, dict[str, tuple[pydantic.FiniteFloat | None, str]]]
    runs: dict[str, _Run]


_STORED: pydantic.TypeAdapter[Any] = pydantic.TypeAdapter(_Stored)


def write_summary(study: StudyResult) -> None:
    """Write one row per run as comma-separated values, see :func:`~fingerslip.report.tables.runs.summary_table`."""
    write_text(study.folder / SUMMARY, to_csv(summary_table(study.runs, study.refused)))


def write_sensitivity(study: StudyResult) -> None:
    """Write what each sampled value does to each slip time: a row for each time and value, see `sensitivity_rows`."""
    write_text(study.folder / SENSITIVITY, to_csv(sensitivity_rows(fits_of(study))))


def write_manifest(source: Path, study: StudyResult, report: str, *, given: Sequence[str] = ()) -> None:
    """Write what made the results of a study."""
    manifest = {
        "study": source.name,
        "title": study.title,
        **({"description": study.description} if study.description else {}),
        "compare": list(study.compare),
        "given": list(given),
        **_samples(study),
        "versions": versions(),
        "commit": commit(),
        "wall_time_s": round(sum(run.seconds for run in study.runs), 3),
        "report": report,
        "derived": {run.name: _plain(run.derived) for run in study.runs if run.derived},
        "runs": {run.name: _entry(run) for run in study.runs},
    }
    write_json(study.folder / MANIFEST, manifest)


def _samples(study: StudyResult) -> dict[str, Any]:
    """Return what was sampled, and the samples that were not computed; nothing for a study without samples."""
    if not study.ranges:
        return {}
    return {
        "ranges": {path: list(ends) for path, ends in study.ranges.items()},
        "design": dict(study.design),
        "refused": {
            sample.name: {"swept": dict(sample.swept), "sampled": dict(sample.sampled), "reason": sample.reason}
            for sample in study.refused
        },
    }


def refused_in(manifest: Mapping[str, Any]) -> tuple[RefusedRun, ...]:
    """Return the samples that were not computed."""
    return tuple(
        RefusedRun(name, dict(reason["swept"]), dict(reason["sampled"]), reason["reason"])
        for name, reason in manifest.get("refused", {}).items()
    )


def stored_study(folder: Path, manifest: Mapping[str, Any], runs: Iterable[RunResult]) -> StudyResult:
    """Return the results of a study from its manifest and its runs."""
    derived = manifest.get("derived", {})
    return StudyResult(
        folder,
        tuple(manifest["compare"]),
        tuple(dataclasses.replace(run, derived=_quantities(derived.get(run.name, {}))) for run in runs),
        unchanged=tuple(manifest["runs"]),
        title=manifest["title"],
        description=manifest.get("description", ""),
        ranges={path: tuple(ends) for path, ends in manifest.get("ranges", {}).items()},
        refused=refused_in(manifest),
        design=dict(manifest.get("design", {})),
    )


def _plain(derived: Mapping[str, Quantity]) -> dict[str, list[Any]]:
    return {name: [quantity.value, quantity.unit] for name, quantity in derived.items()}


def _quantities(stored: Mapping[str, Sequence[Any]]) -> dict[str, Quantity]:
    return {name: Quantity(name, unit, value) for name, (value, unit) in stored.items()}


def read_manifest(folder: Path) -> dict[str, Any]:
    """Return what made the results of a study; empty where there are none, or where the file is damaged."""
    try:
        return stored_manifest(folder)
    except ResultError:
        return {}


def stored_manifest(folder: Path) -> dict[str, Any]:
    """Return what made the results of a study."""
    needed = f"{folder}: holds no results of a study; needs a folder that fingerslip run wrote"
    try:
        return read_json(folder / MANIFEST, _REPAIR, _STORED)
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
