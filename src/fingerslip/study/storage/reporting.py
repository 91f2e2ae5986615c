"""From the stored runs of a study to its values, tables, figures and page; nothing is solved here."""

from __future__ import annotations

import dataclasses
import itertools
import re
import time
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import ResultError
from fingerslip.history import read_history, stored_phases
from fingerslip.libraries import xr
from fingerslip.materials.choice import MATERIALS, PRESET, material_of
from fingerslip.materials.large_strain import FiniteMaterial
from fingerslip.parameters import Leaf, walk_values
from fingerslip.parameters.dotted import is_below, known_part
from fingerslip.parameters.presets import Presets, PresetValue
from fingerslip.published import published_set
from fingerslip.report.labels import run_title
from fingerslip.report.tables.compare import compare_table
from fingerslip.report.tables.parameters import DEFAULT, NOT_USED, ShownValue
from fingerslip.report.tables.runs import doubt_warnings, events_table, run_caveats
from fingerslip.report.tables.samples import sample_tables
from fingerslip.results import HISTORY, RUN, RunResult, StudyResult
from fingerslip.slip.measures import resolution_warnings
from fingerslip.slip.windows import slide_window
from fingerslip.specimens.choice import SPECIMENS
from fingerslip.specimens.protocol import ModelUse, Specimen
from fingerslip.storage.files import new_folder, read_json, write_bytes
from fingerslip.study.definition.runs import Run, read_runs, with_directions
from fingerslip.study.definition.spec import NOT_OF_A_RUN, Study
from fingerslip.study.storage import store
from fingerslip.tables.table import Table
from fingerslip.units import Unit

if TYPE_CHECKING:
    from fingerslip.react.results import Reactions
    from fingerslip.report.content import Film, ReportContent, RunPictures
STUDY_FILE, SWEPT = "study file", "study file, swept"

# Values of a sweep that a cell of a table shows.
_MOST_VALUES = 12

_MODULUS = Unit("Pa", "kPa")

# Keys of a study file that describe the study and no run.
_ABOUT = ("title", *NOT_OF_A_RUN)


# A shown value of one run, and its text in the unit of its field, for joining it with the texts of other runs.
_Row: TypeAlias = tuple[ShownValue, str]


def read_run_values(path: Path) -> Run:
    """Read a run with all its values from its ``run.yaml``."""
    return read_runs(path).runs[0]


def value_rows(runs: Sequence[Run], paths: Collection[str] | None = None) -> tuple[ShownValue, ...]:
    """Return every value of some runs of one study, in the order of the study file."""
    result: dict[str, list[_Row]] = {}
    for run in runs:
        at_rest = notes_at_rest(run)
        for shown, text in _rows(run, paths):
            note = "; ".join(filter(None, (shown.note, at_rest.get(shown.path, ""))))
            result.setdefault(shown.path, []).append((dataclasses.replace(shown, note=note), text))
    values = []
    for path, rows in result.items():
        texts = list(dict.fromkeys(text for _, text in rows))
        if len(texts) == 1 and len(rows) == len(runs):
            values.append(rows[0][0])
            continue
        partly = f"in {len(rows)} of {len(runs)} runs" if len(rows) < len(runs) else ""
        notes = dict.fromkeys(text for text in (partly, *(shown.note for shown, _ in rows)) if text)
        texts = [f"({text})" if "," in text else text for text in texts]
        listed = ", ".join(texts) if len(texts) <= _MOST_VALUES else f"{texts[0]}, … ({len(texts)} values)"
        values.append(ShownValue(path, listed, SWEPT, "; ".join(notes)))
    return tuple(values)


def notes_at_rest(run: Run) -> dict[str, str]:
    """Return what is computed in place of laws of large strain at small strain, by the paths of these laws."""
    groups = {f"{run.study.specimen_kind}.materials": run.specimen.materials if run.specimen else {}}
    groups["materials"] = {name: material_of(entry) for name, entry in run.study.materials.items()}
    return {
        f"{group}.{name}.law": f"taken as Hooke's law with its modulus at rest, E = {_MODULUS.format(modulus)}"
        for group, laws in groups.items()
        for name, law in laws.items()
        if run.study.kinematics == "small" and isinstance(law, FiniteMaterial)
        for modulus in [float(f"{law.stiffness:.4g}")]
    }


def _rows(run: Run, paths: Collection[str] | None) -> Iterator[_Row]:
    if run.specimen is not None:
        yield from _specimen_rows(run, run.specimen, paths)
    if run.study.is_solid and run.study.formulation is None:
        yield _row("formulation", "solid", "derived", "three-dimensional elements")
    named = {f"materials.{name}": entry for name, entry in run.study.materials.items() if isinstance(entry, Mapping)}
    for path, entry in named.items():
        yield _row(f"{path}.{PRESET}", str(entry[PRESET]), STUDY_FILE)
        origin = _origin_of(MATERIALS, str(entry[PRESET]), path)
        yield from (_row_of(path, leaf, origin, paths) for leaf in walk_values(material_of(entry)))
    for leaf in walk_values(with_directions(run.study)):
        is_named = any(is_below(leaf.path, path) for path in named)
        if not is_named and leaf.path.partition(".")[0] not in (*_ABOUT, *SPECIMENS):
            is_given = not leaf.is_default if paths is None else any(is_below(path, leaf.path) for path in paths)
            source, reason = STUDY_FILE if is_given else DEFAULT, ""
            if leaf.path == "time.alpha" and run.study.time.scheme == "quasi_static":
                source, reason = NOT_USED, "quasi-static steps have no numerical damping"
            text = _text(leaf.value, leaf.unit)
            if leaf.path == "mesh.file":
                name, content = original_mesh(run)
                text = f"{name} (content {content})" if content else name
            yield _row(leaf.path, text, source, reason)


def original_mesh(run: Run) -> tuple[str, str]:
    """Return the mesh file of a run; of a copy in its results the name of the original, and the hash of its content."""
    file = str(getattr(run.study.mesh, "file", ""))
    is_copy = Path(run.where).resolve().parent.parent in Path(file).resolve().parents[:2]
    copy = re.fullmatch(r".*[/\\](.+)-([0-9a-f]{8})(\.\w+)", file) if is_copy else None
    return (f"{copy[1]}{copy[3]}", copy[2]) if copy else (file, "")


def _row(path: str, value: str, source: str, note: str = "") -> _Row:
    return ShownValue(path, value, source, note), value


def _specimen_rows(run: Run, specimen: Specimen, paths: Collection[str] | None) -> Iterator[_Row]:
    """Yield the values of the specimen: the preset's with their sources, others with the preset's value beside."""
    kind = str(run.study.specimen_kind)
    presets, values = SPECIMENS[kind], getattr(run.study, kind)
    name, origins = str(values["preset"]), {}
    yield _row(f"{kind}.preset", name, STUDY_FILE)
    for layer, material in (values.get("materials") or {}).items():
        if isinstance(material, Mapping) and PRESET in material:
            path, shipped = f"{kind}.materials.{layer}", str(material[PRESET])
            yield _row(f"{path}.{PRESET}", shipped, STUDY_FILE)
            origins[path] = _origin_of(MATERIALS, shipped, path)
    whole = _origin_of(presets, name, kind)
    for leaf in walk_values(specimen):
        if reason := _unused_reason(leaf.path, run.study, specimen):
            yield _row(f"{kind}.{leaf.path}", _text(leaf.value, leaf.unit), NOT_USED, reason)
            continue
        element = next((origin for path, origin in origins.items() if is_below(f"{kind}.{leaf.path}", path)), whole)
        yield _row_of(kind, leaf, element, paths)


# The values of a preset, by their paths in the study: as its file says them, and as they are.
_Origin: TypeAlias = tuple[Mapping[str, PresetValue], Mapping[str, Any]]


def _origin_of(presets: Presets[Any], name: str, path: str) -> _Origin:
    """Return the values of a preset that stands at a path in a study."""
    entries = {f"{path}.{entry.path}": entry for entry in presets.table(name)}
    return entries, {f"{path}.{leaf.path}": leaf.value for leaf in walk_values(presets.read(name))}


def _row_of(group: str, leaf: Leaf, origin: _Origin, paths: Collection[str] | None) -> _Row:
    """Return the row of a value in a group that starts from a preset: with its source, or the preset's value beside."""
    path, text = f"{group}.{leaf.path}", _text(leaf.value, leaf.unit)
    entries, values = origin
    source, untouched = known_part(path, entries), paths is None or path not in paths
    entry = entries.get(source)
    is_preset = leaf.value == values.get(path) and untouched
    if is_preset and entry:
        # Of a list the preset has one source for all values in it.
        return ShownValue(path, entry.value if source == path else text, entry.source, entry.note), text
    # A law that the preset does not have brings its own defaults.
    brought = leaf.is_default and path not in values and untouched
    return _row(path, text, DEFAULT if is_preset or brought else STUDY_FILE, f"preset: {entry.value}" if entry else "")


def _unused_reason(path: str, study: Study, specimen: Specimen) -> str:
    """Return why a run does not use a value of its specimen; empty for one that it uses."""
    group, _, rest = path.partition(".")
    if group in ("formulation", "depth") and getattr(study, group) is not None:
        return f"the study gives its own {group}"
    if group == "materials" and rest.partition(".")[0] in study.materials:
        return "the study gives its own material"
    groups = frozenset(study.record.all_groups)
    use = ModelUse(3 if study.is_solid else 2, study.mesh.needs_specimen, not study.supports, groups)
    return specimen.unused_reason(path, use)


def _text(value: object, unit: Unit | None) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(_text(item, unit) for item in value)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return f"{value:.10g}" if unit is None else unit.format(value)
    return str(value)


#: File in the folder of a study.
REPORT = "report.html"
#: Folder of the cameras in that of a run, and file that says how good the tracks of a camera are.
CAMERAS, ERRORS = "cameras", "errors.json"

_FILM_REPAIR = "remove its folder and run the study again"


def read_results(folder: str | Path) -> StudyResult:
    """Read the finished runs of a study back."""
    return store.stored_study(Path(folder), store.read_run)


def read_stored_run(folder: str | Path) -> RunResult:
    """Read one finished run back, with all its values and the uncertainties that are known."""
    folder = Path(folder)
    runs = store.read_manifest(folder).get("runs")
    if runs:
        raise ResultError(f"{folder}: holds a study; needs the folder of one of its runs: {', '.join(runs)}")
    run = store.read_run(folder)
    convergences = store.read_convergences(folder.parent, {folder.name: run.identity})
    return store.with_convergence(run, convergences.get(folder.name))


def study_tables(study: StudyResult) -> tuple[Table, ...]:
    """Return the tables that the command line prints of a study: its events, or what its samples come to."""
    if any(run.reaction for run in study.runs):
        from fingerslip.react.figures import reaction_tables

        return reaction_tables(reactions_of(study))
    if study.ranges:
        tables = sample_tables(study, [published_set(name) for name in study.compare])
    else:
        beside = (compare_table(study.runs, published_set(name)) for name in study.compare)
        tables = (events_table(study.runs), *(table for table in beside if table.rows))
    if not tables:
        return ()
    note = "\n".join(filter(None, (tables[0].note, *run_caveats(study.runs))))
    first = dataclasses.replace(tables[0], note=note)
    return (first, *tables[1:])


def warn_of_doubts(study: StudyResult) -> None:
    """Warn the caller's caller, as Python does, of what is doubtful in a model, or too coarse for the times of slip."""
    numbers = {run_title(run, run.name): run.numbers for run in study.runs}
    for warning in (*doubt_warnings(study.runs), *resolution_warnings(numbers)):
        warnings.warn(warning, stacklevel=3)


def write_report(study: StudyResult, pictures: Mapping[str, RunPictures] | None = None) -> None:
    """Make ``figures/`` and ``report.html`` of a study from its stored histories."""
    from fingerslip.report.page.assemble import study_report
    from fingerslip.report.page.page import write_page

    content = _content(study, pictures or {})
    if any(run.reaction for run in study.runs):
        from fingerslip.react.figures import reaction_report

        report = reaction_report(content, reactions_of(study))
    else:
        report = study_report(content)
    with new_folder(study.folder / "figures") as folder:
        for picture in report.pictures:
            write_bytes(folder / f"{picture.name}.png", picture.png)
    write_page(report, study.folder / REPORT)


def reactions_of(study: StudyResult) -> Reactions:
    """Return the runs of a study with the block `reaction`, for figures and tables of :mod:`fingerslip.react`."""
    from fingerslip.react.results import Reactions, centre_of, read_reactions

    results = tuple(read_reactions(study.folder / run.name) for run in study.runs)
    settings = read_run_values(study.folder / study.runs[centre_of(results)].name / RUN).study.reaction
    assert settings is not None
    return Reactions(study.runs, results, settings)


def _computed_content(study: StudyResult) -> ReportContent:
    """Return what all pages on a study have: its results, the values of its runs, and what made them."""
    from fingerslip.report.content import ReportContent

    manifest = store.read_manifest(study.folder)
    runs = [read_run_values(study.folder / run.name / RUN) for run in study.runs]
    values = value_rows(runs, manifest.get("given") or None)
    return ReportContent(study, {}, values=values, provenance=provenance_of(study.folder, manifest))


def _content(study: StudyResult, pictures: Mapping[str, RunPictures]) -> ReportContent:
    """Return what the page of a study has: error bars, notes, and without reactions the histories that it draws."""
    from fingerslip.report.content import MOST_RUNS
    from fingerslip.report.page.assemble import notes_html
    from fingerslip.report.page.samples import representatives

    convergences = store.read_convergences(study.folder, store.identities(store.read_manifest(study.folder)))
    content = dataclasses.replace(
        _computed_content(study),
        pictures=pictures,
        convergences={name: convergence.quantities for name, convergence in convergences.items()},
        notes=notes_html(study.folder),
    )
    if any(run.reaction for run in study.runs):
        return content
    drawn = [run.name for run in study.runs if not study.ranges][:MOST_RUNS]
    shown = dict.fromkeys((*drawn, *(run.name for run in content.modelled_runs)))
    histories = {name: read_history(study.folder / name / HISTORY) for name in shown}
    starts = slide_starts(study)
    # Of samples those are seen in motion that stand for others.
    typical = [sample.run.name for sample in representatives(study, starts)] if study.ranges else []
    return dataclasses.replace(
        content,
        histories=histories,
        references=tuple(published_set(name) for name in study.compare),
        films=read_films(study.folder, {name: histories[name] for name in drawn}),
        starts=starts,
        representatives={name: read_history(study.folder / name / HISTORY) for name in typical},
    )


def slide_starts(study: StudyResult) -> dict[str, float]:
    """Return when the slide of each run begins [s]; runs in which nothing slides are left out."""
    slides = {run.name: stored_phases(study.folder / run.name / HISTORY, "slide") for run in study.runs}
    return {name: slide[0][0] for name, slide in slides.items() if slide}


_MINUTE = "%Y-%m-%d %H:%M %Z"  # of any time zone, those that datetime refuses too


def provenance_of(folder: Path, manifest: Mapping[str, Any]) -> dict[str, str]:
    """Return what made the results, in words: file, dates, commit, computing time, and the versions of all programs."""
    written = time.localtime((folder / store.MANIFEST).stat().st_mtime)
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
    return [str(numbers["key"]) for run in runs for numbers in _stored_films(folder / run).values()]


def read_films(folder: Path, histories: Mapping[str, xr.Dataset]) -> tuple[Film, ...]:
    """Read the films of the runs whose histories are shown, as far as a report shows them."""
    # Pictures and videos are slow to load, and few studies have cameras.
    from fingerslip.report.content import Film
    from fingerslip.vision.tracks import read_tracks

    films = []
    for run, history in histories.items():
        for camera, numbers in _stored_films(folder / run).items():
            truth, tracks = read_tracks(camera / "truth.nc"), read_tracks(camera / "tracks" / "matched.nc")
            displayed = {name: numbers[name] for name in ("frames", "markers", "rms", "largest", "kept", "swapped")}
            frames = _frames(camera / "video.avi", truth, history)
            films.append(Film(run, camera.name, tracks, displayed, frames))
    return tuple(films)


def _stored_films(run: Path) -> dict[Path, dict[str, Any]]:
    """Return how good the tracks of each camera of a run are, by the folder of the camera."""
    return {path.parent: read_json(path, _FILM_REPAIR) for path in sorted(run.glob(f"{CAMERAS}/*/{ERRORS}"))}


def _frames(video: Path, truth: xr.Dataset, history: xr.Dataset) -> dict[float, NDArray[np.uint8]]:
    """Return the frames that a report shows by their times [s]; none without a video or a slide."""
    from fingerslip.report.figures.markers import film_times
    from fingerslip.vision.video import read_frames

    window, times = slide_window(history), truth["time"].values
    if not video.is_file() or window is None:
        return {}
    wanted = [int(np.abs(times - time).argmin()) for time in film_times(window.start, window.end, float(times[0]))]
    frames = enumerate(itertools.islice(read_frames(video), max(wanted) + 1))
    return {float(times[number]): frame for number, frame in frames if number in wanted}


def compare_studies(first: str | Path, second: str | Path, output: Path | None = None) -> Path:
    """Write the page of two studies side by side, from their stored results."""
    from fingerslip.report.page.assemble import comparison_report
    from fingerslip.report.page.page import write_page

    studies = read_results(first), read_results(second)
    sides = [dataclasses.replace(_computed_content(study), starts=slide_starts(study)) for study in studies]
    path = output or Path(first) / f"comparison-{Path(second).resolve().name}.html"
    write_page(comparison_report(*sides), path)
    return path
