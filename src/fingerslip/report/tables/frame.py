"""Results of a study as a data frame, for pandas and for Parquet files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fingerslip.report.tables.summary import summary_table, summary_units
from fingerslip.report.tables.table import Cell, Measured, Missing, Table
from fingerslip.results import StudyResult

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["runs_frame", "table_frame"]


def runs_frame(study: StudyResult) -> pd.DataFrame:
    """Put the results of a study into a data frame: a row for each run, the columns of its ``summary.csv``.

    Units: returns ["units"].
    """
    import pandas as pd

    table = summary_table(study.runs, study.refused)
    names = [column.name for column in table.columns]
    columns = zip(*table.rows, strict=True) if table.rows else ([] for _ in names)
    frame = pd.DataFrame({name: _series(cells) for name, cells in zip(names, columns, strict=True)})
    frame.attrs["units"] = summary_units(study.runs, study.refused)
    frame.attrs["title"] = study.title
    return frame


def table_frame(table: Table) -> pd.DataFrame:
    """Put a table into a data frame."""
    import pandas as pd

    columns = zip(*table.rows, strict=True) if table.rows else ([] for _ in table.columns)
    named = zip(table.columns, columns, strict=True)
    frame = pd.DataFrame({column.name: _series([_value(cell) for cell in cells]) for column, cells in named})
    units = {column.name: column.unit for column in table.columns if column.unit}
    frame.attrs |= {"units": units, "title": table.title, "note": table.note}
    return frame


def _value(cell: Cell) -> Cell:
    match cell:
        case Missing():
            return None
        case Measured():
            return cell.value
        case _:
            return cell


def _series(cells: Sequence[Cell]) -> pd.Series:
    """Return a column as numbers where all that it has are numbers, or missing."""
    import pandas as pd

    are_numbers = all(cell is None or (isinstance(cell, int | float) and not isinstance(cell, bool)) for cell in cells)
    return pd.Series(list(cells), dtype="float64" if cells and are_numbers else "object")
