"""The formats in which results can be written for other programs."""

from __future__ import annotations

import contextlib
import importlib.util
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import pandas as pd

from fingerslip.errors import InputError
from fingerslip.export.matlab import write_history_mat, write_tables_mat
from fingerslip.export.paraview import write_paraview
from fingerslip.export.tables import history_tables
from fingerslip.files import check_replaceable, frame_csv, json_text, new_folder, write_json, write_text, writing
from fingerslip.marker_tracks import marker_tracks
from fingerslip.version import __version__

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "FORMATS",
    "export_history",
    "export_tables",
    "marker_tracks",
]


_Tables = Mapping[str, pd.DataFrame]

# By this file a folder is known as an export, which another one may replace.
_MARK = "fingerslip-export.json"


def _write_csv(tables: _Tables, folder: Path) -> None:
    for name, frame in tables.items():
        write_text(folder / f"{name}.csv", frame_csv(frame))


def _write_parquet(tables: _Tables, folder: Path) -> None:
    if importlib.util.find_spec("pyarrow") is None:
        repair = 'install it: pip install "fingerslip[export]"'
        raise InputError("format", "is parquet, and pyarrow is not installed", "needs pyarrow", repair)
    for name, frame in tables.items():
        frame.to_parquet(folder / f"{name}.parquet", index=False)


def _write_json(tables: _Tables, folder: Path) -> None:
    for name, frame in tables.items():
        # What JSON has no number for is null.
        values = frame.astype(object).where(frame.notna(), None)
        columns = {str(column): values[column].tolist() for column in values.columns}
        write_text(folder / f"{name}.json", json_text({"units": frame.attrs["units"], "columns": columns}))


_OF_TABLES: Mapping[str, Callable[[_Tables, Path], None]] = MappingProxyType(
    {"csv": _write_csv, "json": _write_json, "mat": write_tables_mat, "parquet": _write_parquet}
)
# What is more than tables: all arrays with their dimensions, and the whole mesh.
_OF_HISTORIES: Mapping[str, Callable[[xr.Dataset, Path], None]] = MappingProxyType(
    {"mat": write_history_mat, "vtu": write_paraview}
)
#: The names of all formats.
FORMATS: tuple[str, ...] = tuple(sorted({*_OF_TABLES, *_OF_HISTORIES}))


def export_history(history: xr.Dataset, folder: str | Path, kind: str) -> Path:
    """Write a history for other programs, whole or not at all.

    Parameters
    ----------
    history : xarray.Dataset
        A history.
    folder : path
        The folder that is made; an export that is there is replaced.
    kind : {'csv', 'json', 'mat', 'parquet', 'vtu'}
        Tidy tables, one file each; all arrays in one MATLAB file; or snapshots for ParaView.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        For another format, and for one whose package is not installed; where the folder holds something else.
    ResultError
        Where the files cannot be written, and for ``vtu`` of a history without snapshots.
    """
    if kind not in _OF_HISTORIES:
        return export_tables(history_tables(history), folder, kind)
    with _export(Path(folder), kind) as partial:
        _OF_HISTORIES[kind](history, partial)
    return Path(folder)


def export_tables(tables: Mapping[str, pd.DataFrame], folder: str | Path, kind: str) -> Path:
    """Write tables for other programs, whole or not at all."""
    if kind not in _OF_TABLES:
        raise InputError("format", f"got '{kind}'", f"needs one of {', '.join(_OF_TABLES)}")
    with _export(Path(folder), kind) as partial:
        _OF_TABLES[kind](tables, partial)
    return Path(folder)


@contextlib.contextmanager
def _export(folder: Path, kind: str) -> Iterator[Path]:
    """Give a temporary folder that takes the place of an export, never of something else."""
    check_replaceable(folder, _MARK)
    with new_folder(folder) as partial, writing(folder):
        write_json(partial / _MARK, {"format": kind, "fingerslip": __version__})
        yield partial
