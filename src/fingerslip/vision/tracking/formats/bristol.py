"""Data sets as the tactile laboratory in Bristol keeps them.

A folder has ``targets.csv`` with a row for each image (``sensor_image``, and labels such as ``pose_*`` and
``shear_*``), ``sensor_images/`` with the images, ``sensor_image_params.json`` with the settings of the camera, and
``processed_markers/markers_N.npy`` with the markers of ``image_N``: x and y in shares of the width and height.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError, shortened
from fingerslip.files import check_empty, json_text, new_folder, write_bytes, write_text
from fingerslip.vision.tracking.formats.tables import read_table, write_table
from fingerslip.vision.tracks import check_tracks, make_tracks

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

__all__ = ["BristolSet", "bristol_tracks", "read_bristol", "write_bristol"]

_TARGETS, _PARAMETERS, _MARKERS = "targets.csv", "sensor_image_params.json", "processed_markers"
_IMAGE = "sensor_image"


@dataclass(frozen=True)
class BristolSet:
    """A data set."""

    folder: Path  # where it is
    targets: pd.DataFrame  # A row for each image: ``sensor_image`` and labels
    image_parameters: Mapping[str, Any]  # settings of the camera
    markers: tuple[NDArray[np.float64], ...]  # (n, 2), markers of each image in shares of its width and height


def read_bristol(folder: str | Path) -> BristolSet:
    """Read a data set of this form.

    Raises
    ------
    InputError
        Where ``targets.csv`` is missing or names no images, or a file is not of its form.
    """
    folder = Path(folder)
    targets = read_table(folder / _TARGETS)
    if _IMAGE not in targets.columns:
        raise InputError(str(folder / _TARGETS), f"has no column {_IMAGE}", "needs the name of the image in each row")
    processed = (folder / _MARKERS).is_dir()
    names = [_markers_name(str(name)) for name in targets[_IMAGE]] if processed else []
    return BristolSet(folder, targets, _parameters(folder / _PARAMETERS), tuple(_markers(folder, n) for n in names))


def _markers_name(image: str) -> str:
    numbers = re.findall(r"\d+", Path(image).stem)
    if not numbers:
        raise InputError(_TARGETS, f"the image {shortened(image)!r} has no number", "needs names such as image_1.png")
    return f"markers_{numbers[-1]}.npy"


def _parameters(path: Path) -> Mapping[str, Any]:
    if not path.is_file():
        return {}
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(str(path), f"is no JSON ({shortened(str(error))})", "needs settings of a camera") from None
    if not isinstance(values, dict):
        raise InputError(str(path), f"holds {shortened(repr(values))}", "needs names and values in {}")
    return values


def _markers(folder: Path, name: str) -> NDArray[np.float64]:
    path = folder / _MARKERS / name
    if not path.is_file():
        raise InputError(str(path), "there is no such file", "needs the markers of every image")
    try:
        found = np.load(path, allow_pickle=False)
    except (ValueError, EOFError) as error:
        raise InputError(str(path), f"is no array ({shortened(str(error))})", "needs x and y of markers") from None
    if found.ndim != 2 or found.shape[1] != 2 or found.dtype.kind not in "fiu":
        raise InputError(str(path), f"has shape {found.shape} of {found.dtype}", "needs numbers of shape (n, 2)")
    markers: NDArray[np.float64] = found.astype(np.float64)
    return markers


def bristol_tracks(data: BristolSet, size: tuple[int, int], frame_rate: float) -> xr.Dataset:
    """Return the markers of a data set as tracks, its rows in order of time.

    Parameters
    ----------
    data : BristolSet
        The data set. Its markers must be in the same order in every image, which those that were sorted by x are not.
    size : (int, int)
        Width and height of the images [px].
    frame_rate : float
        Rows a second [1/s].

    Raises
    ------
    InputError
        Where there are no markers, or their number changes.
    """
    counts = sorted({len(markers) for markers in data.markers})
    if len(counts) != 1:
        found = f"has {' or '.join(map(str, counts))} markers in an image" if counts else "has no processed markers"
        raise InputError(str(data.folder), found, "tracks need the same ones in all", "track its images")
    position = np.stack(data.markers) * np.array(size, dtype=np.float64)
    attributes = {
        "source": str(data.folder),
        "image_width": size[0],
        "image_height": size[1],
        "frame_rate": frame_rate,
    }
    return make_tracks(position, np.arange(len(position)) / frame_rate, units="px", attributes=attributes)


def write_bristol(
    tracks: xr.Dataset,
    folder: str | Path,
    *,
    labels: Mapping[str, Sequence[Any]] | None = None,
    image_parameters: Mapping[str, Any] | None = None,
) -> None:
    """Write tracks as a data set of this form, whole or not at all: the markers of frame N as ``markers_N.npy``.

    Parameters
    ----------
    tracks : xarray.Dataset
        Tracks in pixels with the attributes ``image_width`` and ``image_height``. Markers that were not seen are NaN.
    folder : path
        The folder, new or empty.
    labels : mapping of str to sequence, optional
        Columns of ``targets.csv`` with a value for each frame, such as ``pose_1`` or ``shear_1``.
    image_parameters : mapping, optional
        Settings of the camera, added to the size of the image and the frame rate.

    Raises
    ------
    InputError
        Where the dataset is no tracks in pixels, or does not say the size of the image; where the folder holds files.
    ResultError
        Where the folder cannot be written.
    """
    import pandas as pd

    check_tracks(tracks)
    check_empty(Path(folder))
    width, height = (tracks.attrs.get(f"image_{name}") for name in ("width", "height"))
    if tracks["position"].attrs["units"] != "px" or width is None or height is None:
        found = f"is in {tracks['position'].attrs['units']}, in an image of {width} x {height} px"
        raise InputError("tracks: position", found, "needs pixels and the attributes image_width and image_height")
    shares = tracks["position"].values / (float(width), float(height))
    names = [f"image_{number}.png" for number in range(len(shares))]
    plain = {
        "width": int(width),
        "height": int(height),
        "fps": tracks.attrs.get("frame_rate"),
        **(image_parameters or {}),
    }
    with new_folder(Path(folder)) as partial:
        (partial / _MARKERS).mkdir()
        for name, markers in zip(names, shares, strict=True):
            stream = io.BytesIO()
            np.save(stream, markers)
            write_bytes(partial / _MARKERS / _markers_name(name), stream.getvalue())
        write_table(pd.DataFrame({_IMAGE: names, **(labels or {})}), partial / _TARGETS)
        write_text(partial / _PARAMETERS, json_text(plain))
