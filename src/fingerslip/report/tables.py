"""Tables of slip events and peaks: as data, for the terminal, in Markdown and as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Literal

import rich.box
import rich.table
from rich.markup import escape

from fingerslip.report.published import PublishedSet, PublishedValue
from fingerslip.slip import Events, PeakTable, SlipEvents

__all__ = [
    "WAYS",
    "Cell",
    "Column",
    "RunEvents",
    "Table",
    "compare_table",
    "events_table",
    "flatten",
    "is_numeric",
    "peaks_table",
    "statements_table",
    "summary_table",
    "texts",
    "to_csv",
    "to_markdown",
    "to_rich",
    "ways_table",
]

Cell = str | float | int | bool | None

WAYS: Mapping[str, str] = MappingProxyType(
    {"slip": "accumulated slip", "displacement": "displacement", "acceleration": "acceleration peaks"}
)
_WIDEST_WORD = 16
_TIMES = ("incipient", "three_quarter", "overall", "latency")


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Parameters
    ----------
    name : str
        Its heading.
    unit : str
        Unit of its numbers; empty for text.
    digits : int or None
        Digits after the point for people; None writes up to six significant ones.
    """

    name: str
    unit: str = ""
    digits: int | None = None

    @property
    def heading(self) -> str:
        """Name and unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def format(self, cell: Cell) -> str:
        """Write a cell for people; a missing value is a dash."""
        match cell:
            case None:
                return "-"
            case bool():
                return "yes" if cell else "no"
            case float():
                return f"{cell:.6g}" if self.digits is None else f"{cell:.{self.digits}f}"
            case _:
                return str(cell)


@dataclass(frozen=True)
class Table:
    """A table as data.

    Parameters
    ----------
    title : str
        What it shows.
    columns : tuple of Column
        Its columns.
    rows : tuple of tuple
        A cell for each column; None where there is no value.
    note : str
        What a reader has to know.
    """

    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""


@dataclass(frozen=True)
class RunEvents:
    """The events of one run of a study.

    Parameters
    ----------
    label : str
        Its name.
    swept : mapping of str to object
        The swept values by dotted path.
    events : Events
        Its slip events.
    values : mapping of str to object
        All values of the run by dotted path (see :func:`flatten`), for comparison with published values.
    """

    label: str
    swept: Mapping[str, Any]
    events: Events
    values: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def all_values(self) -> dict[str, Any]:
        """Every known value by dotted path."""
        return {**self.values, **self.swept}


def flatten(mapping: Mapping[str, Any]) -> dict[str, Any]:
    """Turn nested plain data into values by dotted path.

    Examples
    --------
    >>> flatten({"contact": {"friction_coefficient": 0.6}, "programme": [{"hold": 1}]})
    {'contact.friction_coefficient': 0.6, 'programme.0.hold': 1}
    """
    flat: dict[str, Any] = {}
    for key, value in mapping.items():
        inner = dict(enumerate(value)) if isinstance(value, list | tuple) else value
        if isinstance(inner, Mapping) and inner:
            flat |= {f"{key}.{path}": leaf for path, leaf in flatten({str(k): v for k, v in inner.items()}).items()}
        else:
            flat[key] = value
    return flat


def summary_table(runs: Sequence[RunEvents]) -> Table:
    """Put the events of all runs into one table: one row per run, times in seconds.

    The columns are the swept paths, then ``incipient_s, three_quarter_s, overall_s, latency_s`` from accumulated
    slip, and the same four with ``_displacement`` and ``_acceleration``.
    """
    paths = _swept_paths(runs)
    names = [f"{time}_s{suffix}" for suffix in ("", "_displacement", "_acceleration") for time in _TIMES]
    rows = tuple((*(run.swept.get(path) for path in paths), *_all_times(run.events)) for run in runs)
    return Table("Slip events", tuple(Column(name) for name in (*paths, *names)), rows)


def events_table(runs: Sequence[RunEvents], way: str = "slip") -> Table:
    """Show the events of all runs, read in one way.

    Parameters
    ----------
    runs : sequence of RunEvents
        The runs.
    way : {'slip', 'displacement', 'acceleration'}
        How events are read.
    """
    columns = (*_swept_columns(runs), *_event_columns())
    rows = tuple((*_swept_cells(run, runs), *_event_cells(getattr(run.events, way))) for run in runs)
    return Table(f"Slip events from {WAYS[way]}", columns, rows)


def ways_table(events: Events, title: str = "Slip events") -> Table:
    """Show the events of one run, a row for each way of reading them."""
    rows = tuple((text, *_event_cells(getattr(events, way))) for way, text in WAYS.items())
    return Table(title, (Column("read from"), *_event_columns()), rows)


def peaks_table(peaks: PeakTable, title: str = "Acceleration peaks") -> Table:
    """Show the acceleration peaks of one run, the most prominent first."""
    columns = (
        Column("rank"),
        Column("time", "s", 3),
        Column("height", "m/s²", 3),
        Column("prominence", "m/s²", 3),
        Column("over noise", "", 1),
    )
    spread = peaks.noise_spread
    rows = tuple(
        (rank, peak.time, peak.height, peak.prominence, peak.prominence / spread if spread else None)
        for rank, peak in enumerate(peaks.ranked, start=1)
    )
    note = f"Noise floor {peaks.noise_floor:.3g} m/s², spread {spread:.2g} m/s²; over noise is prominence by spread."
    return Table(title, columns, rows, note)


def compare_table(runs: Sequence[RunEvents], reference: PublishedSet) -> Table:
    """Put events beside published values.

    A published time is shown for every run that meets its conditions, with our time from each way and the difference.

    Parameters
    ----------
    runs : sequence of RunEvents
        The runs; `values` has to hold what the conditions name.
    reference : PublishedSet
        Published values; those that are no event are left out.

    Returns
    -------
    Table
        Times in seconds, differences (ours less published) in milliseconds; without rows where nothing fits.
    """
    columns = (
        *_swept_columns(runs),
        Column("event"),
        Column("published", "s"),
        *(
            Column(heading, unit, digits)
            for heading_of_way in ("slip", "displ.", "peaks")
            for heading, unit, digits in ((heading_of_way, "s", 3), ("diff.", "ms", 0))
        ),
    )
    pairs = [(run, value) for run in runs for value in reference.values if value.holds_for(run.all_values)]
    rows = tuple(
        (*_swept_cells(run, runs), *_comparison(run, value))
        for run, value in pairs
        if value.value is not None and _is_event(value)
    )
    note = (
        "Ours, read from accumulated slip, displacement and acceleration peaks, and how much later than published. "
        f"A dash: the event did not happen. Published: {reference.citation}"
    )
    return Table(reference.title, columns, rows, note)


def statements_table(reference: PublishedSet) -> Table:
    """Show published statements in words, and what number can be held against each."""
    columns = (Column("statement"), Column("what to check"), Column("holds for"))
    rows = tuple(
        (value.statement, value.check, ", ".join(f"{path} = {held}" for path, held in value.conditions.items()))
        for value in reference.values
        if value.statement
    )
    return Table(reference.title, columns, rows, f"Published: {reference.citation}")


def to_rich(table: Table) -> rich.table.Table:
    """Turn a table into one for the terminal."""
    shown = rich.table.Table(
        title=escape(table.title), title_justify="left", box=rich.box.SIMPLE_HEAD, padding=0, pad_edge=False
    )
    shown.caption, shown.caption_justify = escape(table.note) or None, "left"
    for place, column in enumerate(table.columns):
        words = [word for text in (column.heading, *(row[place] for row in texts(table))) for word in text.split()]
        longest_word = max(map(len, words))
        justify: Literal["left", "right"] = "right" if is_numeric(table, place) else "left"
        heading = escape(column.heading.replace(" [", "\n["))
        shown.add_column(heading, justify=justify, min_width=min(longest_word, _WIDEST_WORD))
    for cells in texts(table):
        shown.add_row(*(escape(cell) for cell in cells))
    return shown


def to_markdown(table: Table) -> str:
    """Write a table in Markdown, without its title; numbers stand right."""
    rules = ["---:" if is_numeric(table, place) else "---" for place in range(len(table.columns))]
    head = [column.heading for column in table.columns]
    lines = [head, rules, *texts(table)]
    escaped = [[cell.replace("|", "\\|") for cell in line] for line in lines]
    return "".join(f"| {' | '.join(line)} |\n" for line in escaped)


def to_csv(table: Table) -> str:
    """Write a table as CSV with full precision; a missing value is an empty field."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(column.name for column in table.columns)
    writer.writerows([_exact(cell) for cell in row] for row in table.rows)
    return stream.getvalue()


def _exact(cell: Cell) -> str:
    match cell:
        case None:
            return ""
        case bool():
            return str(cell).lower()
        case float():
            # Ten digits hide the rounding of sums of steps, which differs between machines.
            return f"{cell:.10g}"
        case _:
            return str(cell)


def texts(table: Table) -> list[list[str]]:
    """Return the cells of a table as people read them, row by row."""
    return [[column.format(cell) for column, cell in zip(table.columns, row, strict=True)] for row in table.rows]


def is_numeric(table: Table, place: int) -> bool:
    """Tell whether a column holds numbers only."""
    cells = [row[place] for row in table.rows if row[place] is not None]
    return bool(cells) and all(isinstance(cell, int | float) and not isinstance(cell, bool) for cell in cells)


def _all_times(events: Events) -> list[float | None]:
    return [getattr(getattr(events, way), time) for way in WAYS for time in _TIMES]


def _event_columns() -> tuple[Column, ...]:
    names = ("incipient", "48 %", "three-quarter", "overall")
    return (*(Column(name, "s", 3) for name in names), Column("latency", "ms", 0))


def _event_cells(events: SlipEvents) -> tuple[Cell, ...]:
    latency = events.latency
    times = (events.incipient, events.noticed, events.three_quarter, events.overall)
    return (*times, None if latency is None else 1e3 * latency)


def _short(path: str) -> str:
    return path.removesuffix(".enabled").rsplit(".", 1)[-1].replace("_", " ")


def _swept_paths(runs: Sequence[RunEvents]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(path for run in runs for path in run.swept))


def _swept_columns(runs: Sequence[RunEvents]) -> tuple[Column, ...]:
    paths = _swept_paths(runs)
    shorts = [_short(path) for path in paths]
    names = [short if shorts.count(short) == 1 else path for short, path in zip(shorts, paths, strict=True)]
    return tuple(Column(name) for name in names) or (Column("run"),)


def _swept_cells(run: RunEvents, runs: Sequence[RunEvents]) -> tuple[Cell, ...]:
    return tuple(run.swept.get(path) for path in _swept_paths(runs)) or (run.label,)


def _is_event(value: PublishedValue) -> bool:
    return value.quantity in _TIMES


def _comparison(run: RunEvents, value: PublishedValue) -> tuple[Cell, ...]:
    assert value.value is not None  # held by compare_table
    low, high = value.span or (value.value, value.value)
    ours: list[Cell] = []
    for way in WAYS:
        time = getattr(getattr(run.events, way), value.quantity) if value.way in ("", way) else None
        # Within a published range the difference is zero, outside it is taken to the nearer end.
        nearest = None if time is None else min(max(time, low), high)
        ours += [time, None if time is None or nearest is None else 1e3 * (time - nearest)]
    text = f"{low:.2f}" if low == high else f"{low:.2f} to {high:.2f}"
    return (value.quantity.replace("_", "-"), text, *ours)
