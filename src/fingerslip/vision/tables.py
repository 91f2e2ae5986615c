"""Tracks as tidy tables: a row for each marker at each time, for CSV files and data frames."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fingerslip.errors import InputError, ResultError, shorten
from fingerslip.storage.files import frame_csv, write_text
from fingerslip.vision.tracks import AXES, UNITS, check_tracks, make_tracks

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

__all__ = ["read_csv", "read_tracks_csv", "tracks_from_table", "tracks_table", "write_tracks_csv"]

_OPTIONAL = {"ring": "ring", "angle": "angle_rad"}


def tracks_table(tracks: xr.Dataset) -> pd.DataFrame:
    """Return tracks as a table, sorted by time and then as the markers are."""
    import pandas as pd

    check_tracks(tracks)
    times, count = tracks.sizes["time"], tracks.sizes["marker"]
    unit, position = tracks["position"].attrs["units"], tracks["position"].values
    labels = [name for name in ("kind", *_OPTIONAL) if name in tracks.coords]
    return pd.DataFrame(
        {
            "time_s": np.repeat(tracks["time"].values, count),
            "marker": np.tile(tracks["marker"].values, times),
            **{f"{axis}_{unit}": position[:, :, number].ravel() for number, axis in enumerate(tracks["axis"].values)},
            "quality": tracks["quality"].values.ravel(),
            **{_OPTIONAL.get(name, name): np.tile(tracks[name].values, times) for name in labels},
        }
    )


def tracks_from_table(table: pd.DataFrame, where: str = "table") -> xr.Dataset:
    """Return the tracks of a table as :func:`tracks_table` makes it."""
    unit = next((unit for unit in UNITS if f"x_{unit}" in table.columns), None)
    if unit is None or not {"time_s", "marker", f"y_{unit}"} <= set(table.columns):
        fault = f"has the columns {', '.join(map(str, table.columns))}"
        raise InputError(where, shorten(fault), "needs time_s, marker, and x_px and y_px or x_m and y_m")
    places = [f"{axis}_{unit}" for axis in AXES if f"{axis}_{unit}" in table.columns]
    table = _numeric(table, ("time_s", "marker", *places, "quality", *_OPTIONAL.values()), where)
    twice = table.duplicated(["time_s", "marker"])
    if twice.any():
        row = table[twice].iloc[0]
        raise InputError(where, f"marker {row['marker']} has two rows at {row['time_s']} s", "needs one")
    grids = {
        name: table.pivot_table(index="time_s", columns="marker", values=name, dropna=False, sort=True)
        for name in [*places, *(["quality"] if "quality" in table.columns else [])]
    }
    position = np.stack([grids[name].to_numpy(dtype=np.float64) for name in places], axis=2)
    times, markers = grids[places[0]].index.to_numpy(), grids[places[0]].columns.to_numpy()
    first = table.drop_duplicates("marker").set_index("marker").loc[markers]
    return make_tracks(
        position,
        times,
        units=unit,
        quality=grids["quality"].fillna(0.0).to_numpy() if "quality" in grids else None,
        kind=[str(kind) for kind in first["kind"]] if "kind" in first.columns else "internal",
        marker=markers,
        ring=first["ring"].to_numpy() if "ring" in first.columns else None,
        angle=first["angle_rad"].to_numpy() if "angle_rad" in first.columns else None,
    )


def _numeric(table: pd.DataFrame, names: Iterable[str], where: str) -> pd.DataFrame:
    """Return a table with numbers in some of its columns; only time and marker may not be empty."""
    import pandas as pd

    columns = {name: pd.to_numeric(table[name], errors="coerce") for name in names if name in table.columns}
    for name, numbers in columns.items():
        wrong = numbers.isna() & (table[name].notna() | (name in ("time_s", "marker")))
        if wrong.any():
            row = int(np.flatnonzero(wrong)[0])
            cell = "nothing" if pd.isna(table[name].iloc[row]) else shorten(repr(str(table[name].iloc[row])))
            raise InputError(f"{where}: {name}", f"row {row + 1} has {cell}", "needs a number", "correct that cell")
    return table.assign(**columns)


def write_tracks_csv(tracks: xr.Dataset, path: str | Path) -> None:
    """Write tracks as a CSV file with the columns of :func:`tracks_table`, whole or not at all.

    A position that was not seen is an empty cell. Attributes are not written: netCDF keeps them.

    Parameters
    ----------
    tracks : xarray.Dataset
        The tracks.
    path : path
        The file; a file that is there is replaced only when the new one is whole.

    Raises
    ------
    InputError
        Where the dataset is no tracks.
    ResultError
        Where the file cannot be written.
    """
    write_text(Path(path), frame_csv(tracks_table(tracks)))


def read_tracks_csv(path: str | Path) -> xr.Dataset:
    """Read tracks from a CSV file with the columns of :func:`tracks_table`.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    xarray.Dataset
        The tracks, without attributes.

    Raises
    ------
    ResultError
        Where the file cannot be read.
    InputError
        Where it is no table of tracks.
    """
    return tracks_from_table(read_csv(Path(path)), str(path))


def read_csv(path: Path) -> pd.DataFrame:
    """Read a CSV file with a line of names."""
    import pandas as pd

    try:
        return pd.read_csv(path)
    except OSError as error:
        raise ResultError(f"{path}: cannot be read ({error.strerror}); name a file that can be") from error
    except ValueError as error:
        raise InputError(str(path), f"is no table ({shorten(str(error))})", "needs CSV with a line of names") from error
