"""Recordings in time: folders ``run_0``, ``run_1``, ... each with images and tables of what else was measured.

A run has ``time_series_images/`` and ``image_data.csv``; perhaps ``control_data.csv`` (times ``start``,
``shear_start``, ``shear_end`` and ``end``), ``ft_sensor_data.csv`` and ``robot_data.csv``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.files import check_empty, new_folder
from fingerslip.vision.tracking.formats.tables import read_table, write_table
from fingerslip.vision.video import write_video

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["TABLES", "SeriesRun", "read_series", "write_series_run"]

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
    def image_times(self) -> NDArray[np.float64] | None:
        """Times of the images [s], from the first column ``time``, ``timestamp`` or ``t``; None without one."""
        table = self.tables.get("image")
        name = None if table is None else next((name for name in _TIMES if name in table.columns), None)
        return None if table is None or name is None else table[name].to_numpy(np.float64)

    @property
    def frame_rate(self) -> float | None:
        """Mean number of images a second [1/s]; None where the times are not known."""
        times = self.image_times
        if times is None or len(times) < 2 or not times[-1] > times[0]:
            return None
        return float((len(times) - 1) / (times[-1] - times[0]))


def read_series(folder: str | Path) -> dict[int, SeriesRun]:
    """Return the runs of a folder by their numbers, without reading images.

    Raises
    ------
    InputError
        Where there are no runs, or one has no images.
    """
    folder = Path(folder)
    found = {int(match[1]): path for path in folder.glob("run_*") if (match := _RUN.fullmatch(path.name))}
    if not found:
        raise InputError(str(folder), "has no runs", "needs folders run_0, run_1, ...")
    return {number: _read_run(found[number]) for number in sorted(found)}


def _read_run(folder: Path) -> SeriesRun:
    if not (folder / _IMAGES).is_dir():
        raise InputError(str(folder), f"has no {_IMAGES}", "needs a folder of images")
    there = {name: folder / file for name, file in TABLES.items() if (folder / file).is_file()}
    return SeriesRun(folder / _IMAGES, {name: read_table(path) for name, path in there.items()})


def write_series_run(
    folder: str | Path,
    number: int,
    frames: Iterable[NDArray[np.uint8]],
    frame_rate: float,
    tables: Mapping[str, pd.DataFrame] | None = None,
) -> Path:
    """Write a run, whole or not at all.

    Parameters
    ----------
    folder : path
        The folder of the recording.
    number : int
        Number of the run.
    frames : iterable of arrays
        Its frames, (height, width) or (height, width, 3) of uint8.
    frame_rate : float
        Frames a second [1/s].
    tables : mapping of str to pandas.DataFrame, optional
        Tables by their names in :data:`TABLES`; ``image`` is made where it is not given.

    Returns
    -------
    Path
        The folder of the run.

    Raises
    ------
    InputError
        Where a table has another name, there are no frames, or the folder of the run holds files.
    ResultError
        Where the folder cannot be written.
    """
    import pandas as pd

    given = dict(tables or {})
    unknown = sorted(given.keys() - TABLES.keys())
    if unknown:
        raise InputError("tables", f"got {unknown[0]!r}", f"needs names among {', '.join(TABLES)}")
    final = Path(folder) / f"run_{number}"
    check_empty(final)
    with new_folder(final) as partial:
        count = write_video(partial / _IMAGES, frames, frame_rate)
        given.setdefault("image", pd.DataFrame({"time": np.arange(count) / frame_rate}))
        for name, table in given.items():
            write_table(table, partial / TABLES[name])
    return final
