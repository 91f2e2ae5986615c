"""Tables of measures: the numbers that sum up runs."""

from __future__ import annotations

from collections.abc import Sequence

from fingerslip.report.tables.table import Cell, Column, Measured, Missing, Table, typeset
from fingerslip.results import RunResult
from fingerslip.slip import measures
from fingerslip.slip.measures import Measure

__all__ = ["measures_table"]


def measures_table(runs: Sequence[RunResult], titles: Sequence[str], title: str = "Measures") -> Table:
    """Show the measures of runs, a row for each measure and a column for each run."""
    columns = (Column("measure"), Column("unit"), *(Column(heading, significant=4) for heading in titles))
    rows = tuple(
        (measure.label, typeset(measure.unit.shown) if measure.unit else "", *(_cell(run, measure) for run in runs))
        for measure in measures.MEASURES
    )
    return Table(title, columns, rows)


def _cell(run: RunResult, measure: Measure) -> Cell:
    if measure.key not in run.numbers:
        return Missing.NOT_RECORDED
    value = run.numbers[measure.key]
    if value is None:
        return _reason(run, measure)
    shown, uncertainty = _displayed(value, measure), run.uncertainty.get(measure.key)
    return shown if uncertainty is None else Measured(shown, _displayed(uncertainty, measure))


def _displayed(value: float, measure: Measure) -> float:
    return measure.unit.to_display(value) if measure.unit else value


def _reason(run: RunResult, measure: Measure) -> Missing:
    """Return why a run has no value of a measure."""
    if not measure.reading:
        return Missing.NOT_DEFINED
    return Missing.NO_EVENT if run.events.reading(measure.reading).recorded else Missing.NOT_RECORDED
