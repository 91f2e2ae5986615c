"""The intervals of slip times that the unknown geometry allows, beside every published time.

The samples of the geometry studies take long, so their intervals are stored, and read back unless they are asked for.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from fingerslip.digest import digest
from fingerslip.errors import FingerslipError, ResultError
from fingerslip.files import read_json, write_json
from fingerslip.published import published
from fingerslip.report.tables.samples import INTERVAL_COLUMNS
from fingerslip.report.tables.table import Cell, Column, Missing, Table, to_markdown
from fingerslip.results import RunResult, StudyResult
from fingerslip.sampling import PublishedInterval, published_intervals
from fingerslip.slip.names import READINGS, event_label
from fingerslip.study.definition.base import read_with_base
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.running.runner import run_studies
from fingerslip.study.storage.provenance import versions
from fingerslip.validation.evidence import VARIANT, solid_measures
from fingerslip.validation.rows import Row, rows_mapping, rows_markdown

__all__ = [
    "GEOMETRY",
    "GEOMETRY_FILE",
    "AllowedGeometry",
    "GeometryRow",
    "allowed_geometry",
    "geometry_mapping",
    "geometry_rows",
    "geometry_table",
    "rows_and_geometry_mapping",
    "rows_and_geometry_markdown",
    "run_geometry",
    "stored_geometry",
]

#: The studies that sample the unknown dimensions, and what their models are called.
GEOMETRY: Mapping[str, str] = MappingProxyType({"wang2014_geometry": "section", "wang2014_geometry_3d": "in space"})
#: File with their intervals, in the folder of all results or in its folder `reference`.
GEOMETRY_FILE = "geometry.json"

_COMMAND = "fingerslip validate --geometry"
_NOTE = (
    "Over samples of all dimensions that the paper does not print (studies wang2014_geometry and wang2014_geometry_3d, "
    "docs/geometry.md): 5 % of the samples are earlier than the time below '5 %', and a published time 'within, at "
    "34 %' is later than 34 % of them. 'above all' and 'below all' are no matter of the unknown geometry."
)


@dataclass(frozen=True)
class GeometryRow:
    """One published time, and the interval of ours over the unknown geometry.

    Parameters
    ----------
    quantity : str
        What it is, of which model, and how ours is read.
    source : str
        The paper, and the table, figure or section of it.
    published : float or tuple of float
        The published time or range [s].
    interval : tuple of float or None
        Smallest time of the samples, percentiles 5, 50 and 95, and the largest [s]; None where none has the event.
    where : str
        Where the published time lies: 'within, at 34 %', 'below all', 'above all'; empty without an interval.
    found, samples : int
        Samples with the event, and all that were computed.
    """

    quantity: str
    source: str
    published: float | tuple[float, float]
    interval: tuple[float, ...] | None
    where: str
    found: int
    samples: int


@dataclass(frozen=True)
class AllowedGeometry:
    """What the unknown geometry allows.

    Parameters
    ----------
    rows : tuple of GeometryRow
        A row for each published time; empty where nothing is stored.
    origin : str
        Where they come from, in a sentence; empty where they were computed.
    computed : bool
        Whether they were computed, or read back.
    """

    rows: tuple[GeometryRow, ...]
    origin: str = ""
    computed: bool = False


def allowed_geometry(
    studies: str | Path = "studies",
    results: str | Path = "results",
    workers: int = 2,
    progress: StudyProgress | None = None,
    *,
    compute: bool = False,
) -> AllowedGeometry:
    """Return what the unknown geometry allows: computed by :func:`run_geometry` or read by :func:`stored_geometry`."""
    if compute:
        return AllowedGeometry(run_geometry(studies, results, workers, progress), computed=True)
    return AllowedGeometry(*stored_geometry(studies, results))


def rows_and_geometry_mapping(rows: Sequence[Row], allowed: AllowedGeometry) -> Any:
    """Return the rows of the validation as plain data, under keys beside those of the geometry if it was computed."""
    plain = rows_mapping(rows)
    return {"rows": plain, "geometry": geometry_mapping(allowed.rows)} if allowed.computed else plain


def rows_and_geometry_markdown(rows: Sequence[Row], allowed: AllowedGeometry) -> str:
    """Write the rows of the validation as a page in Markdown, with those of the geometry where it was computed."""
    page, table = rows_markdown(rows), geometry_table(allowed.rows)
    return f"{page}\n## {table.title}\n\n{table.note}\n\n{to_markdown(table)}" if allowed.computed else page


def run_geometry(
    studies: str | Path = "studies",
    results: str | Path = "results",
    workers: int = 2,
    progress: StudyProgress | None = None,
) -> tuple[GeometryRow, ...]:
    """Run the geometry studies as far as they are not finished, and store and return their intervals.

    Parameters
    ----------
    studies : path, optional
        Folder of the study files.
    results : path, optional
        Folder of the results, to which ``geometry.json`` is written.
    workers : int, optional
        How many runs are computed at once.
    progress : StudyProgress, optional
        Receives the progress.

    Raises
    ------
    InputError
        Where a study file is missing or wrong.
    StudyFailedError
        Where runs failed.
    ResultError
        Where results cannot be written or read back.
    """
    paths = [Path(studies) / f"{name}.yaml" for name in GEOMETRY]
    outcomes = run_studies(paths, results_dir=results, workers=workers, progress=progress)
    rows = tuple(row for outcome in outcomes for row in geometry_rows(outcome))
    made = {"command": _COMMAND, "version": versions()["fingerslip"], "inputs": _inputs(Path(studies))}
    write_json(Path(results) / GEOMETRY_FILE, {"made": made, "rows": geometry_mapping(rows)})
    return rows


def stored_geometry(
    studies: str | Path = "studies", results: str | Path = "results"
) -> tuple[tuple[GeometryRow, ...], str]:
    """Return the intervals that were stored last, or else those that ship, and where they come from.

    Parameters
    ----------
    studies : path, optional
        Folder of the study files.
    results : path, optional
        Folder of the results.

    Returns
    -------
    tuple of GeometryRow
        Empty where nothing is stored.
    str
        Where they come from, in a sentence.
    """
    for path in (Path(results) / GEOMETRY_FILE, Path(results) / "reference" / GEOMETRY_FILE):
        try:
            stored = read_json(path, f"run {_COMMAND}")
            rows = tuple(_row(entry) for entry in stored["rows"])
        except FileNotFoundError:
            continue
        except (KeyError, TypeError, ResultError) as error:
            return (), f"{path} is damaged ({error}); {_COMMAND} computes it again."
        changed = stored["made"].get("inputs") != _inputs(Path(studies))
        state = "the studies have changed since" if changed else "the studies are the same"
        made = (
            f"Stored in {path} by fingerslip {stored['made'].get('version')}; {state}. {_COMMAND} computes them again."
        )
        return rows, made
    return (), f"No intervals are stored; {_COMMAND} computes them, which takes about an hour."


def geometry_rows(study: StudyResult) -> tuple[GeometryRow, ...]:
    """Return the rows of one geometry study, each published time in the reading of the paper or the likely ones."""
    model = GEOMETRY[study.folder.name]
    runs = tuple(_read_in_space(study, run) for run in study.runs) if model == "in space" else study.runs
    references = [published(name) for name in study.compare]
    return tuple(_geometry_row(one, model) for one in published_intervals(runs, references))


def geometry_mapping(rows: tuple[GeometryRow, ...]) -> list[dict[str, Any]]:
    """Return the rows as plain data."""
    return [dataclasses.asdict(row) for row in rows]


def geometry_table(rows: tuple[GeometryRow, ...], origin: str = "") -> Table:
    """Put the rows into one table.

    Parameters
    ----------
    rows : tuple of GeometryRow
        The rows.
    origin : str, optional
        Where they come from, in a sentence.
    """
    columns = (
        *(Column(name) for name in ("quantity", "source", "published [s]")),
        *INTERVAL_COLUMNS,
        Column("published lies"),
        Column("found in"),
    )
    note = f"{_NOTE} {origin}".strip() if rows else origin
    return Table("What the unknown geometry allows", columns, tuple(_cells(row) for row in rows), note)


def _read_in_space(study: StudyResult, run: RunResult) -> RunResult:
    """Return a run in space with the events that validation reads at the reference nodes."""
    return solid_measures(study.folder / run.name, run).run


def _geometry_row(one: PublishedInterval, model: str) -> GeometryRow:
    value, interval = one.value, one.interval
    variant = f"{value.conditions[VARIANT]}, " if model == "section" else ""
    numbers = None
    if interval is not None:
        numbers = (
            interval.smallest,
            *(interval.percentile(percent) for percent in (5, 50, 95)),
            interval.largest,
        )
    return GeometryRow(
        quantity=f"{event_label(value.quantity)}, {variant}{model} ({READINGS[one.reading]})",
        source=value.source,
        published=value.span or value.value or 0.0,
        interval=None if numbers is None else tuple(round(number, 6) for number in numbers),
        where=one.where,
        found=0 if interval is None else len(interval.values),
        samples=one.samples,
    )


def _cells(row: GeometryRow) -> tuple[Cell, ...]:
    shown = row.published if isinstance(row.published, tuple) else (row.published,)
    interval: tuple[Cell, ...] = row.interval or (Missing.NO_EVENT,) * len(INTERVAL_COLUMNS)
    return (
        *(row.quantity, row.source, " to ".join(f"{time:.2f}" for time in shown)),
        *interval,
        row.where or Missing.NOT_DEFINED,
        f"{row.found} of {row.samples}",
    )


def _row(entry: Mapping[str, Any]) -> GeometryRow:
    values: dict[str, Any] = {name: tuple(value) if isinstance(value, list) else value for name, value in entry.items()}
    return GeometryRow(**values)


def _inputs(studies: Path) -> dict[str, str]:
    """Return a hash of what each geometry study holds; of one that cannot be read none."""
    found = {}
    for name in GEOMETRY:
        try:
            found[name] = digest([read_with_base(studies / f"{name}.yaml")])
        except FingerslipError:
            continue
    return found
