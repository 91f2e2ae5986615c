"""Tables of runs: their measures, energies and series."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from fingerslip.report.tables.summary import summary_table, summary_units
from fingerslip.report.tables.table import Cell, Column, Measured, Missing, Table, typeset
from fingerslip.results import RunResult, StudyResult
from fingerslip.slip import measures
from fingerslip.slip.measures import Measure

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

__all__ = [
    "energies_table",
    "measures_table",
    "runs_frame",
    "table_frame",
]


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


_PARTS: Mapping[str, str] = MappingProxyType(
    {
        "external_work": "work of plate, supports and loads",
        "strain_energy": "strain energy",
        "friction_dissipation": "friction",
        "viscous_dissipation": "relaxation of materials",
        "damping_dissipation": "material damping",
        "numerical_dissipation": "numerical damping",
        "contact_energy": "contact penalties",
        "kinetic_energy": "kinetic energy",
        "energy_imbalance": "imbalance",
    }
)
_MILLI = 1e3


def energies_table(histories: Mapping[str, xr.Dataset]) -> Table:
    """Show energies at the end of runs [mJ], and the largest imbalance over time as a share of the largest work."""
    columns = (Column("energy at the end"), Column("unit"), *(Column(title, significant=3) for title in histories))
    rows = [(words, "mJ", *(_cell(history, name) for history in histories.values())) for name, words in _PARTS.items()]
    shares = ("largest imbalance over largest work", "", *(_share(history) for history in histories.values()))
    note = "The work equals the energies stored and dissipated, but for the imbalance."
    return Table("Energy balance", columns, (*rows, shares), note)


def _cell(history: xr.Dataset, name: str) -> Cell:
    return _MILLI * float(history[name].values[-1]) if name in history else Missing.NOT_RECORDED


def _share(history: xr.Dataset) -> Cell:
    work = float(np.abs(history["external_work"].values).max(initial=0.0))
    return float(np.abs(history["energy_imbalance"].values).max()) / work if work else Missing.NOT_DEFINED


def measures_table(runs: Sequence[RunResult], titles: Sequence[str], title: str = "Measures") -> Table:
    """Show the measures of runs, a row for each measure and a column for each run."""
    columns = (Column("measure"), Column("unit"), *(Column(heading, significant=4) for heading in titles))
    rows = tuple(
        (
            measure.label,
            typeset(measure.unit.shown) if measure.unit else "",
            *(_cell_measures(run, measure) for run in runs),
        )
        for measure in measures.MEASURES
    )
    return Table(title, columns, rows)


def _cell_measures(run: RunResult, measure: Measure) -> Cell:
    if measure.key not in run.numbers:
        return Missing.NOT_RECORDED
    value = run.numbers[measure.key]
    if value is None:
        return _reason(run, measure)
    displayed, uncertainty = _display_value(value, measure), run.uncertainty.get(measure.key)
    return displayed if uncertainty is None else Measured(displayed, _display_value(uncertainty, measure))


def _display_value(value: float, measure: Measure) -> float:
    return measure.unit.to_display(value) if measure.unit else value


def _reason(run: RunResult, measure: Measure) -> Missing:
    """Return why a run has no value of a measure."""
    if not measure.reading:
        return Missing.NOT_DEFINED
    return Missing.NO_EVENT if run.events.reading(measure.reading).recorded else Missing.NOT_RECORDED
