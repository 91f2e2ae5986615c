"""Tables: as data, in Markdown, as CSV and for JSON."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Any

from fingerslip.files import csv_text

__all__ = [
    "Cell",
    "Column",
    "Measured",
    "Missing",
    "Table",
    "is_numeric",
    "texts",
    "to_csv",
    "to_mapping",
    "to_markdown",
    "typeset",
]


@dataclass(frozen=True)
class Measured:
    """A number with its numerical uncertainty."""

    value: float  # both in the unit of their column
    uncertainty: float  # both in the unit of their column


class Missing(enum.Enum):
    """Why a cell has no value: what the cell shows, and what the legend below the table says."""

    NO_EVENT = ("none", "the event did not happen")
    NOT_RECORDED = ("n/r", "not recorded in this run")
    NOT_COMPARED = ("n/c", "not compared: nothing is published for it, or no run meets the conditions")
    NOT_DEFINED = ("n/a", "not applicable")
    NOT_STUDIED = ("n/s", "not studied")

    @property
    def shown(self) -> str:
        """What the cell shows."""
        return self.value[0]

    @property
    def meaning(self) -> str:
        """What it means."""
        return self.value[1]


Cell = str | float | int | bool | Measured | Missing | None

_TYPESET = (("^2", "²"), ("^3", "³"), ("um", "µm"))


@dataclass(frozen=True)
class Column:
    """One column of a table."""

    name: str  # its heading
    unit: str = ""  # unit of its numbers
    digits: int | None = None  # digits after the point for people, negative for zeros before it
    significant: int = 6  # largest number of significant digits for people, where `digits` is None
    answers: bool = False  # whether it stays in sight where the table is wider than the page

    @property
    def heading(self) -> str:
        """Name and unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def format(self, cell: Cell) -> str:
        """Write a cell for people; None is an empty cell."""
        match cell:
            case None:
                return ""
            case Missing():
                return cell.shown
            case bool():
                return "yes" if cell else "no"
            case Measured():
                return f"{self.format(cell.value)} ± {self._format_uncertainty(cell.uncertainty)}"
            case float():
                return self._format_number(cell)
            case _:
                return str(cell)

    def _format_number(self, value: float) -> str:
        # A rounded zero has no sign.
        if self.digits is None:
            return f"{value:z.{self.significant}g}"
        return f"{round(value, self.digits) if self.digits < 0 else value:z.{max(self.digits, 0)}f}"

    def _format_uncertainty(self, value: float) -> str:
        """Write an uncertainty; one below the last digit is not nothing."""
        if self.digits is None:
            return f"{value:.2g}"
        return (
            self.format(value)
            if value >= 0.5 * 10.0**-self.digits
            else f"<{10.0**-self.digits:.{max(self.digits, 0)}f}"
        )


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
        A cell for each column; None for an empty cell, :class:`Missing` where a value is missing for a reason.
    note : str
        What a reader has to know.
    marked : tuple of int
        Numbers of the rows that stand out.
    """

    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""
    marked: tuple[int, ...] = ()

    @property
    def legend(self) -> str:
        """What the texts of missing values mean, as far as the table has them."""
        missing = {cell for row in self.rows for cell in row if isinstance(cell, Missing)}
        return "; ".join(f"{reason.shown}: {reason.meaning}" for reason in Missing if reason in missing)

    @property
    def remarks(self) -> str:
        """What stands below the table: its note and its legend."""
        legend = f"{self.legend}." if self.legend else ""
        return " ".join(text for text in (self.note, legend) if text)


def to_markdown(table: Table) -> str:
    """Write a table and its legend in Markdown, without title and note; numbers are aligned right."""
    rules = ["---:" if is_numeric(table, index) else "---" for index in range(len(table.columns))]
    head = [column.heading for column in table.columns]
    lines = [head, rules, *texts(table)]
    escaped = [[cell.replace("|", "\\|") for cell in line] for line in lines]
    rows = "".join(f"| {' | '.join(line)} |\n" for line in escaped)
    return f"{rows}\n{table.legend}.\n" if table.legend else rows


def to_csv(table: Table) -> str:
    """Write a table as CSV with full precision; a missing value is an empty field, whatever the reason."""
    return csv_text(
        [[column.name for column in table.columns], *([_exact(cell) for cell in row] for row in table.rows)]
    )


def to_mapping(table: Table) -> dict[str, Any]:
    """Return a table as plain data for JSON, with full precision."""
    return {
        "title": table.title,
        "columns": [{"name": column.name, "unit": column.unit} for column in table.columns],
        "rows": [[_plain(cell) for cell in row] for row in table.rows],
        "note": table.note,
    }


def _plain(cell: Cell) -> Any:
    match cell:
        case Missing():
            return {"missing": cell.meaning}
        case Measured():
            return {"value": _plain(cell.value), "uncertainty": _plain(cell.uncertainty)}
        case float():
            # JSON has no word for what is no number.
            return float(cell) if math.isfinite(cell) else None
        case _:
            return cell


def _exact(cell: Cell) -> str:
    match cell:
        case None | Missing():
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


def is_numeric(table: Table, index: int) -> bool:
    """Tell whether a column holds numbers only, or has a unit where all its values are missing."""
    cells = [row[index] for row in table.rows if row[index] is not None and not isinstance(row[index], Missing)]
    if not cells:
        return bool(table.columns[index].unit)
    return all(isinstance(cell, int | float | Measured) and not isinstance(cell, bool) for cell in cells)


def typeset(unit: str) -> str:
    """Return a unit as people read it.

    Examples
    --------
    >>> typeset("m/s^2"), typeset("um")
    ('m/s²', 'µm')
    """
    for plain, symbol in _TYPESET:
        unit = unit.replace(plain, symbol)
    return unit
