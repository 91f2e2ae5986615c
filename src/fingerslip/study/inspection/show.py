"""``fingerslip show``: presets, studies and results as tables."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from fingerslip.errors import InputError
from fingerslip.materials.library import material_header, material_names, material_table
from fingerslip.parameters.presets import PresetValue
from fingerslip.report.tables.events import readings_table
from fingerslip.report.tables.measures import measures_table
from fingerslip.report.tables.parameters import ASSUMED, COLUMNS, NOT_USED
from fingerslip.report.tables.table import Column, Table
from fingerslip.results import RunResult
from fingerslip.run_folder import RESULT
from fingerslip.specimens.choice import preset_names, presets_of
from fingerslip.study.definition.spec import given_paths, read_study
from fingerslip.study.definition.sweep import expand
from fingerslip.study.storage.reporting import read_stored, read_stored_run, study_tables
from fingerslip.study.storage.values import Specified, value_rows

__all__ = ["materials_table", "presets_table", "show"]


def show(target: str = "", figure: Path | None = None) -> tuple[Table, ...]:
    """Return tables of a preset or a material that ships, of a study file, or of a folder of results.

    Parameters
    ----------
    target : str, optional
        Name of a preset or a material, or a path; without it both are listed.
    figure : Path, optional
        Picture of the fingertip or the sensor to write, of a preset or a study.

    Returns
    -------
    tuple of Table
        Values with unit and source, the assumed ones first; or the events and numbers of a result.

    Raises
    ------
    InputError
        Where nothing has that name, or it has no specimen to draw.
    ResultError
        Where a folder holds no results, or the picture cannot be written.
    """
    if figure is not None:
        from fingerslip.study.inspection.draw import draw_specimen

        draw_specimen(target, figure)
    return _tables(target) if target else (presets_table(), materials_table())


def _tables(target: str) -> tuple[Table, ...]:
    path = Path(target)
    if path.is_dir():
        return _show_result(path)
    if path.suffix in (".yaml", ".yml"):
        return (_study_table(path),)
    if target in preset_names():
        presets = presets_of(target)
        return (_preset_table(target, presets.header(target), presets.table(target)),)
    if target in material_names():
        return (_preset_table(target, material_header(target), material_table(target)),)
    repair = f"presets: {', '.join((*preset_names(), *material_names()))}"
    raise InputError(f"show {target}", "is not there", "needs a preset, a study file or a folder of results", repair)


def presets_table() -> Table:
    """Return the presets that ship."""
    rows = tuple((name, presets_of(name).header(name)["citation"]) for name in preset_names())
    return Table("Presets", (Column("name"), Column("after")), rows, "fingerslip show NAME lists all values.")


def materials_table() -> Table:
    """Return the materials that ship."""
    rows = tuple((name, material_header(name)["citation"]) for name in material_names())
    return Table(
        "Materials", (Column("name"), Column("after")), rows, "In study files: materials: {REGION: {preset: NAME}}."
    )


def _preset_table(name: str, header: Mapping[str, str], values: Sequence[PresetValue]) -> Table:
    rows = tuple((row.path, row.value, row.source, row.note) for row in values)
    return Table(f"{name}: {header['citation']}", COLUMNS, rows, f"{header['published']} {header['claims_not']}")


def _study_table(path: Path) -> Table:
    study = read_study(path)
    runs = [Specified(run.study, run.specimen) for run in expand(study, path)]
    values = sorted(
        value_rows(runs, given_paths(path)), key=lambda value: (value.source == NOT_USED, value.source != ASSUMED)
    )
    rows = tuple((value.path, value.value, value.source, value.note) for value in values)
    return Table(f"{path}: {study.title}", COLUMNS, rows, "The assumed values come first.")


def _show_result(folder: Path) -> tuple[Table, ...]:
    if not (folder / RESULT).exists():
        return study_tables(read_stored(folder))
    result = read_stored_run(folder)
    versions = ", ".join(f"{name} {version}" for name, version in result.versions.items())
    measures = measures_table([result], ["value"])
    return (
        readings_table(result, f"Slip events of {folder}"),
        dataclasses.replace(measures, note=f"Computed in {result.seconds} s with {versions}."),
        _swept_table(result),
    )


def _swept_table(result: RunResult) -> Table:
    rows = tuple((path, json.dumps(value)) for path, value in result.swept.items())
    return Table("Swept values", (Column("path"), Column("value")), rows)
