"""Marker tracks: where each marker was at each time, as one labelled dataset for simulations, cameras and trackers.

The variables, their dimensions and their units are in :data:`VARIABLES`. Positions are in pixels of an image (``px``; x
to the right and y down, the centre of the first pixel at 0, 0) or in metres. A marker that was not seen has the
position NaN and the quality 0, never a stale position.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingerslip.arrays import Flags
from fingerslip.errors import InputError, ResultError, shorten
from fingerslip.libraries import pd, xr
from fingerslip.storage.files import check_decimals, frame_csv, write_bytes, write_text
from fingerslip.storage.netcdf import netcdf_bytes, read_netcdf
from fingerslip.units import parse_quantity

AXES = ("x", "y", "z")
UNITS = ("px", "m")
KINDS = ("internal", "external")

#: Dimensions, unit and meaning of everything in a dataset of tracks. The unit of the position is ``px`` or ``m``.
VARIABLES: Mapping[str, tuple[tuple[str, ...], str, str]] = {
    "position": (("time", "marker", "axis"), "px", "position of the markers, NaN where not seen"),
    "quality": (("time", "marker"), "1", "quality of the position from 0 (not seen) to 1"),
    "time": (("time",), "s", "time"),
    "marker": (("marker",), "", "number of the marker"),
    "axis": (("axis",), "", "axis of the position"),
    "kind": (("marker",), "", "internal or external marker"),
    "ring": (("marker",), "", "ring of the marker in its layout, 0 in the centre"),
    "angle": (("marker",), "rad", "angle of the marker in its layout"),
}

#: Attributes that have a fixed meaning; all of them are optional, and others may stand beside them.
ATTRIBUTES: Mapping[str, str] = {
    "image_width": "width of the image [px]",
    "image_height": "height of the image [px]",
    "frame_rate": "frames a second [1/s]",
    "metres_per_pixel_x": "length along x of a pixel in the plane of the markers [m]",
    "metres_per_pixel_y": "length along y of a pixel in the plane of the markers [m]",
    "source": "what the tracks come from: a simulation, a camera model or a video file",
}
# Types that variables need, and the letters of their kinds.
_TYPES = {
    **dict.fromkeys(("position", "quality", "time", "angle"), ("float64", "f")),
    **dict.fromkeys(("marker", "ring"), ("whole numbers", "iu")),
}
# In pixels or metres; of larger numbers the squares of squares overflow.
_FARTHEST = 1e9
_NEEDED = {
    "position": "needs finite numbers along all axes, up to 1e9, or NaN along all where it was not seen",
    "quality": "needs a number from 0 to 1, and 0 where the position is NaN",
}


def make_tracks(
    position: ArrayLike,
    time: ArrayLike,
    *,
    units: str,
    quality: ArrayLike | None = None,
    kind: str | Sequence[str] = "internal",
    marker: ArrayLike | None = None,
    ring: ArrayLike | None = None,
    angle: ArrayLike | None = None,
    attributes: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Return arrays as tracks, of which every variable carries `units` and `long_name`.

    Parameters
    ----------
    position : (n_times, n_markers, 2 or 3) array_like
        Positions, NaN where a marker was not seen.
    time : (n_times,) array_like
        Times [s], rising.
    units : {'px', 'm'}
        Unit of the positions.
    quality : (n_times, n_markers) array_like, optional
        From 0 (not seen) to 1. Without it, 1 where a marker was seen.
    kind : str or sequence of str, optional
        ``internal`` or ``external``, for all markers or for each.
    marker : (n_markers,) array_like of int, optional
        Numbers of the markers, each once; 0, 1, 2, ... without it.
    ring, angle : (n_markers,) array_like, optional
        Ring number and angle [rad] of each marker in its layout.
    attributes : mapping, optional
        :data:`ATTRIBUTES` and provenance, plain text and numbers. Those that are None are left out.

    Raises
    ------
    InputError
        Where the arrays do not fit together or hold what tracks cannot.

    Examples
    --------
    >>> import fingerslip as fs
    >>> tracks = fs.make_tracks([[[1.0, 2.0]], [[1.5, 2.0]]], [0.0, 0.1], units="px")
    >>> tracks.sizes["marker"], float(tracks["quality"].min())
    (1, 1.0)
    """
    places = np.array(position, dtype=np.float64)
    if places.ndim != 3 or places.shape[2] not in (2, 3):
        raise InputError("tracks: position", f"got shape {places.shape}", "needs (n_times, n_markers, 2 or 3)")
    sizes = dict(zip(VARIABLES["position"][0], places.shape, strict=True))
    visible = np.isfinite(places).all(axis=2)
    values: dict[str, NDArray[Any] | None] = {
        "position": places,
        "quality": np.array(visible if quality is None else quality, dtype=np.float64),
        "time": np.array(time, dtype=np.float64),
        "marker": np.arange(sizes["marker"]) if marker is None else np.array(marker),
        "axis": np.array(AXES[: sizes["axis"]]),
        "kind": np.full(sizes["marker"], kind) if isinstance(kind, str) else np.array(kind, dtype=str),
        "ring": None if ring is None else np.array(ring),
        "angle": None if angle is None else np.array(angle, dtype=np.float64),
    }
    variables = {}
    for name, array in values.items():
        if array is None:
            continue
        dims, unit, meaning = VARIABLES[name]
        needed = tuple(sizes[dim] for dim in dims)
        if array.shape != needed:
            raise InputError(f"tracks: {name}", f"got shape {array.shape}", f"needs {needed}, as the positions have")
        labels = {"units": units if name == "position" else unit, "long_name": meaning}
        variables[name] = xr.Variable(dims, array, labels)
    leading = {name: variables.pop(name) for name in ("position", "quality")}
    stated = {name: value for name, value in (attributes or {}).items() if value is not None}
    return check_tracks(xr.Dataset(leading, coords=variables, attrs=stated))


def tracks_like(tracks: xr.Dataset, position: ArrayLike, time: ArrayLike, **more: Any) -> xr.Dataset:
    """Return tracks of the same markers, with their kinds, rings and angles, at other positions [px] and times."""
    labels = {name: tracks[name].values for name in ("marker", "ring", "angle") if name in tracks.coords}
    return make_tracks(position, time, units="px", kind=list(tracks["kind"].values), **{**labels, **more})


def check_tracks(tracks: xr.Dataset, where: str = "tracks") -> xr.Dataset:
    """Return tracks that are as all users of them take them to be."""
    _check_variables(tracks, where)
    axes = tuple(map(str, tracks["axis"].values))
    if axes not in (AXES[:2], AXES):
        raise InputError(f"{where}: axis", f"got {axes}", "needs ('x', 'y') or ('x', 'y', 'z')")
    if tracks["position"].attrs["units"] == "px" and len(axes) > 2:
        raise InputError(f"{where}: axis", f"got {axes}", "positions in px have the axes x and y")
    strange = sorted(set(map(str, tracks["kind"].values)) - set(KINDS))
    if strange:
        raise InputError(f"{where}: kind", f"got {shorten(repr(strange[0]))}", f"needs one of {', '.join(KINDS)}")
    numbers, counts = np.unique(tracks["marker"].values, return_counts=True)
    if (counts > 1).any():
        raise InputError(f"{where}: marker", f"{numbers[counts > 1][0]} stands twice", "needs each number once")
    _check_values(tracks, where)
    for name, meaning in ATTRIBUTES.items():
        value = tracks.attrs.get(name)
        number = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
        if name != "source" and value is not None and not (number and np.isfinite(value) and value > 0):
            raise InputError(f"{where}: {name}", f"got {shorten(repr(value))}", f"needs a number > 0: {meaning}")
    return tracks


def _check_variables(tracks: xr.Dataset, where: str) -> None:
    """Check names, dimensions, types and units; numbers without a unit, but for positions, count as in those needed."""
    for name in ("position", "quality", "time", "marker", "axis", "kind"):
        if name not in tracks.variables:
            raise InputError(where, f"has no {name!r}", f"tracks need {', '.join(VARIABLES)}", "see make_tracks")
    for name, (dims, unit, _) in VARIABLES.items():
        if name not in tracks.variables:
            continue
        variable, location = tracks[name], f"{where}: {name}"
        if variable.dims != dims:
            raise InputError(location, f"has the dimensions {variable.dims}", f"needs {dims}", "transpose it")
        needed, kinds = _TYPES.get(name, ("", variable.dtype.kind))
        if variable.dtype.kind not in kinds or (kinds == "f" and variable.dtype != np.float64):
            raise InputError(location, f"has the type {variable.dtype}", f"needs {needed}")
        stated = variable.attrs.get("units")
        if stated not in (UNITS if name == "position" else (unit, None)):
            allowed = f"one of {', '.join(UNITS)}" if name == "position" else unit or "none"
            raise InputError(
                location, f"has the unit {shorten(repr(stated))}", f"needs {allowed}", "convert it, with its unit"
            )


def _check_values(tracks: xr.Dataset, where: str) -> None:
    times, position, quality = (tracks[name].values for name in ("time", "position", "quality"))
    if not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        later = np.flatnonzero(~(np.diff(times) > 0))
        fault = f"does not rise after {times[later[0]]:.6g} s" if later.size else "is not finite"
        raise InputError(f"{where}: time", fault, "needs finite times, each later than the one before")
    unknown = np.isnan(position)
    odd = (np.abs(position) > _FARTHEST).any(axis=2) | unknown.any(axis=2) & ~unknown.all(axis=2)
    # NaN is outside too.
    outside = ~((quality >= 0) & (quality <= 1)) | unknown.any(axis=2) & (quality > 0)
    for name, wrong in (("position", odd), ("quality", outside)):
        if wrong.any():
            row, column = (int(index) for index in np.argwhere(wrong)[0])
            marker = f"marker {tracks['marker'].values[column]} at {times[row]:.6g} s"
            raise InputError(f"{where}: {name}", f"{marker} has {tracks[name].values[row, column]}", _NEEDED[name])


def check_size(position: NDArray[np.floating], where: str) -> None:
    """Raise InputError where positions are so large that squares of their squares overflow."""
    if (np.abs(position) > _FARTHEST).any():
        raise InputError(where, f"has a marker at {np.nanmax(np.abs(position)):.3g}", f"needs at most {_FARTHEST:g}")


def seen(tracks: xr.Dataset) -> Flags:
    """Tell which markers were seen when, shape (n_times, n_markers)."""
    return np.asarray(~np.isnan(tracks["position"].values).any(axis=2))


def tracks_in_metres(tracks: xr.Dataset, metres_per_pixel: tuple[float, float] | None = None) -> xr.Dataset:
    """Return tracks in metres, by the lengths of a pixel [m] given or of the attributes; those in metres unchanged."""
    if tracks["position"].attrs["units"] == "m":
        return tracks
    names = ("metres_per_pixel_x", "metres_per_pixel_y")
    scale = metres_per_pixel or tuple(tracks.attrs.get(name, np.nan) for name in names)
    if not (np.isfinite(scale).all() and min(scale) > 0):
        raise InputError(
            "metres_per_pixel", f"got {tuple(map(float, scale))}", "needs two lengths > 0 in metres", "film a ruler"
        )
    converted = tracks.copy()
    converted["position"] = tracks["position"].copy(data=tracks["position"].values * np.asarray(scale))
    converted["position"].attrs["units"] = "m"
    return converted


def write_tracks(tracks: xr.Dataset, path: str | Path) -> None:
    """Write tracks as netCDF-4, whole or not at all.

    Parameters
    ----------
    tracks : xarray.Dataset
        The tracks; they are checked first. See :func:`read_tracks`.
    path : path
        The file; a file that is there is replaced only when the new one is whole.

    Raises
    ------
    InputError, ResultError
        Where the dataset is no tracks; where the file cannot be written.
    """
    # Built in memory first: on a full disk the HDF5 library ends the process, writing bytes only fails.
    write_bytes(Path(path), netcdf_bytes(check_tracks(tracks), ("position", "quality")))


def read_tracks(path: str | Path) -> xr.Dataset:
    """Return the tracks of a file, with arrays in memory.

    Positions in another unit of length, times and angles in other units than s and rad are converted.

    Parameters
    ----------
    path : path
        A file that :func:`write_tracks` wrote, or another with the variables of :data:`VARIABLES`.

    Raises
    ------
    ResultError, InputError
        Where the file is missing or damaged; where it holds something else than tracks.

    Examples
    --------
    >>> import tempfile
    >>> import fingerslip as fs
    >>> tracks = fs.make_tracks([[[1.0, 2.0]], [[1.5, 2.0]]], [0.0, 0.1], units="px")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     fs.write_tracks(tracks, f"{folder}/tracks.nc")
    ...     same = fs.read_tracks(f"{folder}/tracks.nc")
    >>> same["position"].sel(marker=0, axis="x").values.tolist()
    [1.0, 1.5]
    """
    if not Path(path).is_file():
        raise ResultError(f"{path}: is not there; needs a file of tracks")
    tracks = read_netcdf(path, "tracks", "make the tracks again")
    texts = {name: tracks[name].astype(str) for name in ("axis", "kind") if name in tracks.variables}
    tracks = tracks.assign_coords(texts)
    for name, si in (("position", "m"), ("time", "s"), ("angle", "rad")):
        unit = tracks[name].attrs.get("units") if name in tracks.variables else None
        if unit not in (None, si, "px"):
            factor = parse_quantity(f"1 {unit}", si, where=f"{path}: unit of {name}")
            converted = tracks[name].variable.copy(data=factor * tracks[name].values.astype(np.float64))
            converted.attrs["units"] = si
            tracks = tracks.assign({name: converted})
    return check_tracks(tracks, str(path))


_OPTIONAL = {"ring": "ring", "angle": "angle_rad"}


def tracks_table(tracks: xr.Dataset) -> pd.DataFrame:
    """Return tracks as a table, sorted by time and then as the markers are."""
    check_tracks(tracks)
    times, count = tracks.sizes["time"], tracks.sizes["marker"]
    unit, position = tracks["position"].attrs["units"], tracks["position"].values
    labels = [name for name in ("kind", *_OPTIONAL, "still") if name in tracks.variables]
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
    grid = table.set_index(["time_s", "marker"]).to_xarray()
    first = table.drop_duplicates("marker").set_index("marker").loc[grid["marker"].values]
    return make_tracks(
        np.stack([grid[name].values for name in places], axis=2),
        grid["time_s"].values,
        units=unit,
        quality=grid["quality"].fillna(0.0).values if "quality" in grid else None,
        kind=[str(kind) for kind in first["kind"]] if "kind" in first else "internal",
        marker=grid["marker"].values,
        ring=first["ring"].to_numpy() if "ring" in first else None,
        angle=first["angle_rad"].to_numpy() if "angle_rad" in first else None,
    )


def _numeric(table: pd.DataFrame, names: Iterable[str], where: str) -> pd.DataFrame:
    """Return a table with numbers in some of its columns; only time and marker may not be empty."""
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
    See :func:`read_tracks_csv`.

    Parameters
    ----------
    tracks : xarray.Dataset
        The tracks.
    path : path
        The file; a file that is there is replaced only when the new one is whole.

    Raises
    ------
    InputError, ResultError
        Where the dataset is no tracks; where the file cannot be written.
    """
    write_text(Path(path), frame_csv(tracks_table(tracks)))


def read_tracks_csv(path: str | Path) -> xr.Dataset:
    """Return the tracks of a CSV file with the columns of :func:`tracks_table`, without attributes.

    Parameters
    ----------
    path : path
        The file.

    Raises
    ------
    ResultError, InputError
        Where the file cannot be read; where it is no table of tracks.

    Examples
    --------
    >>> import tempfile
    >>> import pandas as pd
    >>> import fingerslip as fs
    >>> tracks = fs.make_tracks([[[1.0, 2.0]], [[1.5, 2.0]]], [0.0, 0.1], units="px")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     fs.write_tracks_csv(tracks, f"{folder}/tracks.csv")
    ...     print(*pd.read_csv(f"{folder}/tracks.csv"))
    ...     same = fs.read_tracks_csv(f"{folder}/tracks.csv")
    time_s marker x_px y_px quality kind
    >>> same["position"].sel(marker=0, axis="x").values.tolist()
    [1.0, 1.5]
    """
    return tracks_from_table(read_csv(Path(path)), str(path))


def read_csv(path: Path) -> pd.DataFrame:
    """Read a CSV file with a line of names."""
    check_decimals(path)
    try:
        return pd.read_csv(path)
    except OSError as error:
        raise ResultError(f"{path}: cannot be read ({error.strerror}); name a file that can be") from error
    except ValueError as error:
        raise InputError(str(path), f"is no table ({shorten(str(error))})", "needs CSV with a line of names") from error
