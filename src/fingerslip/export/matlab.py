"""Results as MATLAB files, which Octave and SciPy read too."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.io import savemat

from fingerslip.files import write_bytes

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

__all__ = ["write_history_mat", "write_tables_mat"]


def write_history_mat(history: xr.Dataset, folder: Path) -> None:
    """Write a history as one structure ``history`` into ``history.mat``, whole or not at all.

    Its fields are the arrays under their names, ``attributes``, and the structures ``units``, ``dimensions`` and
    ``meaning`` with a field for each array. Dimensions keep their order: ``history.displacement(i, j, 1)`` is the first
    component of site j at time i. Names and kinds are cell arrays of text; indices of nodes and cells count from zero.
    """
    variables = {str(name): variable for name, variable in history.variables.items()}
    fields: dict[str, Any] = {name: _array(variable.values) for name, variable in variables.items()}
    fields["units"] = {name: variable.attrs.get("units", "") for name, variable in variables.items()}
    fields["dimensions"] = {name: _texts(variable.dims) for name, variable in variables.items()}
    fields["meaning"] = {name: variable.attrs.get("long_name", "") for name, variable in variables.items()}
    fields["attributes"] = _attributes(history.attrs)
    _write(folder / "history.mat", {"history": fields})


def write_tables_mat(tables: Mapping[str, pd.DataFrame], folder: Path) -> None:
    """Write each table as a structure with a field for each column, and ``units``, into a file of its name.

    In MATLAB ``struct2table(rmfield(runs, 'units'))`` makes a table of it.
    """
    for name, frame in tables.items():
        columns = {_field(str(column)): _array(frame[column].to_numpy()) for column in frame.columns}
        units = {_field(column): unit for column, unit in frame.attrs.get("units", {}).items()}
        _write(folder / f"{name}.mat", {name: {**columns, "units": units}})


def _write(path: Path, values: Mapping[str, Any]) -> None:
    stream = io.BytesIO()
    savemat(stream, dict(values), long_field_names=True, do_compression=True, oned_as="column")
    write_bytes(path, stream.getvalue())


def _field(name: str) -> str:
    """Return a name that MATLAB takes for a field."""
    return "".join(sign if sign.isalnum() else "_" for sign in name)


def _array(values: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    return _texts(values.ravel().tolist()) if values.dtype.kind in "OUS" else values


def _texts(values: Any) -> np.ndarray[Any, Any]:
    """Return texts as a cell array."""
    cells = np.empty((len(values), 1), dtype=object)
    cells[:, 0] = [str(value) for value in values]
    return cells


def _attributes(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """Return attributes as MATLAB can hold them."""
    return {_field(str(name)): _value(value) for name, value in attributes.items()}


def _value(value: Any) -> Any:
    is_plain = isinstance(value, str | int | float | np.ndarray | np.generic)
    return value if is_plain else _texts(np.atleast_1d(value).tolist())
