"""Tables: as data, for the terminal, in Markdown and as CSV."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from typing import Literal

import rich.box
import rich.table
from rich.markup import escape

__all__ = [
    "Cell",
    "Column",
    "Measured",
    "Table",
    "is_numeric",
    "texts",
    "to_csv",
    "to_markdown",
    "to_rich",
]


@dataclass(frozen=True)
class Measured:
    """A number with its numerical uncertainty.

    Parameters
    ----------
    value, uncertainty : float
        Both in the unit of their column.
    """

    value: float
    uncertainty: float


Cell = str | float | int | bool | Measured | None

_WIDEST_WORD = 16


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
            case Measured():
                return f"{self.format(cell.value)} ± {self.format(cell.uncertainty)}"
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
        case Measured():
            return _exact(cell.value)
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
    return bool(cells) and all(
        isinstance(cell, int | float | Measured) and not isinstance(cell, bool) for cell in cells
    )
