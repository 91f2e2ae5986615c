"""Pin tables: a row for each frame and the columns ``pin_0_x``, ``pin_0_y``, ``pin_1_x``, ... in pixels."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fingerslip.errors import InputError
from fingerslip.vision.tracking.formats.tables import read_table, write_table
from fingerslip.vision.tracks import check_tracks, make_tracks

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["read_pins", "write_pins"]

_PIN = re.compile(r"pin_(\d+)_([xy])")
_TIME = "time"


def write_pins(tracks: xr.Dataset, path: str | Path) -> None:
    """Write tracks as a table of pins, with the column ``time`` [s] before them; what was not seen is an empty cell.

    Raises
    ------
    InputError
        Where the dataset is no tracks, or they are not in pixels.
    ResultError
        Where the file cannot be written.
    """
    import pandas as pd

    check_tracks(tracks)
    if tracks["position"].attrs["units"] != "px":
        raise InputError("tracks: position", "is in metres", "tables of pins are in pixels", "write tracks_csv")
    columns = {_TIME: tracks["time"].values}
    for column, number in enumerate(tracks["marker"].values):
        for axis, name in enumerate("xy"):
            columns[f"pin_{number}_{name}"] = tracks["position"].values[:, column, axis]
    write_table(pd.DataFrame(columns), Path(path))


def read_pins(path: str | Path, frame_rate: float | None = None) -> xr.Dataset:
    """Read a table of pins as tracks.

    Parameters
    ----------
    path : path
        A CSV file with ``pin_0_x``, ``pin_0_y``, ...; other columns but ``time`` [s] are left alone.
    frame_rate : float, optional
        Rows a second [1/s], where there is no column ``time``.

    Raises
    ------
    InputError
        Where there are no pins, one lacks x or y, or nothing says the time.
    """
    table = read_table(Path(path))
    found = [match for match in map(_PIN.fullmatch, map(str, table.columns)) if match]
    numbers = sorted({int(match[1]) for match in found})
    if not numbers:
        raise InputError(str(path), "has no pins", "needs the columns pin_0_x, pin_0_y, ...")
    lacking = [f"pin_{n}_{axis}" for n in numbers for axis in "xy" if f"pin_{n}_{axis}" not in table.columns]
    if lacking:
        raise InputError(str(path), f"has no column {lacking[0]}", "needs x and y of each pin")
    position = np.stack([table[[f"pin_{n}_x", f"pin_{n}_y"]].to_numpy(dtype=np.float64) for n in numbers], axis=1)
    # A pin of which one coordinate is missing was not seen.
    position[np.isnan(position).any(axis=2)] = np.nan
    if _TIME not in table.columns and frame_rate is None:
        raise InputError(str(path), "has no column time", "tracks need the time of each row", "give frame_rate")
    time = table[_TIME].to_numpy(np.float64) if frame_rate is None else np.arange(len(table)) / frame_rate
    return make_tracks(position, time, units="px", marker=numbers, attributes={"source": str(path)})
