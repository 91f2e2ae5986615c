"""The table of models as they were computed: sizes, stiffness of the contact, solver."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from fingerslip.report.tables.table import Cell, Column, Missing, Table

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["models_table"]

_ATTRIBUTES: Mapping[str, str] = MappingProxyType(
    {
        "element": "element",
        "n_nodes": "nodes",
        "n_degrees_of_freedom": "unknowns",
        "n_contact_candidates": "contact candidates",
        "normal_penalty": "mean normal penalty [Pa/m]",
        "tangential_penalty": "mean tangential penalty [Pa/m]",
        "linear_solver": "linear solver",
        "condensation": "contact response by",
        "basis": "basis",
        "basis_static_responses": "static responses of the basis",
        "basis_vibrations": "vibrations of the basis",
        "basis_error": "estimated error of displacement by the basis",
        "basis_acceleration_error": "estimated error of acceleration by the basis",
    }
)


def models_table(histories: Mapping[str, xr.Dataset]) -> Table:
    """Show how runs were computed, as their histories say: a row for each property, a column for each run."""
    columns = (Column("property"), *(Column(title, significant=3) for title in histories))
    rows = tuple(
        (words, *(_cell(history, name) for history in histories.values()))
        for name, words in _ATTRIBUTES.items()
        if any(name in history.attrs for history in histories.values())
    )
    return Table("Models as computed", columns, rows)


def _cell(history: xr.Dataset, name: str) -> Cell:
    value = history.attrs.get(name)
    if value is None:
        return Missing.NOT_RECORDED
    return value if isinstance(value, str | int | float) else value.item()
