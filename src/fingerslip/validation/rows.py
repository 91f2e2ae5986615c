"""Rows of validation: published beside ours, and the slip times that the unknown geometry allows.

What takes long is stored, and read back unless it is asked for.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Generic, Literal, TypeVar

from fingerslip.errors import FingerslipError, ResultError
from fingerslip.published import PublishedValue, published_set
from fingerslip.report.tables.compare import difference_from, span_of
from fingerslip.report.tables.samples import INTERVAL_COLUMNS
from fingerslip.results import StudyResult
from fingerslip.sampling.sensitivity import published_intervals
from fingerslip.slip import EventSettings, PeakSettings
from fingerslip.slip.windows import READINGS, event_label
from fingerslip.storage.files import digest, read_json, write_json
from fingerslip.study.definition.file import read_with_base
from fingerslip.study.storage.store import versions
from fingerslip.tables.table import Cell, Column, Missing, Table, to_markdown
from fingerslip.validation.evidence import VARIANT, Work, measure_folder
from fingerslip.validation.measures import NODE_TOLERANCES, REFERENCE_NODES, SOLID_READINGS, measure_3d

Basis = Literal["calibrated", "predicted", "large strain"]
Verdict = Literal["agrees", "misses", "not found", "not judged", "not comparable", "holds", "fails"]

# Decimal numbers such as 1.72 s are not exact in binary.
_ROUNDING = 1e-9
_COMMAND = "fingerslip validate --markdown > results/reference/validation.md"
_NOTE = (
    "Difference is ours less published. Uncertainty is the numerical one of ours over meshes, time steps, contact "
    "stiffness and numerical damping (fingerslip converge), for a statement the range over these; for reference "
    "nodes it includes how far a node has to leave the plate's line (20 to 100 um), and for detectors it "
    "is half of the interval over trials drawn anew. A number agrees when it differs by no more than the larger "
    "of one unit of the last printed decimal (10 ms) and the uncertainty. Peak heights are not judged, because "
    "they depend on mesh, step and numerical damping. Incipient slip and latency of the section by accumulated "
    "slip, and statements on that latency, are not comparable: the paper reads acceleration peaks. Rows on the "
    "basis 'large strain' are predictions with geometrical nonlinearity on, which the paper switched off."
)


#: What a check gives: a number, counts before and after of what is lost, or nothing.
Outcome = float | tuple[int, int] | None
_RULE = re.compile(r"; holds (above|below|from|up to|at) ([0-9.]+)")
_RULES = {"above": operator.gt, "below": operator.lt, "from": operator.ge, "up to": operator.le, "at": operator.eq}


@dataclass(frozen=True)
class Row:
    """One published number or statement, and our number beside it."""

    quantity: str  # what is compared, and how it is read
    source: str  # the paper, and the table, figure or section of it
    published: float | tuple[float, float] | None  # the published value or range
    ours: float | None  # our value
    difference: float | None  # ours less published
    uncertainty: float | None  # numerical uncertainty of ours, for a statement its range over the refinements
    verdict: Verdict  # verdict by the rule in the note of the table
    basis: Basis  # whether the geometry was calibrated on this value
    unit: str = ""  # unit of all the numbers
    statement: str = ""  # the published statement in words


def number_row(
    quantity: str,
    value: PublishedValue,
    ours: float | None,
    uncertainty: float | None,
    *,
    basis: Basis = "predicted",
    comparable: bool = True,
) -> Row:
    """Compare a number with the published one."""
    if value.value is None:
        raise ValueError(f"{value.id} is no number")
    difference = None if ours is None else difference_from(ours, span_of(value))
    # The one rule: see the note of the table.
    verdict: Verdict = "misses"
    if not comparable:
        verdict = "not comparable"
    elif difference is None:
        verdict = "not found"
    elif value.resolution is None:
        verdict = "not judged"
    elif abs(difference) <= max(value.resolution, uncertainty or 0.0) + _ROUNDING:
        verdict = "agrees"
    published = value.span or value.value
    return Row(quantity, value.source, published, ours, difference, uncertainty, verdict, basis, value.unit)


def statement_row(
    value: PublishedValue,
    outcome: Outcome,
    uncertainty: float | None,
    *,
    basis: Basis = "predicted",
    comparable: bool = True,
) -> Row:
    """Compare a published statement with the number of its check, by the rule at the end of the check's words."""
    number = float(outcome[0] - outcome[1]) if isinstance(outcome, tuple) else outcome
    verdict: Verdict = "not found"
    if not comparable:
        verdict = "not comparable"
    elif isinstance(outcome, tuple):
        verdict = "holds" if outcome[0] > 0 == outcome[1] else "fails"
    elif outcome is not None:
        match = _RULE.search(value.check)
        if match is None:
            raise ValueError(f"{value.id}: no rule of the kind 'holds above 1' in '{value.check}'")
        verdict = "holds" if _RULES[match[1]](outcome, float(match[2])) else "fails"
    return Row(value.check, value.source, None, number, None, uncertainty, verdict, basis, value.unit, value.statement)


def rows_mapping(rows: Sequence[Any]) -> list[dict[str, Any]]:
    """Return rows, which are dataclasses, as plain data for JSON, in full precision; None for what is no number."""
    entries = (dataclasses.asdict(row).items() for row in rows)
    return [{k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in row} for row in entries]


def rows_table(rows: Sequence[Row], *origins: str) -> Table:
    """Put the rows into one table."""
    columns = (
        *map(Column, ("quantity", "source", "published")),
        *(Column(name, digits=3) for name in ("ours", "difference", "uncertainty")),
        *map(Column, ("unit", "verdict", "basis")),
    )
    note = " ".join([_NOTE, *filter(None, origins)])
    return Table("Validation against published values", columns, tuple(_cells(row) for row in rows), note)


def rows_markdown(rows: Sequence[Row]) -> str:
    """Write the rows as a page in Markdown that says how it was made."""
    table = rows_table(rows)
    return f"# {table.title}\n\nMade by `{_COMMAND}`.\n{table.note}\n\n{to_markdown(table)}"


def _cells(row: Row) -> tuple[Cell, ...]:
    """Return the cells of a row, with the reason for each number that it lacks."""
    named = f"{row.statement} ({row.quantity})" if row.statement else row.quantity
    ends = row.published if isinstance(row.published, tuple) else (row.published,)
    published: Cell = " to ".join(f"{end:g}" for end in ends if end is not None) or Missing.NOT_DEFINED
    numbers: tuple[Cell, Cell, Cell] = (Missing.NO_EVENT,) * 3
    if row.ours is not None:
        difference = Missing.NOT_DEFINED if row.difference is None else row.difference
        numbers = row.ours, difference, Missing.NOT_STUDIED if row.uncertainty is None else row.uncertainty
    return (named, row.source, published, *numbers, row.unit, row.verdict, row.basis)


R = TypeVar("R")
_READING = "reading"


@dataclass(frozen=True)
class Stored(Generic[R]):
    """Rows, and where they come from."""

    rows: tuple[R, ...]  # the rows
    origin: str = ""  # where they come from, in a sentence
    computed: bool = False  # whether they were computed, or read back


@dataclass(frozen=True)
class RowFile(Generic[R]):
    """Where rows of one kind are stored, and what makes them."""

    name: str  # name of the file, in the folder of all results or in its folder `reference`
    kind: str  # what the rows are called, such as 'intervals'
    command: str  # the command that computes them
    effort: str  # how long that takes, in words
    studies: tuple[str, ...]  # names of the studies that they are computed from
    row: Callable[..., R]  # dataclass of a row
    reading: Mapping[str, Any] = field(default_factory=dict)


def stored_rows(file: RowFile[R], work: Work, compute: Callable[[], Sequence[R]] | None = None) -> Stored[R]:
    """Return rows that are computed and stored, or else those that were stored last, or else those that ship."""
    if compute is not None:
        rows = tuple(compute())
        record = {"command": file.command, "version": versions()["fingerslip"], "inputs": _inputs(file, work.studies)}
        write_json(work.results / file.name, {"made": record, "rows": rows_mapping(rows)})
        return Stored(rows, computed=True)
    for path in (work.results / file.name, work.results / "reference" / file.name):
        try:
            return _read_rows(file, path, work.studies)
        except FileNotFoundError:
            continue
    return Stored((), f"No {file.kind} are stored; {file.command} computes them, which takes {file.effort}.")


def _read_rows(file: RowFile[R], path: Path, studies: Path) -> Stored[R]:
    stored: Any = read_json(path, f"run {file.command}")
    try:
        # JSON has tuples as lists.
        entries = [{name: tuple(v) if isinstance(v, list) else v for name, v in row.items()} for row in stored["rows"]]
        rows = tuple(file.row(**entry) for entry in entries)
        version, then = stored["made"]["version"], dict(stored["made"]["inputs"])
    except (KeyError, TypeError, ValueError) as error:
        raise ResultError(f"{path}: is of another version ({error}); run {file.command}") from error
    now = _inputs(file, studies)
    reading = then.pop(_READING, None), now.pop(_READING, None)
    state = "the studies are the same" if then == now else "the studies have changed since"
    if then == now and reading[0] != reading[1]:
        state = "how their runs are read has changed since"
    again = f"{file.command} computes them again."
    return Stored(rows, f"{file.kind.capitalize()} are stored in {path} by fingerslip {version}; {state}. {again}")


def _inputs(file: RowFile[Any], studies: Path) -> dict[str, str]:
    """Return a hash of what each study holds, of one that cannot be read none, and of how the runs are read."""
    inputs = {_READING: digest(file.reading)} if file.reading else {}
    for name in file.studies:
        with contextlib.suppress(FingerslipError):
            inputs[name] = digest([read_with_base(studies / f"{name}.yaml")])
    return inputs


#: The studies that sample the unknown dimensions, and what their models are called.
GEOMETRY: Mapping[str, str] = {"wang2014_geometry": "section", "wang2014_geometry_3d": "in 3D"}
_GEOMETRY_NOTE = (
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


def allowed_geometry(work: Work, *, compute: bool = False) -> Stored[GeometryRow]:
    """Return what the unknown geometry allows: computed and stored, or as it was stored last."""

    def make_rows() -> list[GeometryRow]:
        return [row for study in work.run(GEOMETRY) for row in geometry_rows(study)]

    return stored_rows(GEOMETRY_FILE, work, make_rows if compute else None)


def geometry_rows(study: StudyResult) -> tuple[GeometryRow, ...]:
    """Return the rows of one geometry study, each published time in the reading of the paper or the likely ones.

    Runs in 3D have the events that validation reads at the reference nodes.
    """
    model, runs = GEOMETRY[study.folder.name], study.runs
    if model == "in 3D":
        runs = tuple(measure_folder(study.folder / run.name, run, measure_3d).run for run in runs)
    readings = READINGS if model == "section" else SOLID_READINGS
    rows = []
    for entry in published_intervals(runs, [published_set(name) for name in study.compare]):
        value, interval = entry.value, entry.interval
        variant = f"{value.conditions[VARIANT]}, " if model == "section" else ""
        name = f"{event_label(value.quantity)}, {variant}{model} ({readings[entry.reading]})"
        numbers = None if interval is None else tuple(round(number, 6) for number in interval.summary)
        count = 0 if interval is None else len(interval.values)
        published = value.span or value.value or 0.0
        rows.append(GeometryRow(name, value.source, published, numbers, entry.where, count, entry.samples))
    return tuple(rows)


def geometry_table(rows: tuple[GeometryRow, ...], origin: str = "") -> Table:
    """Put the rows into one table."""
    first, last = ("quantity", "source", "published [s]"), ("published lies", "found in")
    cells = []
    for row in rows:
        times = row.published if isinstance(row.published, tuple) else (row.published,)
        interval: tuple[Cell, ...] = row.interval or (Missing.NO_EVENT,) * len(INTERVAL_COLUMNS)
        published, where = " to ".join(f"{time:.2f}" for time in times), row.where or Missing.NOT_DEFINED
        cells.append((row.quantity, row.source, published, *interval, where, f"{row.found} of {row.samples}"))
    columns = (*map(Column, first), *INTERVAL_COLUMNS, *map(Column, last))
    note = f"{_GEOMETRY_NOTE} {origin}".strip() if rows else origin
    return Table("What the unknown geometry allows", columns, tuple(cells), note)


@dataclass(frozen=True)
class Comparison:
    """Published values beside ours."""

    rows: tuple[Row, ...]  # the rows
    origins: tuple[str, ...] = ()  # where those come from that were stored, in sentences
    geometry: Stored[GeometryRow] | None = None  # what the unknown geometry of the finger allows

    @property
    def tables(self) -> list[Table]:
        """The rows as tables."""
        first = rows_table(self.rows, *self.origins)
        return [first, *([] if self.geometry is None else [geometry_table(self.geometry.rows, self.geometry.origin)])]

    def mapping(self) -> Any:
        """Return the rows as plain data, under keys beside those of the geometry if it was computed."""
        plain, geometry = rows_mapping(self.rows), self.geometry
        return {"rows": plain, "geometry": rows_mapping(geometry.rows)} if geometry and geometry.computed else plain

    def markdown(self) -> str:
        """Write the rows as a page in Markdown, with those of the geometry where it was computed."""
        page = rows_markdown(self.rows)
        if self.geometry is None or not self.geometry.computed:
            return page
        table = geometry_table(self.geometry.rows)
        return f"{page}\n## {table.title}\n\n{table.note}\n\n{to_markdown(table)}"
