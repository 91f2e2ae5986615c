"""The intervals of slip times that the unknown geometry allows, beside every published time.

The samples of the geometry studies take long, so their intervals are stored, and read back unless they are asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType

from fingerslip.published import published_set
from fingerslip.report.tables.samples import INTERVAL_COLUMNS
from fingerslip.report.tables.table import Cell, Column, Missing, Table
from fingerslip.results import RunResult, StudyResult
from fingerslip.sampling import PublishedInterval, published_intervals
from fingerslip.slip import EventSettings, PeakSettings
from fingerslip.slip.windows import READINGS, event_label
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.running.runner import run_studies
from fingerslip.validation.evidence import VARIANT, solid_measures
from fingerslip.validation.measures import NODE_TOLERANCES, REFERENCE_NODES, SOLID_READINGS
from fingerslip.validation.rows import RowFile, Stored, stored_rows

__all__ = [
    "GEOMETRY",
    "GEOMETRY_FILE",
    "GeometryRow",
    "allowed_geometry",
    "geometry_rows",
    "geometry_table",
]

#: The studies that sample the unknown dimensions, and what their models are called.
GEOMETRY: Mapping[str, str] = MappingProxyType({"wang2014_geometry": "section", "wang2014_geometry_3d": "in 3D"})
_NOTE = (
    "Over samples of all dimensions that the paper does not print (studies wang2014_geometry and wang2014_geometry_3d, "
    "docs/geometry.md): 5 % of the samples are earlier than the time below '5 %', and a published time 'within, at "
    "34 %' is later than 34 % of them. 'above all' and 'below all' are no matter of the unknown geometry."
)


@dataclass(frozen=True)
class GeometryRow:
    """One published time, and the interval of ours over the unknown geometry."""

    quantity: str  # what it is, of which model, and how ours is read
    source: str  # the paper, and the table, figure or section of it
    published: float | tuple[float, float]  # the published time or range [s]
    interval: tuple[float, ...] | None  # smallest time of the samples, percentiles 5, 50 and 95, and the largest [s]
    where: str  # where the published time lies: 'within, at 34 %', 'below all', 'above all'; empty without an interval
    found: int  # samples with the event, and all that were computed
    samples: int  # samples with the event, and all that were computed


#: Where their intervals are stored.
GEOMETRY_FILE = RowFile(
    "geometry.json",
    "intervals",
    "fingerslip validate --geometry",
    "about an hour",
    tuple(GEOMETRY),
    GeometryRow,
    {
        "sites in 3D": REFERENCE_NODES,
        "tolerances in 3D [m]": NODE_TOLERANCES,
        "events": asdict(EventSettings()),
        "peaks": asdict(PeakSettings()),
    },
)


def allowed_geometry(
    studies: str | Path = "studies",
    results: str | Path = "results",
    workers: int = 2,
    progress: StudyProgress | None = None,
    *,
    compute: bool = False,
) -> Stored[GeometryRow]:
    """Return what the unknown geometry allows: computed and stored, or as it was stored last."""

    def computed() -> list[GeometryRow]:
        paths = [Path(studies) / f"{name}.yaml" for name in GEOMETRY]
        outcomes = run_studies(paths, results_dir=results, workers=workers, progress=progress)
        return [row for outcome in outcomes for row in geometry_rows(outcome)]

    return stored_rows(GEOMETRY_FILE, studies, results, computed if compute else None)


def geometry_rows(study: StudyResult) -> tuple[GeometryRow, ...]:
    """Return the rows of one geometry study, each published time in the reading of the paper or the likely ones."""
    model = GEOMETRY[study.folder.name]
    runs = tuple(_read_in_space(study, run) for run in study.runs) if model == "in 3D" else study.runs
    references = [published_set(name) for name in study.compare]
    return tuple(_geometry_row(interval, model) for interval in published_intervals(runs, references))


def geometry_table(rows: tuple[GeometryRow, ...], origin: str = "") -> Table:
    """Put the rows into one table."""
    columns = (
        *(Column(name) for name in ("quantity", "source", "published [s]")),
        *INTERVAL_COLUMNS,
        Column("published lies"),
        Column("found in"),
    )
    note = f"{_NOTE} {origin}".strip() if rows else origin
    return Table("What the unknown geometry allows", columns, tuple(_cells(row) for row in rows), note)


def _read_in_space(study: StudyResult, run: RunResult) -> RunResult:
    """Return a run in 3D with the events that validation reads at the reference nodes."""
    return solid_measures(study.folder / run.name, run).run


def _geometry_row(entry: PublishedInterval, model: str) -> GeometryRow:
    value, interval = entry.value, entry.interval
    variant = f"{value.conditions[VARIANT]}, " if model == "section" else ""
    readings = READINGS if model == "section" else SOLID_READINGS
    numbers = None
    if interval is not None:
        numbers = (
            interval.smallest,
            *(interval.percentile(percent) for percent in (5, 50, 95)),
            interval.largest,
        )
    return GeometryRow(
        quantity=f"{event_label(value.quantity)}, {variant}{model} ({readings[entry.reading]})",
        source=value.source,
        published=value.span or value.value or 0.0,
        interval=None if numbers is None else tuple(round(number, 6) for number in numbers),
        where=entry.where,
        found=0 if interval is None else len(interval.values),
        samples=entry.samples,
    )


def _cells(row: GeometryRow) -> tuple[Cell, ...]:
    times = row.published if isinstance(row.published, tuple) else (row.published,)
    interval: tuple[Cell, ...] = row.interval or (Missing.NO_EVENT,) * len(INTERVAL_COLUMNS)
    return (
        *(row.quantity, row.source, " to ".join(f"{time:.2f}" for time in times)),
        *interval,
        row.where or Missing.NOT_DEFINED,
        f"{row.found} of {row.samples}",
    )
