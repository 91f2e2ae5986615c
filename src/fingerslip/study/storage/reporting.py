"""From the stored runs of a study to its tables, figures and page; nothing is solved here."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fingerslip.errors import ResultError
from fingerslip.history import read_history, stored_phases
from fingerslip.published import published_set
from fingerslip.report.tables.compare import compare_table
from fingerslip.report.tables.runs import events_table
from fingerslip.report.tables.samples import sample_tables
from fingerslip.results import HISTORY, RUN, RunResult, StudyResult
from fingerslip.storage.files import digest, new_folder, write_bytes
from fingerslip.study.convergence.storage import read_convergences, read_uncertainties
from fingerslip.study.definition.spec import read_study
from fingerslip.study.definition.sweep import expand
from fingerslip.study.storage.store import read_run
from fingerslip.study.storage.summary import MANIFEST, identities, read_manifest, stored_manifest, stored_study
from fingerslip.study.storage.values import read_run_values, value_rows
from fingerslip.tables.table import Table

if TYPE_CHECKING:
    import xarray as xr

    from fingerslip.report.page.content import ReportContent, RunPictures

__all__ = [
    "REPORT",
    "event_tables",
    "provenance_of",
    "read_results",
    "read_stored_run",
    "report_again",
    "report_key",
    "slide_starts",
    "study_tables",
    "write_report",
]

#: File in the folder of a study.
REPORT = "report.html"


def read_results(folder: str | Path) -> StudyResult:
    """Read the finished runs of a study back."""
    folder = Path(folder)
    manifest = stored_manifest(folder)
    uncertainties = read_uncertainties(folder, identities(manifest))
    return stored_study(
        folder, manifest, (read_run(folder / name, uncertainties.get(name, {})) for name in manifest["runs"])
    )


def read_stored_run(folder: str | Path) -> RunResult:
    """Read one finished run back, with all its values and the uncertainties that are known."""
    folder = Path(folder)
    runs = read_manifest(folder).get("runs")
    if runs:
        raise ResultError(f"{folder}: holds a study; needs the folder of one of its runs: {', '.join(runs)}")
    run = read_run(folder, {})
    uncertainties = read_uncertainties(folder.parent, {folder.name: run.identity})
    return dataclasses.replace(run, uncertainty=uncertainties.get(folder.name, {}))


def study_tables(study: StudyResult) -> tuple[Table, ...]:
    """Return the tables that the command line prints of a study: its events, or what its samples come to."""
    if study.ranges:
        return sample_tables(study, [published_set(name) for name in study.compare])
    return event_tables(study.runs, study.compare)


def event_tables(runs: Sequence[RunResult], compare: Sequence[str]) -> tuple[Table, ...]:
    """Return the table of events, and one beside each published set that has events."""
    beside = (compare_table(runs, published_set(name)) for name in compare)
    return (events_table(runs), *(table for table in beside if table.rows))


def report_again(folder: str | Path) -> tuple[Table, ...]:
    """Make the report of a study again from its stored histories."""
    stored = read_results(folder)
    write_report(stored)
    return study_tables(stored)


def report_key(
    title: str,
    compare: Sequence[str],
    inputs: Mapping[str, str],
    uncertainties: Mapping[str, Mapping[str, float]],
    *more: Sequence[str],
) -> str:
    """Return a hash of all that a report shows, so that an unchanged one is not made again."""
    return digest([title, list(compare), dict(inputs), dict(uncertainties), *map(list, more)])


def write_report(study: StudyResult, pictures: Mapping[str, RunPictures] | None = None) -> None:
    """Make ``figures/`` and ``report.html`` of a study from its stored histories."""
    from fingerslip.report.page.assemble import study_report
    from fingerslip.report.page.page import write_page

    report = study_report(_content(study, pictures or {}))
    with new_folder(study.folder / "figures") as folder:
        for picture in report.pictures:
            write_bytes(folder / f"{picture.name}.png", picture.png)
    write_page(report, study.folder / REPORT)


def _content(study: StudyResult, pictures: Mapping[str, RunPictures]) -> ReportContent:
    from fingerslip.report.page.content import MOST_RUNS, ReportContent
    from fingerslip.report.page.notes import notes_html
    from fingerslip.study.storage.films import read_films

    manifest = read_manifest(study.folder)
    convergences = read_convergences(study.folder, identities(manifest))
    specified = [read_run_values(study.folder / run.name / RUN) for run in study.runs]
    first = [] if study.ranges else _first_of_meshes(study)
    # The models of all meshes are shown, of other runs no more than the first.
    meshed = [name for name in first if name not in pictures or pictures[name].model is None]
    drawn = [run.name for run in study.runs if not study.ranges][:MOST_RUNS]
    histories = {name: read_history(study.folder / name / HISTORY) for name in dict.fromkeys((*drawn, *meshed))}
    starts = slide_starts(study)
    return ReportContent(
        study=study,
        histories=histories,
        meshes={name: _mesh(study, name) for name in meshed},
        pictures={
            name: picture if name in first else dataclasses.replace(picture, model=None)
            for name, picture in pictures.items()
        },
        references=tuple(published_set(name) for name in study.compare),
        values=value_rows(specified, manifest.get("given") or None),
        provenance=provenance_of(study.folder, manifest),
        convergences={name: convergence.quantities for name, convergence in convergences.items()},
        films=read_films(study.folder, {name: histories[name] for name in drawn}),
        starts=starts,
        notes=notes_html(study.folder),
        representatives=_representatives(study, starts),
    )


def _representatives(study: StudyResult, starts: Mapping[str, float]) -> dict[str, xr.Dataset]:
    """Return the histories of samples that are seen in motion."""
    if not study.ranges:
        return {}
    from fingerslip.report.page.samples import representatives

    names = [representative.run.name for representative in representatives(study, starts)]
    return {name: read_history(study.folder / name / HISTORY) for name in names}


def slide_starts(study: StudyResult) -> dict[str, float]:
    """Return when the slide of each run begins [s]; runs in which nothing slides are left out."""
    slides = {run.name: stored_phases(study.folder / run.name / HISTORY, "slide") for run in study.runs}
    return {name: slide[0][0] for name, slide in slides.items() if slide}


_MINUTE = "%Y-%m-%d %H:%M %Z"  # of any time zone, those that datetime refuses too


def provenance_of(folder: Path, manifest: Mapping[str, Any]) -> dict[str, str]:
    """Return what made the results, in words: file, dates, commit, computing time, and the versions of all programs."""
    written = time.localtime((folder / MANIFEST).stat().st_mtime)
    words = {
        "study": manifest.get("study"),
        "results of": time.strftime(_MINUTE, written),
        "page of": time.strftime(_MINUTE),
        "commit": manifest.get("commit"),
        "computing time": f"{manifest['wall_time_s']:g} s" if "wall_time_s" in manifest else None,
        **manifest.get("versions", {}),
    }
    return {name: str(value) for name, value in words.items() if value}


def _first_of_meshes(study: StudyResult) -> list[str]:
    """Return the names of the first runs with each mesh."""
    first: dict[str, str] = {}
    for run in study.runs:
        first.setdefault(run.mesh_hash, run.name)
    return list(first.values())


def _mesh(study: StudyResult, name: str) -> Any:
    """Build the mesh of a run again; it is not stored."""
    from fingerslip.study.running.build import build_mesh

    source = study.folder / name / RUN
    return build_mesh(expand(read_study(source), source)[0])
