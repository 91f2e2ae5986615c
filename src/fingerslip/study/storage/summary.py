"""The folder of a study: a row for each run, what made the results, and how they converge."""

from __future__ import annotations

import dataclasses
import functools
import logging
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NotRequired

import pydantic
from typing_extensions import TypedDict

from fingerslip.errors import DamagedError, ResultError
from fingerslip.report.tables.runs import summary_table
from fingerslip.report.tables.samples import sensitivity_rows
from fingerslip.results import Quantity, RefusedRun, RunResult, StudyResult
from fingerslip.sampling.sensitivity import fits_of
from fingerslip.storage.files import read_json, write_json, write_text, writing
from fingerslip.study.storage.store import commit, versions
from fingerslip.tables.table import to_csv
from fingerslip.uncertainty import Convergence, Series

#: Files in the folder of a study.
MANIFEST, SUMMARY, SENSITIVITY = "manifest.json", "summary.csv", "sensitivity.csv"

#: Name of the folder in a study's results that holds the refined runs, their tables and figures.
CONVERGENCE = "convergence"
_CONVERGENCE_FILE = "convergence.json"

_REPAIR = "run the study again"
_logger = logging.getLogger("fingerslip.study")


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
        "versions": dict(versions()),
        "commit": commit(),
        "wall_time_s": round(sum(run.seconds for run in study.runs), 3),
        "report": report,
        "derived": {
            run.name: {name: [quantity.value, quantity.unit] for name, quantity in run.derived.items()}
            for run in study.runs
            if run.derived
        },
        "runs": {
            run.name: {
                "identity": run.identity,
                "mesh_hash": run.mesh_hash,
                "wall_time_s": round(run.seconds, 3),
                "versions": dict(run.versions),
            }
            for run in study.runs
        },
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
    derived = {
        run: {name: Quantity(name, unit, value) for name, (value, unit) in quantities.items()}
        for run, quantities in manifest.get("derived", {}).items()
    }
    return StudyResult(
        folder,
        tuple(manifest["compare"]),
        tuple(dataclasses.replace(run, derived=derived.get(run.name, {})) for run in runs),
        unchanged=tuple(manifest["runs"]),
        title=manifest["title"],
        description=manifest.get("description", ""),
        ranges={path: tuple(ends) for path, ends in manifest.get("ranges", {}).items()},
        refused=refused_in(manifest),
        design=dict(manifest.get("design", {})),
    )


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


@dataclass(frozen=True)
class RunConvergence:
    """The convergence of every number of one run."""

    run: str  # its name
    identity: str  # hash of its inputs
    quantities: Mapping[str, Convergence]  # by key, see :func:`fingerslip.results.quantities`


def write_convergences(folder: Path, convergences: Mapping[str, RunConvergence]) -> None:
    """Write the convergence of the runs of a study into its results."""
    values = {
        name: {
            "identity": convergence.identity,
            "quantities": {key: _quantity_mapping(quantity) for key, quantity in convergence.quantities.items()},
        }
        for name, convergence in convergences.items()
    }
    with writing(folder):
        (folder / CONVERGENCE).mkdir(exist_ok=True)
    write_json(folder / CONVERGENCE / _CONVERGENCE_FILE, values)


def read_convergences(folder: Path, identities: Mapping[str, str]) -> dict[str, RunConvergence]:
    """Read back the convergence of the runs with these inputs."""
    try:
        stored = read_json(folder / CONVERGENCE / _CONVERGENCE_FILE, "run fingerslip converge again")
    except (FileNotFoundError, NotADirectoryError):
        return {}
    except DamagedError as error:
        _warn(f"{error}; without it no uncertainties are known")
        return {}
    return {
        name: RunConvergence(
            name, run["identity"], {key: _quantity_from(quantity) for key, quantity in run["quantities"].items()}
        )
        for name, run in stored.items()
        if run["identity"] == identities.get(name)
    }


@functools.cache
def _warn(message: str) -> None:
    """Warn once, however often the file is read."""
    _logger.warning("%s", message)


def read_uncertainties(folder: Path, identities: Mapping[str, str]) -> dict[str, dict[str, float]]:
    """Return the known uncertainties of the runs with these inputs: run, then key, to the number [SI]."""
    return {
        name: {
            key: quantity.uncertainty
            for key, quantity in convergence.quantities.items()
            if quantity.uncertainty is not None
        }
        for name, convergence in read_convergences(folder, identities).items()
    }


def _quantity_mapping(convergence: Convergence) -> dict[str, Any]:
    """Return how a number converges as plain data, with what follows from its values."""
    refinements = convergence.refinements
    return {
        "name": convergence.quantity,
        "unit": convergence.unit,
        "value": convergence.value,
        "uncertainty": convergence.uncertainty,
        "converges": not convergence.unsettled_settings,
        "sources": {
            setting: {
                "sizes": list(series.sizes),
                "values": list(series.values),
                **{
                    name: getattr(refinements[setting], name) for name in ("behaviour", "order", "limit", "uncertainty")
                },
            }
            for setting, series in convergence.sources.items()
        },
    }


def _quantity_from(stored: Mapping[str, Any]) -> Convergence:
    sources = {
        setting: Series(setting, tuple(source["sizes"]), tuple(source["values"]))
        for setting, source in stored["sources"].items()
    }
    return Convergence(stored["name"], stored["unit"], stored["value"], sources)
