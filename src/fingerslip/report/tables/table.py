"""Tables: as data, for the terminal, in Markdown and as CSV."""

from __future__ import annotations

import csv
import enum
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import rich.box
import rich.console
import rich.table
import rich.text
from rich.cells import cell_len
from rich.markup import escape

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
    "to_rich",
    "typeset",
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

# Letters of a word that a column leaves whole, where there is room and where there is little.
_WIDEST_WORD, _NARROWEST = 16, 7
_TYPESET = (("^2", "²"), ("^3", "³"), ("um", "µm"))


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
        Digits after the point for people; None for `significant` ones.
    significant : int
        Largest number of significant digits for people, where `digits` is None.
    """

    name: str
    unit: str = ""
    digits: int | None = None
    significant: int = 6

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
                # A rounded zero has no sign.
                return f"{cell:z.{self.significant}g}" if self.digits is None else f"{cell:z.{self.digits}f}"
            case _:
                return str(cell)

    def _format_uncertainty(self, value: float) -> str:
        return f"{value:.2g}" if self.digits is None else self.format(value)


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
        found = {cell for row in self.rows for cell in row if isinstance(cell, Missing)}
        return "; ".join(f"{reason.shown}: {reason.meaning}" for reason in Missing if reason in found)

    @property
    def remarks(self) -> str:
        """What stands below the table: its note and its legend."""
        legend = f"{self.legend}." if self.legend else ""
        return " ".join(text for text in (self.note, legend) if text)


def to_rich(table: Table, width: int = 80) -> rich.console.Group:
    """Turn a table into one for the terminal, with its remarks below it.

    Parameters
    ----------
    table : Table
        The table.
    width : int, optional
        Letters in a line of the terminal. Words are broken where it is narrow; where even that leaves no room for all
        columns, every row becomes a list of its cells.
    """
    widths = _widths(table, width)
    shown = _listed(table) if widths is None else [_gridded(table, widths)]
    # A caption of the table itself would be as narrow as the table.
    remarks = rich.text.Text(f"{table.remarks}\n" if table.remarks else "", style="dim italic")
    return rich.console.Group(*shown, remarks)


def _gridded(table: Table, widths: Sequence[int]) -> rich.table.Table:
    shown = rich.table.Table(
        title=escape(table.title), title_justify="left", box=rich.box.SIMPLE_HEAD, padding=0, pad_edge=False
    )
    for index, column in enumerate(table.columns):
        justify: Literal["left", "right"] = "right" if is_numeric(table, index) else "left"
        heading = escape(column.heading.replace(" [", "\n["))
        shown.add_column(heading, justify=justify, width=widths[index], overflow="fold")
    for index, cells in enumerate(texts(table)):
        shown.add_row(*(escape(cell) for cell in cells), style="bold" if index in table.marked else None)
    return shown


def _listed(table: Table) -> list[rich.console.RenderableType]:
    """Write every row as a list of its cells, under the title."""
    shown: list[rich.console.RenderableType] = [rich.text.Text(f"{table.title}\n", style="italic")]
    for index, cells in enumerate(texts(table)):
        row = rich.table.Table.grid(padding=(0, 1))
        row.add_column(overflow="fold", style="dim")
        row.add_column(overflow="fold", style="bold" if index in table.marked else "")
        for column, cell in zip(table.columns, cells, strict=True):
            row.add_row(escape(column.heading), escape(cell))
        shown += [row, rich.text.Text()]
    return shown


def _widths(table: Table, width: int) -> list[int] | None:
    """Return the width of each column; None where no table fits without breaking numbers or very short words."""
    columns = list(zip(*texts(table), strict=True)) or [()] * len(table.columns)
    measured = [
        _measured(column.heading, cells, is_numeric(table, index))
        for index, (column, cells) in enumerate(zip(table.columns, columns, strict=True))
    ]
    floors, *stages = (list(one) for one in zip(*measured, strict=True))
    # Between any two columns, and at both ends, there is one space.
    room = width - len(floors) - 1
    if sum(floors) > room:
        return None
    widths = floors
    for wanted in stages:
        widths = _filled(widths, wanted, room)
    return widths


def _measured(heading: str, cells: Sequence[str], numeric: bool) -> tuple[int, int, int, int]:
    """Return the least width of a column, those that leave usual and all words whole, and one that breaks no line."""
    lines = (*heading.replace(" [", "\n[").split("\n"), *cells)
    words = [cell_len(word) for line in lines for word in line.split()]
    # A number is never broken.
    kept = max(map(cell_len, cells), default=0) if numeric else 1
    longest = max(words, default=1)
    return (
        max(kept, min(longest, _NARROWEST)),
        max(kept, min(longest, _WIDEST_WORD)),
        max(kept, longest),
        max(kept, *map(cell_len, lines)),
    )


def _filled(widths: Sequence[int], wanted: Sequence[int], room: int) -> list[int]:
    """Widen columns as far as they want and there is room, first those that lack least."""
    found, left = list(widths), room - sum(widths)
    for index in sorted(range(len(found)), key=lambda index: wanted[index] - found[index]):
        more = min(max(wanted[index] - found[index], 0), left)
        found[index] += more
        left -= more
    return found


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
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(column.name for column in table.columns)
    writer.writerows([_exact(cell) for cell in row] for row in table.rows)
    return stream.getvalue()


def to_mapping(table: Table) -> dict[str, Any]:
    """Return a table as plain data for JSON, with full precision.

    Returns
    -------
    dict
        ``title``, ``columns`` with `name` and `unit`, ``rows`` and ``note``. A number with an uncertainty has the keys
        `value` and `uncertainty`, a value that is missing for a reason the key `missing`; an empty cell and what is no
        finite number are null.
    """
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
    for plain, shown in _TYPESET:
        unit = unit.replace(plain, shown)
    return unit
