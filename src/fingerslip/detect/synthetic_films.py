"""Videos of analytic trials, to try what is done with a lab's recordings; see :mod:`fingerslip.detect.synthetic`."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fingerslip.detect.recordings import EXTERNAL
from fingerslip.detect.synthetic import CENTRE
from fingerslip.detect.trials import Trial
from fingerslip.files import check_empty, csv_text, write_text, writing
from fingerslip.vision.cameras.camera import Camera, Pose
from fingerslip.vision.cameras.intrinsics import pinhole_for_view
from fingerslip.vision.cameras.look import MarkerLook, PixelCamera
from fingerslip.vision.cameras.pixel import film
from fingerslip.vision.tracks import make_tracks

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["film_trials"]

#: Distance of the camera [m]; it looks straight at a plane, so that it does not matter.
_DISTANCE = 50e-3


def film_trials(trials: Iterable[Trial], folder: str | Path, *, size: tuple[int, int] = (320, 240)) -> Path:
    """Film trials as a lab does: a video of the inside and one of the skin for each, and a table of conditions.

    Parameters
    ----------
    trials : iterable of Trial
        Analytic trials, whose pictures have their middle at :data:`fingerslip.detect.synthetic.CENTRE`.
    folder : path
        Folder of the videos and of ``conditions.csv``, new or empty.
    size : (int, int), optional
        Width and height of the pictures [px].

    Returns
    -------
    Path
        The table of conditions.

    Raises
    ------
    InputError
        Where the folder holds files.
    ResultError
        Where a file cannot be written.
    """
    place = Path(folder)
    check_empty(place)
    with writing(place):
        place.mkdir(parents=True, exist_ok=True)
    rows: list[tuple[object, ...]] = [("file", EXTERNAL, "indentation [mm]", "direction [deg]")]
    for trial in trials:
        names = f"{trial.name}.mkv", f"{trial.name}-outside.mkv"
        for kind, name in zip(("internal", "external"), names, strict=True):
            _film(trial.tracks, kind, place / name, size)
        conditions = trial.conditions
        rows.append((*names, 1e3 * conditions["indentation"], round(math.degrees(conditions["direction"]), 6)))
    write_text(place / "conditions.csv", csv_text(rows))
    return place / "conditions.csv"


def _film(tracks: xr.Dataset, kind: str, path: Path, size: tuple[int, int]) -> None:
    """Film the markers of one kind."""
    shown = tracks.isel(marker=np.flatnonzero(tracks["kind"].values == kind))
    scale = float(tracks.attrs["metres_per_pixel_x"])
    # y of pictures points down, that of the plane up.
    plane = (shown["position"].values - np.array(CENTRE)) * np.array([scale, -scale])
    space = np.concatenate([plane, np.zeros_like(plane[:, :, :1])], axis=2)
    lens = pinhole_for_view(*size, view_width=size[0] * scale, distance=_DISTANCE)
    pose = Pose((0.0, 0.0, _DISTANCE), (0.0, 0.0, 0.0))
    rate = float(tracks.attrs["frame_rate"])
    camera = Camera(lens, pose, "internal", frame_rate=rate, exposure=0.3 / rate)
    filming = PixelCamera(camera, MarkerLook(radius=4.0 * scale), seed=1)
    film(filming, make_tracks(space, shown["time"].values, units="m"), path)
