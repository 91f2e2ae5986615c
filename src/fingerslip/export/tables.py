"""A history as tidy tables: a column for each signal, a row for each moment and site, node, counterface or body."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from fingerslip.history import COORDINATES, VARIABLES
from fingerslip.units import unit_suffix

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["history_tables"]

# What a row is for, by the second dimension of its variables: the table's name, and the coordinates that label it.
_TABLES: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "": ("series", ()),
    "site": ("sites", ("site", "site_kind", "site_region", "site_position")),
    "contact_node": ("contact", ("contact_node", "contact_counterface", "contact_position", "contact_area")),
    "counterface": ("counterfaces", ("counterface",)),
    "rigid_body": ("rigid_bodies", ("rigid_body",)),
    "support": ("supports", ("support",)),
}
_COMPONENTS = ("component", "stress_component", "rotation_axis")
_UNITLESS = ("", "1")
_KNOWN = {**COORDINATES, **VARIABLES}


def history_tables(history: xr.Dataset) -> dict[str, pd.DataFrame]:
    """Return the records of a history as tables; snapshots of the whole mesh are in none of them.

    Parameters
    ----------
    history : xarray.Dataset
        A history.

    Returns
    -------
    dict of str to pandas.DataFrame
        ``series`` with a row for each record, and as far as there are any ``sites``, ``contact``, ``counterfaces``,
        ``rigid_bodies`` and ``supports`` with a row for each record and each of them. Columns have the component and
        the SI unit in their names, such as ``displacement_x_m``; ``attrs["units"]`` has the units.

    Examples
    --------
    The table of all sites as a file for R::

        fs.history_tables(history)["sites"].to_csv("sites.csv", index=False)
    """
    return dict(_tables(history))


def _tables(history: xr.Dataset) -> Iterator[tuple[str, pd.DataFrame]]:
    for dimension, (name, labels) in _TABLES.items():
        variables = [
            variable for variable in VARIABLES if variable in history and _row_dimension(variable) == dimension
        ]
        if history.sizes.get(dimension, 1) and variables:
            yield name, _table(history, dimension, labels, variables)


def _row_dimension(name: str) -> str | None:
    """Return the dimension beside time that makes rows of a variable; None for what is not over time."""
    dims = VARIABLES[name].dims
    if dims[:1] != ("time",):
        return None
    return dims[1] if len(dims) > 1 else ""


def _table(history: xr.Dataset, dimension: str, labels: tuple[str, ...], variables: list[str]) -> pd.DataFrame:
    n_rows = history.sizes.get(dimension, 1)
    times = history["time"].values
    columns: dict[str, Any] = {"time_s": np.repeat(times, n_rows)}
    units = {"time_s": "s"}
    for name in (*(label for label in labels if label in history.coords), *variables):
        result = _columns(history, name)
        # What labels a row is the same at all times.
        columns |= (
            {entry: np.tile(values, times.size) for entry, values in result.items()} if name in labels else result
        )
        units |= dict.fromkeys(result, _KNOWN[name].units)
    frame = pd.DataFrame(columns)
    frame.attrs["units"] = {column: unit for column, unit in units.items() if unit not in _UNITLESS}
    return frame


def _columns(history: xr.Dataset, name: str) -> dict[str, Any]:
    """Return the columns of a variable: one for each component, or one."""
    variable, values = _KNOWN[name], history[name].values
    suffix = f"_{unit_suffix(variable.units)}" if variable.units not in _UNITLESS else ""
    component = next((dim for dim in variable.dims if dim in _COMPONENTS), None)
    if component is None:
        return {f"{name}{suffix}": values.ravel()}
    return {
        f"{name}_{value}{suffix}": values[..., number].ravel() for number, value in enumerate(history[component].values)
    }
