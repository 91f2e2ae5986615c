"""Forms in which laboratories keep tactile recordings, in and out.

The tactile laboratory in Bristol keeps folders with ``targets.csv``, which has a row for each image (``sensor_image``,
and labels such as ``pose_*`` and ``shear_*``), ``sensor_images/`` with the images, ``sensor_image_params.json`` with
the settings of the camera, and ``processed_markers/markers_N.npy`` with the markers of ``image_N``: x and y in shares
of the width and height. Recordings in time are folders ``run_0``, ``run_1``, ... with images in
``time_series_images/`` and ``image_data.csv``; perhaps ``control_data.csv`` (times ``start``, ``shear_start``,
``shear_end`` and ``end``), ``ft_sensor_data.csv`` and ``robot_data.csv``. Tables of pins are CSV files.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.errors import InputError, shorten
from fingerslip.libraries import pd, xr
from fingerslip.storage.files import check_empty, frame_csv, json_text, new_folder, write_bytes, write_text
from fingerslip.vision.tracks import check_tracks, make_tracks, read_csv
from fingerslip.vision.video import write_video

_TARGETS, _PARAMETERS, _MARKERS = "targets.csv", "sensor_image_params.json", "processed_markers"
_IMAGE = "sensor_image"


@dataclass(frozen=True)
class BristolSet:
    """A data set."""

    folder: Path  # where it is
    targets: pd.DataFrame  # A row for each image: ``sensor_image`` and labels
    image_parameters: Mapping[str, Any]  # settings of the camera
    markers: tuple[Floats, ...]  # (n, 2), markers of each image in shares of its width and height


def read_bristol(folder: str | Path) -> BristolSet:
    """Read a data set of this form; raise InputError where ``targets.csv`` names no images, or a file is not right."""
    folder = Path(folder)
    targets = read_csv(folder / _TARGETS)
    if _IMAGE not in targets.columns:
        raise InputError(str(folder / _TARGETS), f"has no column {_IMAGE}", "needs the name of the image in each row")
    path, parameters = folder / _PARAMETERS, {}
    if path.is_file():
        try:
            parameters = json.loads(path.read_text(encoding="utf-8"))
        except ValueError as error:
            fault = f"is no JSON ({shorten(str(error))})"
            raise InputError(str(path), fault, "needs settings of a camera") from None
        if not isinstance(parameters, dict):
            raise InputError(str(path), f"holds {shorten(repr(parameters))}", "needs names and values in {}")
    markers: list[Floats] = []
    for image in map(str, targets[_IMAGE] if (folder / _MARKERS).is_dir() else ()):
        path = folder / _MARKERS / _markers_name(image)
        try:
            array = np.load(path, allow_pickle=False)
        except OSError as error:
            fault = f"cannot be read ({error.strerror})"
            raise InputError(str(path), fault, "needs the markers of every image") from None
        except (ValueError, EOFError) as error:
            raise InputError(str(path), f"is no array ({shorten(str(error))})", "needs x and y of markers") from None
        if array.ndim != 2 or array.shape[1] != 2 or array.dtype.kind not in "fiu":
            raise InputError(str(path), f"has shape {array.shape} of {array.dtype}", "needs numbers of shape (n, 2)")
        markers.append(np.asarray(array, dtype=np.float64))
    return BristolSet(folder, targets, parameters, tuple(markers))


def _markers_name(image: str) -> str:
    numbers = re.findall(r"\d+", Path(image).stem)
    if not numbers:
        raise InputError(_TARGETS, f"the image {shorten(image)!r} has no number", "needs names such as image_1.png")
    return f"markers_{numbers[-1]}.npy"


def bristol_tracks(data: BristolSet, size: tuple[int, int], frame_rate: float) -> xr.Dataset:
    """Return the markers of a data set as tracks, its rows in order of time at a rate [1/s].

    Its markers must be in the same order in every image, which those that were sorted by x are not. The size is the
    width and height of the images [px]. Raises InputError where there are no markers, or their number changes.
    """
    counts = sorted({len(markers) for markers in data.markers})
    if len(counts) != 1:
        fault = f"has {' or '.join(map(str, counts))} markers in an image" if counts else "has no processed markers"
        raise InputError(str(data.folder), fault, "tracks need the same ones in all", "track its images")
    position = np.stack(data.markers) * np.array(size, dtype=np.float64)
    image = {"image_width": size[0], "image_height": size[1], "frame_rate": frame_rate}
    attributes = {"source": str(data.folder), **image}
    return make_tracks(position, np.arange(len(position)) / frame_rate, units="px", attributes=attributes)


def write_bristol(
    tracks: xr.Dataset,
    folder: str | Path,
    *,
    labels: Mapping[str, Sequence[Any]] | None = None,
    image_parameters: Mapping[str, Any] | None = None,
) -> None:
    """Write tracks as a data set of this form, whole or not at all: the markers of frame N as ``markers_N.npy``.

    The tracks are in pixels with the attributes ``image_width`` and ``image_height``, the folder is new or empty.
    Labels are columns of ``targets.csv`` with a value for each frame, such as ``pose_1``; parameters of the image are
    added to its size and the frame rate.
    """
    check_tracks(tracks)
    check_empty(Path(folder))
    width, height = (tracks.attrs.get(f"image_{name}") for name in ("width", "height"))
    if tracks["position"].attrs["units"] != "px" or width is None or height is None:
        fault = f"is in {tracks['position'].attrs['units']}, in an image of {width} x {height} px"
        raise InputError("tracks: position", fault, "needs pixels and the attributes image_width and image_height")
    shares = tracks["position"].values / (float(width), float(height))
    names = [f"image_{number}.png" for number in range(len(shares))]
    image = {"width": int(width), "height": int(height), "fps": tracks.attrs.get("frame_rate")}
    with new_folder(Path(folder)) as partial:
        (partial / _MARKERS).mkdir()
        for name, markers in zip(names, shares, strict=True):
            stream = io.BytesIO()
            np.save(stream, markers)
            write_bytes(partial / _MARKERS / _markers_name(name), stream.getvalue())
        write_text(partial / _TARGETS, frame_csv(pd.DataFrame({_IMAGE: names, **(labels or {})})))
        write_text(partial / _PARAMETERS, json_text({**image, **(image_parameters or {})}))


_PIN = re.compile(r"pin_(\d+)_([xy])")
_TIME = "time"


def write_pins(tracks: xr.Dataset, path: str | Path) -> None:
    """Write tracks in pixels as a table of pins, with their times [s] before; what was not seen is an empty cell."""
    check_tracks(tracks)
    if tracks["position"].attrs["units"] != "px":
        raise InputError("tracks: position", "is in metres", "tables of pins are in pixels", "write tracks_csv")
    columns = {_TIME: tracks["time"].values}
    for column, number in enumerate(tracks["marker"].values):
        for axis, name in enumerate("xy"):
            columns[f"pin_{number}_{name}"] = tracks["position"].values[:, column, axis]
    write_text(Path(path), frame_csv(pd.DataFrame(columns)))


def read_pins(path: str | Path, frame_rate: float | None = None) -> xr.Dataset:
    """Read a CSV file with ``pin_0_x``, ``pin_0_y``, ... [px] as tracks; other columns but ``time`` [s] are left alone.

    The rows a second [1/s] may be given instead of the times. Raises InputError where there are no pins, one lacks x or
    y, or nothing says the time.
    """
    table = read_csv(Path(path))
    numbers = sorted({int(match[1]) for name in table.columns if (match := _PIN.fullmatch(str(name)))})
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


#: Tables of a run: their names here, and their files.
TABLES: Mapping[str, str] = MappingProxyType(
    {"image": "image_data.csv", "control": "control_data.csv", "force": "ft_sensor_data.csv", "robot": "robot_data.csv"}
)
_IMAGES = "time_series_images"
_RUN = re.compile(r"run_(\d+)")
_TIMES = ("time", "timestamp", "t")


@dataclass(frozen=True)
class SeriesRun:
    """A run."""

    images: Path  # folder of its images, which :func:`fingerslip.track_markers` takes
    tables: Mapping[str, pd.DataFrame]  # its tables by their names in :data:`TABLES`, as far as they are there

    @property
    def image_times(self) -> Floats | None:
        """Times of the images [s], from the first column ``time``, ``timestamp`` or ``t``; None without one."""
        table: Any = self.tables.get("image", {})
        name = next((name for name in _TIMES if name in table), None)
        return None if name is None else table[name].to_numpy(np.float64)

    @property
    def frame_rate(self) -> float | None:
        """Mean number of images a second [1/s]; None where the times are not known."""
        times = self.image_times
        if times is None or len(times) < 2 or not times[-1] > times[0]:
            return None
        return float((len(times) - 1) / (times[-1] - times[0]))


def read_series(folder: str | Path) -> dict[int, SeriesRun]:
    """Return the runs of a folder by their numbers, without reading images; raise InputError where a run has none."""
    folder = Path(folder)
    folders = {int(match[1]): path for path in folder.glob("run_*") if (match := _RUN.fullmatch(path.name))}
    if not folders:
        raise InputError(str(folder), "has no runs", "needs folders run_0, run_1, ...")
    runs = {}
    for number, run in sorted(folders.items()):
        if not (run / _IMAGES).is_dir():
            raise InputError(str(run), f"has no {_IMAGES}", "needs a folder of images")
        tables = {name: read_csv(run / file) for name, file in TABLES.items() if (run / file).is_file()}
        runs[number] = SeriesRun(run / _IMAGES, tables)
    return runs


def write_series_run(
    folder: str | Path,
    number: int,
    frames: Iterable[NDArray[np.uint8]],
    frame_rate: float,
    tables: Mapping[str, pd.DataFrame] | None = None,
) -> Path:
    """Write a run, whole or not at all, and return its folder, which must be new or empty.

    The folder is that of the recording. Frames are (height, width) or (height, width, 3) of uint8, at a rate [1/s];
    tables have their names in :data:`TABLES`, and ``image`` is made where it is not given.
    """
    by_name = dict(tables or {})
    unknown = sorted(by_name.keys() - TABLES.keys())
    if unknown:
        raise InputError("tables", f"got {unknown[0]!r}", f"needs names among {', '.join(TABLES)}")
    final = Path(folder) / f"run_{number}"
    check_empty(final)
    with new_folder(final) as partial:
        count = write_video(partial / _IMAGES, frames, frame_rate)
        by_name.setdefault("image", pd.DataFrame({"time": np.arange(count) / frame_rate}))
        for name, table in by_name.items():
            write_text(partial / TABLES[name], frame_csv(table))
    return final
