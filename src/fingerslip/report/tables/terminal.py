"""Tables for the terminal: grids whose columns fit its width, or lists of cells where no grid can be read."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Literal

import rich.box
import rich.console
import rich.table
import rich.text
from rich.cells import cell_len, chop_cells
from rich.markup import escape

from fingerslip.report.tables.table import Table, is_numeric, texts

__all__ = ["to_rich"]

# Words of so many letters are never broken; longer ones first where their parts meet, as in `displacement_threshold`.
_WHOLE = 16
_PART = re.compile(r".+?(?:(?<=\w)[_/-](?=\w)|(?<=\w)\.(?=[a-z])|$)")


def to_rich(table: Table, width: int = 80) -> rich.console.Group:
    """Turn a table into one for the terminal, with its remarks below it."""
    widths = _widths(table, width)
    rows_shown = _list_rows(table, width) if widths is None else [_grid(table, widths)]
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
