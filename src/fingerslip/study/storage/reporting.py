"""From the stored runs of a study to its tables, figures and page; nothing is solved here."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fingerslip.digest import digest
from fingerslip.errors import ResultError
from fingerslip.files import new_folder
from fingerslip.history import read_history
from fingerslip.published import published
from fingerslip.report.figures.save import save_figure
from fingerslip.report.page.assemble import StudyResults, study_report
from fingerslip.report.page.page import write_page
from fingerslip.report.tables.events import RunEvents, compare_table, events_table, flatten
from fingerslip.report.tables.table import Table
from fingerslip.slip import events_from_mapping
from fingerslip.specimens.fingertip import PresetValue, preset_names, preset_table
from fingerslip.study.convergence.uncertainties import read_convergences, read_uncertainties
from fingerslip.study.definition.spec import read_study
from fingerslip.study.definition.sweep import expand
from fingerslip.study.definition.yaml import read_mapping
from fingerslip.study.running.build import build_mesh
from fingerslip.study.storage.store import read_result
from fingerslip.uncertainty import Convergence

__all__ = [
    "StoredStudy",
    "event_tables",
    "read_manifest",
    "read_stored",
    "report_again",
    "report_key",
    "stored_run",
    "write_report",
]


@dataclass(frozen=True)
class StoredStudy:
    """The finished runs of a study, and what they are shown beside.

    Parameters
    ----------
    folder : Path
        Folder of the results.
    title : str
        What the study shows.
    compare : tuple of str
        Names of published sets.
    runs : tuple of RunEvents
        The runs.
    """

    folder: Path
    title: str
    compare: tuple[str, ...]
    runs: tuple[RunEvents, ...]


def read_stored(folder: str | Path) -> StoredStudy:
    """Read the finished runs of a study back.

    Parameters
    ----------
    folder : path
        Folder of the results of a study, as ``fingerslip run`` leaves it.

    Raises
    ------
    ResultError
        Where the folder holds no results of a study.
    """
    folder = Path(folder)
    manifest = read_manifest(folder)
    if not manifest:
        raise ResultError(f"{folder}: holds no results of a study; needs a folder that fingerslip run wrote")
    known = read_uncertainties(folder, _identities(manifest))
    runs = tuple(stored_run(folder / name, known.get(name, {})) for name in manifest["runs"])
    return StoredStudy(folder, manifest["title"], tuple(manifest["compare"]), runs)


def read_manifest(folder: Path) -> dict[str, Any]:
    """Return what made the results of a study; empty where there are none."""
    try:
        manifest: dict[str, Any] = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError):
        return {}
    return manifest


def event_tables(runs: Sequence[RunEvents], compare: Sequence[str]) -> tuple[Table, ...]:
    """Return the table of events, and one beside each published set that holds for these runs.

    Parameters
    ----------
    runs : sequence of RunEvents
        The finished runs.
    compare : sequence of str
        Names of published sets.
    """
    beside = (compare_table(runs, published(name)) for name in compare)
    return (events_table(runs), *(table for table in beside if table.rows))


def report_again(folder: str | Path) -> tuple[Table, ...]:
    """Make the report of a study again from its stored histories.

    Parameters
    ----------
    folder : path
        Folder of the results of a study.

    Returns
    -------
    tuple of Table
        The events of its runs, alone and beside published ones.

    Raises
    ------
    ResultError
        Where the folder holds no results, or the report cannot be written.
    """
    stored = read_stored(folder)
    write_report(stored)
    return event_tables(stored.runs, stored.compare)


def report_key(
    title: str,
    compare: Sequence[str],
    identities: Mapping[str, str],
    uncertainties: Mapping[str, Mapping[str, float]],
) -> str:
    """Return a hash of all that a report shows, so that an unchanged one is not made again."""
    return digest([title, list(compare), dict(identities), dict(uncertainties)])


def write_report(stored: StoredStudy) -> None:
    """Make ``figures/`` and ``report.html`` of a study from its stored histories.

    Raises
    ------
    ResultError
        Where a history cannot be read, or figures and page cannot be written.
    """
    manifest = read_manifest(stored.folder)
    report = study_report(
        StudyResults(
            title=stored.title or stored.folder.name,
            runs=stored.runs,
            histories={run.label: read_history(stored.folder / run.label / "history.nc") for run in stored.runs},
            meshes=_meshes(stored, manifest),
            references=tuple(published(name) for name in stored.compare),
            parameters=_parameters(stored.runs),
            convergences=_convergences(stored.folder, manifest),
            provenance={name: str(value) for name, value in flatten(manifest).items() if not name.startswith("runs.")},
        )
    )
    with new_folder(stored.folder / "figures") as folder:
        for section in report.sections:
            for picture in section.pictures:
                save_figure(picture.figure, folder / f"{picture.name}.png")
    write_page(report, stored.folder / "report.html")


def _meshes(stored: StoredStudy, manifest: Mapping[str, Any]) -> dict[str, Any]:
    """Build the mesh of the first run with each mesh again; they are not stored."""
    first = {manifest["runs"][run.label]["mesh_hash"]: run.label for run in reversed(stored.runs)}
    meshes = {}
    for label in (run.label for run in stored.runs if run.label in first.values()):
        source = stored.folder / label / "run.yaml"
        meshes[label] = build_mesh(expand(read_study(source), source)[0])
    return meshes


def _convergences(folder: Path, manifest: Mapping[str, Any]) -> dict[str, Mapping[str, Convergence]]:
    found = read_convergences(folder, _identities(manifest))
    return {name: one.quantities for name, one in found.items()}


def _identities(manifest: Mapping[str, Any]) -> dict[str, str]:
    return {name: str(run["identity"]) for name, run in manifest["runs"].items()}


def _parameters(runs: Sequence[RunEvents]) -> tuple[PresetValue, ...]:
    """Return the preset's parameters with their sources, as the first run has them."""
    values = runs[0].values
    name = values.get("fingertip.preset")
    return preset_table(str(name)) if name in preset_names() else ()


def stored_run(folder: Path, uncertainty: Mapping[str, float]) -> RunEvents:
    """Read the events of a finished run back.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    uncertainty : mapping of str to float
        Numerical uncertainty of its events, as far as it is known.

    Raises
    ------
    ResultError
        Where there is no finished run.
    """
    result = read_result(folder)
    if result is None:
        raise ResultError(f"{folder}: holds no finished run; run the study again")
    values = flatten(read_mapping(folder / "run.yaml"))
    return RunEvents(folder.name, result["swept"], events_from_mapping(result["events_s"]), values, uncertainty)
