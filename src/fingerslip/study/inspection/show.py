"""``fingerslip show`` and its like: presets, studies, results, and what moves results, as tables."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

from fingerslip.errors import InputError
from fingerslip.history import read_history
from fingerslip.materials.choice import MATERIALS, material_names
from fingerslip.parameters.yaml_text import parse_document
from fingerslip.report.labels import first_named
from fingerslip.report.tables import compare
from fingerslip.report.tables.parameters import ASSUMED, COLUMNS, NOT_USED, ShownValue
from fingerslip.report.tables.runs import measures_table, readings_table, run_caveats, table_frame, time_cell
from fingerslip.report.tables.samples import indices_table, prediction_table, sensitivity_table
from fingerslip.results import FORMATS, HISTORY, RESULT, RUN, RunResult, StudyResult
from fingerslip.sampling.designs import required_output
from fingerslip.sampling.indices import Sensitivity, block_indices, fit_surrogate, surrogate_indices
from fingerslip.sampling.sensitivity import fits_of
from fingerslip.slip.windows import LATENCY, READINGS, TIMES, defines_time, event_label
from fingerslip.specimens.choice import preset_names, presets_of
from fingerslip.storage.files import write_bytes, write_text
from fingerslip.study.definition.runs import read_runs
from fingerslip.study.scripted import open_study
from fingerslip.study.storage.reporting import read_results, read_run_values, read_stored_run, study_tables, value_rows
from fingerslip.study.storage.store import read_manifest
from fingerslip.tables.table import Cell, Column, Table, to_csv

_CATALOGUE = Column("name"), Column("after")


def show(target: str = "", figure: Path | None = None) -> tuple[Table, ...]:
    """Return tables of a preset or a material that ships, of a study file, or of a folder of results.

    Without a target presets and materials are listed; `figure` is a picture of the specimen to write.
    """
    if figure is not None:
        from fingerslip.study.inspection.check import draw_specimen

        draw_specimen(target, figure)
    path = Path(target)
    if not target:
        materials = tuple((name, MATERIALS.header(name)["citation"]) for name in material_names())
        note = "In study files: materials: {REGION: {preset: NAME}}."
        return presets_table(), Table("Materials", _CATALOGUE, materials, note)
    if path.is_dir():
        return _show_result(path)
    if path.suffix in (".yaml", ".yml"):
        plan = read_runs(path)
        shown = value_rows(plan.runs, plan.given)
        assumed_first = sorted(shown, key=lambda value: (value.source == NOT_USED, value.source != ASSUMED))
        rows = tuple(map(dataclasses.astuple, assumed_first))
        return (Table(f"{path}: {plan.study.title}", COLUMNS, rows, "The assumed values come first."),)
    names = (*preset_names(), *material_names())
    if target not in names:
        repair, needed = f"presets: {', '.join(names)}", "needs a preset, a study file or a folder of results"
        raise InputError(f"show {target}", "is not there", needed, repair)
    presets = presets_of(target) if target in preset_names() else MATERIALS
    header, values = presets.header(target), presets.table(target)
    rows = tuple((row.path, row.value, row.source, row.note) for row in values)
    return (Table(f"{target}: {header['citation']}", COLUMNS, rows, f"{header['published']} {header['claims_not']}"),)


def _show_result(folder: Path) -> tuple[Table, ...]:
    if not (folder / RESULT).exists():
        return study_tables(read_results(folder))
    result = read_stored_run(folder)
    versions = ", ".join(f"{name} {version}" for name, version in result.versions.items())
    measures, events = measures_table([result], ["value"]), readings_table(result, f"Slip events of {folder}")
    swept = tuple((path, json.dumps(value)) for path, value in result.swept.items())
    return (
        dataclasses.replace(events, note=" ".join((events.note, *run_caveats([result])))),
        dataclasses.replace(measures, note=f"Computed in {result.seconds} s with {versions}."),
        *[Table("Swept values", (Column("path"), Column("value")), swept)] * bool(swept),
    )


def presets_table() -> Table:
    """Return the presets that ship."""
    rows = tuple((name, presets_of(name).header(name)["citation"]) for name in preset_names())
    return Table("Presets", _CATALOGUE, rows, "fingerslip show NAME lists all values.")


_SIDES = ("A", "B")


def diff_runs(first: str | Path, second: str | Path) -> tuple[Table, ...]:
    """Compare two finished runs, of one study or of two."""
    runs = read_stored_run(first), read_stored_run(second)
    values = compare.compared_values(*map(_values, (Path(first), Path(second)), runs))
    same, note = "Both have the same values and versions.", f"A: {first}; B: {second}."
    return compare.differences_table(*values, same=same, note=note), _results_table(runs)


def _values(folder: Path, run: RunResult) -> tuple[ShownValue, ...]:
    """Return the values of a run as people read them, and the versions of the programs that made it."""
    values = value_rows([read_run_values(folder / RUN)], read_manifest(folder.parent).get("given") or None)
    return (*values, *(ShownValue(f"version of {name}", text, "") for name, text in run.versions.items()))


def _results_table(runs: tuple[RunResult, RunResult]) -> Table:
    events: list[tuple[Cell, ...]] = []
    for reading, words in READINGS.items():
        for time in (time for time in TIMES if defines_time(reading, time)):
            unit, factor = ("ms", 1e3) if time == LATENCY else ("s", 1.0)
            cells = (time_cell(run, reading, time, factor) for run in runs)
            events.append((f"{event_label(time)} ({words})", unit, *cells))
    results = (*events, *measures_table(runs, _SIDES).rows)
    rows = tuple((*row, compare.difference_cell(row[2], row[3])) for row in results)
    marked = (number for number, row in enumerate(rows) if compare.exceeds_uncertainty(row[2], row[3]))
    sides = (Column(name, significant=5) for name in _SIDES)
    columns = Column("result"), Column("unit"), *sides, Column("B - A", significant=3)
    return Table("Slip events and measures", columns, rows, compare.marked_notes(runs), tuple(marked))


def export_result(
    target: Path,
    kind: str,
    output: Path | None = None,
    say: Callable[[str], None] = lambda _: None,
    only: Sequence[str] = (),
) -> Path:
    """Write a result for other programs, whole or not at all; say how large text is, and what spikes are not."""
    # Data frames and the formats are slow to load: what is wrong with format and result is said before.
    if kind not in FORMATS:
        raise InputError("export: --format", f"got '{kind}'", f"needs one of {', '.join(FORMATS)}")
    tracks = target if target.suffix == ".nc" else target / "tracks.nc"
    if tracks.is_file():
        return _export_tracks(tracks, kind, output or tracks.parent / f"export-{kind}")
    if target.is_file():
        raise InputError(f"export {target}", "is a file", "needs the folder of a run or of a study, or tracks.nc")
    folder = output or target / f"export-{kind}"
    if runs := list(read_manifest(target).get("runs") or ()):
        from fingerslip.export.formats import TABULAR, export_tables

        if only or kind not in TABULAR:
            if len(runs) == 1:
                return export_result(target / runs[0], kind, folder, say, only)
            needs = f"{'--only' if only else kind} needs the folder of one of them: {first_named(runs)}"
            raise InputError(f"export {target}", f"is a study of {len(runs)} runs", needs, f"name {target / runs[0]}")
        study = open_study(target)
        tables = {"runs": study.to_dataframe()}
        if any(run.reaction for run in study.result.runs):
            from fingerslip.react.results import all_trials_table

            tables["reactions"] = table_frame(all_trials_table(study.result))
        return export_tables(tables, folder, kind)
    read_stored_run(target)
    from fingerslip.export.formats import export_history, export_notes

    history = read_history(target / HISTORY)
    # Which run it is, for formats that say so.
    history.attrs["run"] = f"{target.resolve().parent.name}/{target.resolve().name}"
    for note in export_notes(history, kind, only):
        say(note)
    return export_history(history, folder, kind, only)


def _export_tracks(path: Path, kind: str, folder: Path) -> Path:
    from fingerslip.export.formats import export_tables
    from fingerslip.vision.tracks import read_tracks, tracks_table

    tracks = read_tracks(path)
    frame, unit = tracks_table(tracks), tracks["position"].attrs["units"]
    frame.attrs["units"] = {"time_s": "s", **{f"{axis}_{unit}": unit for axis in tracks["axis"].values}}
    return export_tables({"tracks": frame}, folder, kind)


Method = Literal["auto", "linear", "morris", "sobol", "surrogate"]


def write_sensitivities(folder: Path, output: str, method: Method) -> tuple[Table, ...]:
    """Return tables of what moves an output, and write them and their figure into the folder of the study."""
    study = open_study(folder).result
    if method == "linear":
        label = required_output(study.runs[0], output).label if study.runs else output
        fits = tuple(sensitivity_table(fit) for fit in fits_of(study))
        linear = tuple(table for table in fits if table.title.startswith(f"What moves {label}"))
        if not linear:
            raise InputError("of", f"no regression of '{output}'", "needs a slip time of a study with samples")
        return linear
    from fingerslip.report.figures.study import indices_figure
    from fingerslip.report.figures.style import figure_bytes

    results = sensitivities(study, output, method)
    kind = results[0].method if results[0].surrogate is None else "surrogate"
    tables, name = tuple(map(indices_table, results)), f"sensitivity-{output}-{kind}"
    for number, table in enumerate(tables, start=1):
        ending = f"-{number}" if len(tables) > 1 else ""
        write_text(folder / f"{name}{ending}.csv", to_csv(table))
    write_bytes(folder / f"{name}.png", figure_bytes(indices_figure(results)))
    return tables


def sensitivities(study: StudyResult, output: str, method: Method = "auto") -> tuple[Sensitivity, ...]:
    """Return what moves an output by elementary effects or Sobol indices; see :func:`write_sensitivities`."""
    drawn_for = {"morris": "morris", "saltelli": "sobol"}.get(study.design.get("method", ""), "surrogate")
    chosen = drawn_for if method == "auto" else method
    return surrogate_indices(study, output) if chosen == "surrogate" else block_indices(study, output, chosen)


def predict_table(folder: Path, assignments: Sequence[str], outputs: Sequence[str]) -> Table:
    """Predict what a run between those of a study would come to."""
    study = open_study(folder).result
    values: dict[str, object] = {}
    for text in assignments:
        path, equal, value = text.partition("=")
        if not equal:
            raise InputError("at", f"got '{text}'", "needs path=value, such as contact.friction_coefficient=0.5")
        values[path.strip()] = parse_document(value, "at").content
    if not study.runs:
        raise InputError("study", "has no finished runs", "needs ten or more")
    fitted = [fit_surrogate(study.runs, output) for output in outputs]
    paths = {surrogate.path for surrogate in fitted[0].inputs}
    if unknown := next((path for path in values if path not in paths), ""):
        raise InputError(unknown, "does not differ between the runs", f"needs {', '.join(sorted(paths))}")
    return prediction_table([(surrogate, surrogate.predict(values)) for surrogate in fitted], values)
