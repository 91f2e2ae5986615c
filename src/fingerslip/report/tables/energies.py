"""The table of energies: where the work went by the end, and how well the balance closes."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from fingerslip.report.tables.table import Cell, Column, Missing, Table

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["energies_table"]

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
