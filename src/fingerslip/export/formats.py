"""Results as tidy tables and MATLAB files."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from scipy.io import savemat

from fingerslip.afferents.model import CAVEAT, answering_models, beyond_records, spike_notes
from fingerslip.afferents.spikes import available_spikes, spike_places
from fingerslip.errors import InputError, optional_module
from fingerslip.export.paraview import write_paraview
from fingerslip.export.spikes import slip_times, write_history_nwb
from fingerslip.history import COORDINATES, VARIABLES
from fingerslip.results import FORMATS
from fingerslip.storage import files
from fingerslip.units import unit_suffix
from fingerslip.version import __version__


def result_tables(history: xr.Dataset) -> dict[str, pd.DataFrame]:
    """Return tables of the times of slip, and of the spikes and afferents whose stimulus a history resolves."""
    times = slip_times(history)
    tables = {"events": pd.DataFrame({"event": pd.Series(list(times), dtype=str), "time_s": list(times.values())})}
    if (spikes := available_spikes(history)) is not None:
        tables["spikes"] = spikes.to_dataframe().rename(columns={"time": "time_s"})
        # Silent ones, too: where each is, how often it fires, and what that is not.
        notes = {kind: spike_notes(spikes.kinds, {kind: hertz}, history)[-1] for kind, hertz in spikes.beyond.items()}
        places = zip(history["component"].values, spike_places(spikes, history).T, strict=True)
        tables["afferents"] = pd.DataFrame({
            "site": spikes.names,
            "kind": spikes.kinds,
            **{f"site_position_{axis}_m": values for axis, values in places},
            "spikes": [times.size for times in spikes.times],
            "note": ["; ".join(filter(None, (notes.get(kind), CAVEAT))) for kind in spikes.kinds],
        })  # fmt: skip
    for frame in tables.values():
        frame.attrs["units"] = {column: column[-1] for column in map(str, frame) if column.endswith(("_s", "_m"))}
    return tables


def write_history_mat(history: xr.Dataset, folder: Path) -> None:
    """Write a history as one structure ``history`` into ``history.mat``, whole or not at all; events and spikes beside.

    Its fields are the arrays under their names, ``attributes``, and the structures ``units``, ``dimensions`` and
    ``meaning`` with a field for each array. Dimensions keep their order: ``history.displacement(i, j, 1)`` is the first
    component of site j at time i. Names and kinds are cell arrays of text; numbers of nodes, counterfaces and regions
    count from one.
    """
    variables = {str(name): _counted_from_one(str(name), variable) for name, variable in history.variables.items()}
    fields: dict[str, Any] = {name: _array(variable.values) for name, variable in variables.items()}
    fields["units"] = {name: variable.attrs.get("units", "") for name, variable in variables.items()}
    fields["dimensions"] = {name: _texts(variable.dims) for name, variable in variables.items()}
    fields["meaning"] = {name: variable.attrs.get("long_name", "") for name, variable in variables.items()}
    plain = str | int | float | np.ndarray | np.generic
    fields["attributes"] = {
        _field(str(name)): value if isinstance(value, plain) else _texts(np.atleast_1d(value).tolist())
        for name, value in history.attrs.items()
    }
    _write_mat(folder / "history.mat", fields)
    for name, frame in result_tables(history).items():
        write_table_mat(frame, folder / f"{name}.mat")


def _counted_from_one(name: str, variable: xr.Variable) -> xr.Variable:
    """Return a variable as MATLAB counts: what the history counts from 0 from 1, as its meaning says."""
    meaning = _KNOWN[name].long_name if name in _KNOWN else ""
    if _FROM_ZERO not in meaning:
        return variable
    counted = (variable + 1).astype(variable.dtype)
    counted.attrs = {**variable.attrs, "long_name": meaning.replace(_FROM_ZERO, "counted from 1")}
    return counted


def write_table_mat(frame: pd.DataFrame, path: Path) -> None:
    """Write a table as a structure of the file's name with a field for each column, and ``units``.

    In MATLAB ``struct2table(rmfield(runs, 'units'))`` makes a table of it.
    """
    columns = {_field(str(column)): _array(frame[column].to_numpy()) for column in frame.columns}
    units = {_field(column): unit for column, unit in frame.attrs.get("units", {}).items()}
    _write_mat(path, {**columns, "units": units})


def _write_mat(path: Path, fields: dict[str, Any]) -> None:
    """Write a structure of the file's name."""
    stream = io.BytesIO()
    savemat(stream, {path.stem: fields}, long_field_names=True, do_compression=True, oned_as="column")
    files.write_bytes(path, stream.getvalue())


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


# What a row is for, by the leading dimensions of its variables: the table's name, and the coordinates that label it.
_TABLES: Mapping[tuple[str, ...], tuple[str, tuple[str, ...]]] = {
    ("time",): ("series", ()),
    ("time", "site"): ("sites", ("site", "site_kind", "site_region", "site_position")),
    ("time", "contact_node"): ("contact", ("contact_node", "contact_counterface", "contact_position", "contact_area")),
    ("time", "counterface"): ("counterfaces", ("counterface",)),
    ("time", "rigid_body"): ("rigid_bodies", ("rigid_body",)),
    ("time", "support"): ("supports", ("support",)),
}
_COMPONENTS, _UNITLESS = ("component", "stress_component", "rotation_axis"), ("", "1")
_KNOWN, _FROM_ZERO = {**COORDINATES, **VARIABLES}, "counted from 0"
# By this file a folder is known as an export, which another one may replace.
_MARK = "fingerslip-export.json"


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
    tables = {}
    for dims, (name, labels) in _TABLES.items():
        variables = [name for name, variable in VARIABLES.items() if name in history and variable.dims[:2] == dims]
        n_rows = 1 if len(dims) == 1 else history.sizes.get(dims[1], 1)
        if n_rows and variables:
            tables[name] = _table(history, n_rows, [label for label in labels if label in history.coords], variables)
    return tables


def _table(history: xr.Dataset, n_rows: int, labels: list[str], variables: list[str]) -> pd.DataFrame:
    times = history["time"].values
    columns: dict[str, Any] = {"time_s": np.repeat(times, n_rows)}
    units = {"time_s": "s"}
    for name in (*labels, *variables):
        variable, values = _KNOWN[name], history[name].values
        # What labels a row is the same at all times.
        values = np.broadcast_to(values, (times.size, *values.shape)) if name in labels else values
        suffix = f"_{unit_suffix(variable.units)}" if variable.units not in _UNITLESS else ""
        # A column for each component, or one.
        component = next((dim for dim in variable.dims if dim in _COMPONENTS), None)
        axes = [""] if component is None else [f"_{axis}" for axis in history[component].values]
        for axis, column in zip(axes, values.reshape(len(times) * n_rows, len(axes)).T, strict=True):
            columns[f"{name}{axis}{suffix}"], units[f"{name}{axis}{suffix}"] = column, variable.units
    frame = pd.DataFrame(columns)
    frame.attrs["units"] = {column: unit for column, unit in units.items() if unit not in _UNITLESS}
    return frame


def _write_parquet(frame: pd.DataFrame, path: Path) -> None:
    optional_module("pyarrow", "export", "format", "parquet needs it")
    frame.to_parquet(path, index=False)


def _write_json(frame: pd.DataFrame, path: Path) -> None:
    # What JSON has no number for is null.
    values = frame.astype(object).where(frame.notna(), None)
    columns = {str(column): values[column].tolist() for column in values.columns}
    files.write_text(path, files.json_text({"units": frame.attrs["units"], "columns": columns}))


#: What writes tables, by the names of their formats, which are the endings of the files.
TABULAR: Mapping[str, Callable[[pd.DataFrame, Path], None]] = {
    "csv": lambda frame, path: files.write_text(path, files.frame_csv(frame)),
    "json": _write_json,
    "mat": write_table_mat,
    "parquet": _write_parquet,
}
# What is more than tables: all arrays with their dimensions, the whole mesh, and spikes.
_OF_HISTORIES = {"mat": write_history_mat, "nwb": write_history_nwb, "vtu": write_paraview}


def export_history(history: xr.Dataset, folder: str | Path, kind: str, only: Collection[str] = ()) -> Path:
    """Write a history for other programs, whole or not at all.

    Parameters
    ----------
    history : xarray.Dataset
        A history.
    folder : path
        The folder that is made; an export that is there is replaced.
    kind : {'csv', 'json', 'mat', 'nwb', 'parquet', 'vtu'}
        Tidy tables, one file each; all arrays in one MATLAB file; spikes of human afferents for neurophysiology; or
        snapshots for ParaView.
    only : collection of str, optional
        Names of the tables that are written, such as ``spikes``; all without it.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        For another format or table, and a format whose package is not installed; where the folder holds something
        else.
    ResultError
        Where the files cannot be written, and for ``vtu`` of a history without snapshots.

    Examples
    --------
    >>> import tempfile
    >>> import skfem
    >>> import fingerslip as fs
    >>> gel = skfem.MeshQuad().with_defaults().with_subdomains({"gel": lambda x: x[0] > 0.0})
    >>> model = fs.Model(
    ...     mesh=gel,
    ...     materials={"gel": fs.material("gel-rtv27905")},
    ...     formulation="plane_stress",
    ...     supports={"bottom": ("x", "y")},
    ...     time=fs.QuasiStatic(step=0.1, end=0.2),
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     tables = fs.export_history(fs.simulate(model), f"{folder}/tables", "csv")
    ...     print(*sorted(file.name for file in tables.iterdir()))
    events.csv fingerslip-export.json series.csv supports.csv
    """
    if kind not in FORMATS:
        raise InputError("format", f"got '{kind}'", f"needs one of {', '.join(FORMATS)}")
    only = [only] if isinstance(only, str) else only
    if only or kind not in _OF_HISTORIES:
        tables = result_tables(history)
        if not only or {*only} - {*tables}:
            tables |= history_tables(history)
        if strangers := sorted({*only} - {*tables}):
            raise InputError("only", f"got '{strangers[0]}'", f"needs some of {', '.join(tables)}")
        return export_tables({name: tables[name] for name in only or tables}, folder, kind)
    with _export(Path(folder), kind) as partial:
        _OF_HISTORIES[kind](history, partial)
    return Path(folder)


def export_tables(tables: Mapping[str, pd.DataFrame], folder: str | Path, kind: str) -> Path:
    """Write tables for other programs, whole or not at all."""
    if kind not in TABULAR:
        repair = "name the folder of a run: these are tables" if kind in _OF_HISTORIES else ""
        raise InputError("format", f"got '{kind}'", f"needs one of {', '.join(TABULAR)}", repair)
    with _export(Path(folder), kind) as partial:
        for name, frame in tables.items():
            TABULAR[kind](frame, partial / f"{name}.{kind}")
    return Path(folder)


# Measured bytes of a value as text in CSV, and how many of them are written in a second.
_BYTES, _A_SECOND = 24.0, 4e5
_LARGE = 2e7  # bytes that are worth saying before
_SMALL = {"events", "spikes", "afferents"}  # tables without values over time


def export_notes(history: xr.Dataset, kind: str, only: Collection[str] = ()) -> tuple[str, ...]:
    """Return what to know before an export: how large a text file gets, and what the spikes are not."""
    notes = []
    values = sum(history[name].size for name in VARIABLES if name in history and history[name].dims[0] == "time")
    if kind == "csv" and not (only and {*only} <= _SMALL) and values * _BYTES > _LARGE:
        seconds = values / _A_SECOND
        size = f"about {values * _BYTES / 1e6:.0f} MB of text, about {seconds:.0f} s"
        notes.append(f"writing {size}; --format parquet is smaller and faster")
    if kind != "vtu" and (models := answering_models(history)):
        said = spike_notes(models, beyond_records(models, history), history)
        notes.append("spikes: " + "; ".join([*said, CAVEAT]))
    return tuple(notes)


@contextlib.contextmanager
def _export(folder: Path, kind: str) -> Iterator[Path]:
    """Give a temporary folder that takes the place of an export, never of something else."""
    files.check_replaceable(folder, _MARK)
    with files.new_folder(folder) as partial, files.writing(folder):
        files.write_json(partial / _MARK, {"format": kind, "fingerslip": __version__})
        yield partial
