"""Tables of convergence: every number of a run with order, limit and uncertainty, and the series behind them."""

from __future__ import annotations

from collections.abc import Mapping

from fingerslip.report.tables.table import Cell, Column, Missing, Table
from fingerslip.slip.measures import measure_of
from fingerslip.slip.windows import NOTICED_NOTE
from fingerslip.uncertainty import SETTINGS, Convergence, Refinement

__all__ = ["convergence_table", "series_table"]

_NOTE = (
    "Uncertainty: root of the sum of squares of those over mesh, step, contact stiffness (penalty) and numerical "
    "damping (alpha). Over the first three it is 1.25 times the distance to Richardson's limit where the values "
    "approach one with an order of at least 0.5 (in brackets), else three times their range (up/down: they oscillate; "
    "slow: order below 0.5; away: they diverge); over alpha it is the largest change. A number converges when with "
    "every setting it approaches a limit or moves by no more than 0.2 %. An event that did not happen at every level, "
    "or a number that no setting changes, has no uncertainty."
)
_UNCHANGED = "unchanged"
_WORDS = {"oscillatory": "up/down", "divergent": "away", "slow": "slow"}


def convergence_table(quantities: Mapping[str, Convergence], title: str) -> Table:
    """Show how well the numbers of a run are known."""
    columns = (
        Column("quantity"),
        Column("unit"),
        Column("value"),
        Column("uncertainty"),
        *(Column(f"± {setting.name}") for setting in SETTINGS),
        Column("converges"),
    )
    rows = tuple(_row(quantity, _reason(key)) for key, quantity in quantities.items())
    return Table(
        f"Numerical uncertainty, {title}",
        columns,
        rows,
        f"{_NOTE} {NOTICED_NOTE}" if "slip.noticed" in quantities else _NOTE,
    )


def series_table(runs: Mapping[str, Mapping[str, Convergence]]) -> Table:
    """List every number at every level, one row each, for other programs."""
    names = ("run", "quantity", "unit", "setting", "size", "value")
    rows = tuple(
        (run, key, quantity.unit, setting, size, value)
        for run, quantities in runs.items()
        for key, quantity in quantities.items()
        for setting, series in quantity.sources.items()
        for size, value in zip(series.sizes, series.values, strict=True)
    )
    return Table("Refinement", tuple(Column(name) for name in names), rows)


def _reason(key: str) -> Missing:
    """Return why a number may be missing: the times of events have dots in their keys, measures know their reading."""
    measure = measure_of(key)
    return Missing.NO_EVENT if "." in key or (measure and measure.reading) else Missing.NOT_DEFINED


def _row(convergence: Convergence, reason: Missing) -> tuple[Cell, ...]:
    if convergence.value is None:
        return (convergence.quantity, convergence.unit, *([reason] * (3 + len(SETTINGS))))
    refinements = convergence.refinements
    settings = [_setting(refinements.get(setting.name), reason) for setting in SETTINGS]
    unchanged = bool(refinements) and all(refinement.behaviour == "unchanged" for refinement in refinements.values())
    uncertainty = (
        _UNCHANGED if unchanged else reason if convergence.uncertainty is None else _number(convergence.uncertainty)
    )
    return (
        convergence.quantity,
        convergence.unit,
        _number(convergence.value),
        uncertainty,
        *settings,
        _verdict(convergence),
    )


def _verdict(convergence: Convergence) -> str:
    return f"not with {', '.join(convergence.unsettled_settings)}" if convergence.unsettled_settings else "yes"


def _setting(refinement: Refinement | None, reason: Missing) -> Cell:
    if refinement is None:
        return Missing.NOT_STUDIED
    if refinement.uncertainty is None:
        return reason
    if refinement.behaviour == "unchanged":
        return _UNCHANGED
    number = _number(refinement.uncertainty)
    if refinement.behaviour == "monotone" and refinement.order is not None:
        return f"{number} ({refinement.order:.1f})"
    word = _WORDS.get(refinement.behaviour) if refinement.order is not None or refinement.limit is None else None
    return f"{number} ({word})" if word else number


def _number(value: float) -> str:
    return f"{value:.4g}"
