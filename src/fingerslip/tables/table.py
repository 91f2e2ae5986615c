"""Tables: columns with units, uncertainties and reasons for what is missing, as text, Markdown, CSV and HTML."""

from __future__ import annotations

import enum
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Self

import rich.box
import rich.console
import rich.table
import rich.text
from rich.cells import cell_len, chop_cells
from rich.markup import escape

from fingerslip.storage.files import csv_text


@dataclass(frozen=True)
class Measured:
    """A number with its numerical uncertainty."""

    value: float  # both in the unit of their column
    uncertainty: float  # both in the unit of their column


class Resolved(float):
    """A number that people see with digits of its own, those that its uncertainty has."""

    digits: int  # after the point, negative for zeros before it

    def __new__(cls, value: float, digits: int) -> Self:
        """Return a number with its digits."""
        number = super().__new__(cls, value)
        number.digits = digits
        return number

    def __getnewargs__(self) -> tuple[float, int]:  # type: ignore[override]  # for copies
        return float(self), self.digits


@dataclass(frozen=True)
class Interval:
    """A number with the ends of its interval: text for people, three columns in CSV."""

    value: float  # all in the unit of their column
    low: float | None = None
    high: float | None = None

    def __str__(self) -> str:
        ends = "" if self.low is None else f" [{self.low:z.3f}, {self.high:z.3f}]"
        return f"{self.value:z.3f}{ends}"


class Missing(enum.Enum):
    """Why a cell has no value: what the cell shows, and what the legend below the table says."""

    NO_EVENT = ("none", "the event did not happen")
    NOT_RECORDED = ("n/r", "not recorded in this run")
    NOT_COMPARED = ("n/c", "not compared: nothing is published for it, or no run meets the conditions")
    NOT_DEFINED = ("n/a", "not applicable")
    NOT_STUDIED = ("n/s", "not studied")
    NOT_JUDGED = ("n/j", "not judged: a press, many markers behind, or slip without springing back")

    @property
    def shown(self) -> str:
        """What the cell shows."""
        return self.value[0]

    @property
    def meaning(self) -> str:
        """What it means."""
        return self.value[1]


Cell = str | float | int | bool | Measured | Interval | Missing | None

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
                return f"{self.format(cell.value)} ± {self._format_uncertainty(cell)}"
            case float():
                return self._format_number(cell)
            case _:
                return str(cell)

    def _format_number(self, value: float) -> str:
        # A rounded zero has no sign.
        digits = getattr(value, "digits", self.digits)
        if digits is None:
            return f"{value:z.{self.significant}g}"
        return f"{round(float(value), digits) if digits < 0 else value:z.{max(digits, 0)}f}"

    def _format_uncertainty(self, cell: Measured) -> str:
        """Write an uncertainty; one below the last digit is not nothing."""
        value, digits = cell.uncertainty, getattr(cell.value, "digits", self.digits)
        if digits is None:
            return f"{value:.2g}"
        least = 10.0**-digits
        return self.format(Resolved(value, digits)) if value >= 0.5 * least else f"<{least:.{max(digits, 0)}f}"


@dataclass(frozen=True)
class Table:
    """A table as data, with a cell for each column: None for an empty one, :class:`Missing` for one without a value."""

    title: str  # what it shows
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""  # what a reader has to know
    marked: tuple[int, ...] = ()  # numbers of the rows that stand out

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


def to_page(tables: Iterable[Table]) -> str:
    """Write tables below each other in Markdown, with their titles and notes."""
    return "\n".join(f"## {table.title}\n\n{to_markdown(table)}\n{table.note}\n" for table in tables)


def to_csv(table: Table) -> str:
    """Write a table as CSV with full precision; a missing value is an empty field, whatever the reason.

    A column with intervals has two more behind it, for their ends.
    """
    lines: list[list[str]] = [[] for _ in range(len(table.rows) + 1)]
    for index, column in enumerate(table.columns):
        cells = [row[index] for row in table.rows]
        has_ends = any(isinstance(cell, Interval) for cell in cells)
        lines[0] += [column.name, *([f"{column.name} low", f"{column.name} high"] if has_ends else [])]
        for line, cell in zip(lines[1:], cells, strict=True):
            ends = (cell.low, cell.high) if isinstance(cell, Interval) else (None, None)
            line += [_exact(cell), *(map(_exact, ends) if has_ends else [])]
    return csv_text(lines)


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
        case Interval():
            return {"value": cell.value, "low": cell.low, "high": cell.high}
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
        case Measured() | Interval():
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


# Words of so many letters are never broken; longer ones first where their parts meet, as in `displacement_threshold`.
_WHOLE = 16
_PART = re.compile(r".+?(?:(?<=\w)[_/-](?=\w)|(?<=\w)\.(?=[a-z])|$)")


def to_rich(table: Table, width: int = 80) -> rich.console.Group:
    """Turn a table into one for the terminal, with its remarks below it."""
    widths = _widths(table, width)
    rows_shown = _list_rows(table, width) if widths is None or not table.rows else [_grid(table, widths)]
    # A caption of the table itself would be as narrow as the table.
    remarks = rich.text.Text(f"{table.remarks}\n" if table.remarks else "", style="dim italic")
    return rich.console.Group(*rows_shown, remarks)


def _grid(table: Table, widths: Sequence[int]) -> rich.table.Table:
    grid = rich.table.Table(
        title=escape(table.title), title_justify="left", box=rich.box.SIMPLE_HEAD, padding=0, pad_edge=False
    )
    for index, column in enumerate(table.columns):
        justify: Literal["left", "right"] = "right" if is_numeric(table, index) else "left"
        heading = _wrap(column.heading.replace(" [", "\n["), widths[index])[0]
        grid.add_column(escape("\n".join(heading)), justify=justify, width=widths[index], overflow="fold")
    for index, cells in enumerate(texts(table)):
        wrapped = (_wrap(cell, width)[0] for cell, width in zip(cells, widths, strict=True))
        grid.add_row(*(escape("\n".join(lines)) for lines in wrapped), style="bold" if index in table.marked else None)
    return grid


def _list_rows(table: Table, width: int) -> list[rich.console.RenderableType]:
    """Write every row as a list of its cells, under the title."""
    # Where headings leave less room, they are narrowed rather than the cells.
    beside = max(_beside(table, width), _WHOLE)
    items: list[rich.console.RenderableType] = [rich.text.Text(f"{table.title}\n", style="italic")]
    for index, cells in enumerate(texts(table)):
        row = rich.table.Table.grid(padding=(0, 1))
        row.add_column(overflow="fold", style="dim")
        row.add_column(overflow="fold", style="bold" if index in table.marked else "")
        for column, cell in zip(table.columns, cells, strict=True):
            row.add_row(escape(column.heading), escape("\n".join(_wrap(cell, beside)[0])))
        items += [row, rich.text.Text()]
    return items


def _widths(table: Table, width: int) -> list[int] | None:
    """Return the width of each column; None where none fits without breaking numbers, short or many words."""
    columns = list(zip(*texts(table), strict=True)) or [()] * len(table.columns)
    measured = [
        _measure(column.heading, cells, is_numeric(table, index))
        for index, (column, cells) in enumerate(zip(table.columns, columns, strict=True))
    ]
    floors, *stages = (list(entry) for entry in zip(*measured, strict=True))
    # Between any two columns, and at both ends, there is one space.
    room = width - len(floors) - 1
    if sum(floors) > room:
        return None
    widths = floors
    for wanted in stages:
        widths = _fill_widths(widths, wanted, room)
    return widths if _is_readable(table, widths, width) else None


def _is_readable(table: Table, widths: Sequence[int], width: int) -> bool:
    """Tell whether a grid is no longer than rows written as lists, where each broken word counts as two lines."""
    headings = [column.heading.replace(" [", "\n[") for column in table.columns]
    beside = _beside(table, width)
    grid, listed = 0, 0
    for cells in (headings, *texts(table)):
        wrapped = [_wrap(cell, element) for cell, element in zip(cells, widths, strict=True)]
        grid += max((len(lines) for lines, _ in wrapped), default=0) + 2 * sum(broken for _, broken in wrapped)
        listed += sum(len(_wrap(cell, beside)[0]) for cell in cells) + 1
    # Headings stand once above the grid, and beside every cell of a list.
    return grid <= max(listed, 2 * len(table.columns))


def _beside(table: Table, width: int) -> int:
    """Return the room beside the headings of a list."""
    return max(width - max((cell_len(column.heading) for column in table.columns), default=0) - 2, 1)


def _wrap(text: str, width: int) -> tuple[list[str], int]:
    """Return the lines of a text in a width, and how many of its words are broken within a part.

    Examples
    --------
    >>> _wrap("time_threshold slips", 14), _wrap("time_threshold", 10), _wrap("incipient", 7)
    ((['time_threshold', 'slips'], 0), (['time_', 'threshold'], 0), (['incipie', 'nt'], 1))
    """
    lines, broken = [], 0
    for line in text.split("\n"):
        if cell_len(line) <= width:
            lines.append(line)
            continue
        element = [""]
        for word in line.split():
            chunks = [word] if cell_len(word) <= width else _PART.findall(word)
            for number, part in enumerate(chunks):
                joined = element[-1] + (" " if element[-1] and not number else "") + part
                if cell_len(joined) <= width:
                    element[-1] = joined
                    continue
                chopped = chop_cells(part, width)
                broken += len(chopped) > 1
                element += chopped
        lines += element[1:] if not element[0] else element
    return lines, broken


def _measure(heading: str, cells: Sequence[str], numeric: bool) -> tuple[int, int, int]:
    """Return the least width of a column, one that leaves all words whole, and one that breaks no line."""
    lines = (*heading.replace(" [", "\n[").split("\n"), *cells)
    words = [word for line in lines for word in line.split()]
    # A word that need not be whole may be broken where its parts meet.
    chunks = [part for word in words for part in _PART.findall(word)]
    # A number is never broken.
    smallest = max(map(cell_len, cells), default=0) if numeric else 1
    return (
        max(smallest, min(max(map(cell_len, chunks), default=1), _WHOLE)),
        max(smallest, *map(cell_len, words), 1),
        max(smallest, *map(cell_len, lines)),
    )


def _fill_widths(widths: Sequence[int], wanted: Sequence[int], room: int) -> list[int]:
    """Widen columns as far as they want and there is room, which those that lack most share evenly."""
    filled, left = list(widths), room - sum(widths)
    by_lack = sorted(range(len(filled)), key=lambda index: wanted[index] - filled[index])
    for rest, index in zip(range(len(filled), 0, -1), by_lack, strict=True):
        more = min(max(wanted[index] - filled[index], 0), left // rest)
        filled[index] += more
        left -= more
    return filled
