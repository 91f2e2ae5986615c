"""Tables of convergence: every number of a run with order, limit and uncertainty, and the series behind them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from fingerslip.report.tables.table import Cell, Column, Table
from fingerslip.uncertainty import Convergence, Refinement

__all__ = ["convergence_table", "series_table"]

_REFINED = ("mesh", "step", "penalty")
_NOTE = (
    "Uncertainty: root of the sum of squares of those over mesh, step, contact stiffness (penalty) and numerical "
    "damping (alpha). Of the first three it is 1.25 times the distance to Richardson's limit where the values approach "
    "one with an order of at least 0.5 (in brackets), else three times their range (up/down: they oscillate; slow: "
    "order below 0.5; away: they diverge); of alpha the largest change. A number converges when with every setting it "
    "approaches a limit or moves by no more than 0.2 %. A dash: the event did not happen, or not at every level."
)
_WORDS = {"oscillatory": "up/down", "divergent": "away", "slow": "slow"}


def convergence_table(quantities: Iterable[Convergence], title: str) -> Table:
    """Show how well the numbers of a run are known.

    Parameters
    ----------
    quantities : iterable of Convergence
        The numbers.
    title : str
        What they are of.
    """
    columns = (
        Column("quantity"),
        Column("unit"),
        Column("value"),
        Column("uncertainty"),
        *(Column(f"± {setting}") for setting in (*_REFINED, "alpha")),
        Column("converges"),
    )
    rows = tuple(_row(one) for one in quantities)
    return Table(f"Numerical uncertainty, {title}", columns, rows, _NOTE)


def series_table(runs: Mapping[str, Mapping[str, Convergence]]) -> Table:
    """List every number at every level, one row each, for other programs.

    Parameters
    ----------
    runs : mapping of str to mapping of str to Convergence
        The numbers by run and key.
    """
    names = ("run", "quantity", "unit", "setting", "size", "value")
    rows = tuple(
        (run, key, one.unit, setting, size, value)
        for run, quantities in runs.items()
        for key, one in quantities.items()
        for setting, series in one.sources.items()
        for size, value in zip(series.sizes, series.values, strict=True)
    )
    return Table("Refinement", tuple(Column(name) for name in names), rows)


def _row(one: Convergence) -> tuple[Cell, ...]:
    found = one.refinements
    settings = [_setting(found.get(setting)) for setting in (*_REFINED, "alpha")]
    return (one.quantity, one.unit, _number(one.value), _number(one.uncertainty), *settings, _verdict(one))


def _verdict(one: Convergence) -> str | None:
    if one.value is None:
        return None
    return f"not with {', '.join(one.unsettled)}" if one.unsettled else "yes"


def _setting(found: Refinement | None) -> str | None:
    if found is None or found.uncertainty is None:
        return None
    number = _number(found.uncertainty)
    if found.behaviour == "monotone" and found.order is not None:
        return f"{number} ({found.order:.1f})"
    word = _WORDS.get(found.behaviour) if found.order is not None or found.limit is None else None
    return f"{number} ({word})" if word and found.uncertainty else number


def _number(value: float | None) -> str | None:
    return None if value is None else f"{value:.4g}"
