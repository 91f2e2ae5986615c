"""From the stored runs of a study to its tables, figures and page; nothing is solved here."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import ResultError
from fingerslip.history import read_history, stored_phases
from fingerslip.published import published_set
from fingerslip.report.tables.compare import compare_table
from fingerslip.report.tables.runs import events_table
from fingerslip.report.tables.samples import sample_tables
from fingerslip.results import HISTORY, RUN, RunResult, StudyResult
from fingerslip.slip.windows import slide_window
from fingerslip.storage.files import digest, new_folder, read_json, write_bytes
from fingerslip.study.storage.store import read_run
from fingerslip.study.storage.summary import (
    MANIFEST,
    identities,
    read_convergences,
    read_manifest,
    read_uncertainties,
    stored_manifest,
    stored_study,
)
from fingerslip.study.storage.values import read_run_values, value_rows
from fingerslip.tables.table import Table

if TYPE_CHECKING:
    import xarray as xr

    from fingerslip.report.content import Film, ReportContent, RunPictures
    from fingerslip.report.page.comparison import ComparedStudy

#: File in the folder of a study.
REPORT = "report.html"
#: Folder of the cameras in that of a run, and file that says how good the tracks of a camera are.
CAMERAS, ERRORS = "cameras", "errors.json"

_FILM_REPAIR = "remove its folder and run the study again"


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
    from fingerslip.report.content import MOST_RUNS, ReportContent
    from fingerslip.report.page.assemble import notes_html
    from fingerslip.report.page.samples import representatives
    from fingerslip.study.running.build import build_mesh

    manifest = read_manifest(study.folder)
    convergences = read_convergences(study.folder, identities(manifest))
    runs = {run.name: read_run_values(study.folder / run.name / RUN) for run in study.runs}
    # The models of all meshes are shown, of other runs no more than the first; of samples none.
    first = {run.mesh_hash: run.name for run in reversed(study.runs) if not study.ranges}.values()
    meshed = [name for name in runs if name in first and (name not in pictures or pictures[name].model is None)]
    drawn = [run.name for run in study.runs if not study.ranges][:MOST_RUNS]
    histories = {name: read_history(study.folder / name / HISTORY) for name in dict.fromkeys((*drawn, *meshed))}
    starts = slide_starts(study)
    # Of samples those are seen in motion that stand for others.
    typical = [sample.run.name for sample in representatives(study, starts)] if study.ranges else []
    return ReportContent(
        study=study,
        histories=histories,
        meshes={name: build_mesh(runs[name]) for name in meshed},
        pictures={
            name: picture if name in first else dataclasses.replace(picture, model=None)
            for name, picture in pictures.items()
        },
        references=tuple(published_set(name) for name in study.compare),
        values=value_rows(list(runs.values()), manifest.get("given") or None),
        provenance=provenance_of(study.folder, manifest),
        convergences={name: convergence.quantities for name, convergence in convergences.items()},
        films=read_films(study.folder, {name: histories[name] for name in drawn}),
        starts=starts,
        notes=notes_html(study.folder),
        representatives={name: read_history(study.folder / name / HISTORY) for name in typical},
    )


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


def film_keys(folder: Path, runs: Sequence[str]) -> list[str]:
    """Return what tells the films of some runs from others, for the key of a report."""
    return [str(read_json(path, _FILM_REPAIR)["key"]) for run in runs for path in _stored_films(folder / run)]


def read_films(folder: Path, histories: Mapping[str, xr.Dataset]) -> tuple[Film, ...]:
    """Read the films of the runs whose histories are shown, as far as a report shows them."""
    return tuple(
        _film(run, path.parent, history) for run, history in histories.items() for path in _stored_films(folder / run)
    )


def _stored_films(run: Path) -> list[Path]:
    return sorted(run.glob(f"{CAMERAS}/*/{ERRORS}"))


def _film(run: str, folder: Path, history: xr.Dataset) -> Film:
    # Pictures and videos are slow to load, and few studies have cameras.
    from fingerslip.report.content import Film
    from fingerslip.vision.tracks import read_tracks

    numbers = read_json(folder / ERRORS, _FILM_REPAIR)
    truth = read_tracks(folder / "truth.nc")
    displayed = {name: numbers[name] for name in ("frames", "markers", "rms", "largest", "kept", "swapped")}
    tracks = read_tracks(folder / "tracks" / "matched.nc")
    return Film(run, folder.name, tracks, truth, displayed, _frames(folder / "video.avi", truth, history))


def _frames(video: Path, truth: xr.Dataset, history: xr.Dataset) -> dict[float, NDArray[np.uint8]]:
    """Return the frames that a report shows by their times [s]; none without a video or a slide."""
    from fingerslip.report.figures.markers import film_times
    from fingerslip.vision.video import read_frames

    window, times = slide_window(history), truth["time"].values
    if not video.is_file() or window is None:
        return {}
    wanted = [int(np.abs(times - time).argmin()) for time in film_times(window.start, window.end, float(times[0]))]
    frames = {}
    for number, frame in enumerate(read_frames(video)):
        if number in wanted:
            frames[float(times[number])] = frame
        if number >= max(wanted):
            break
    return frames


def compare_studies(first: str | Path, second: str | Path, output: Path | None = None) -> Path:
    """Write the page of two studies side by side, from their stored results."""
    from fingerslip.report.page.comparison import comparison_report
    from fingerslip.report.page.page import write_page

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
    from fingerslip.report.page.comparison import ComparedStudy

    study = read_results(folder)
    specified = [read_run_values(folder / run.name / RUN) for run in study.runs]
    values = value_rows(specified, read_manifest(folder).get("given") or None)
    return ComparedStudy(study, values, slide_starts(study))
