"""Reading back what the cameras of a study saw, as far as a report shows it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.slip.windows import slide_window
from fingerslip.storage.files import read_json

if TYPE_CHECKING:
    import xarray as xr

    from fingerslip.report.page.content import Film

__all__ = ["CAMERAS", "ERRORS", "film_keys", "read_films"]

#: Folder of the cameras in that of a run, and file that says how good the tracks of a camera are.
CAMERAS, ERRORS = "cameras", "errors.json"

_REPAIR = "remove its folder and run the study again"


def film_keys(folder: Path, runs: Sequence[str]) -> list[str]:
    """Return what tells the films of some runs from others, for the key of a report."""
    return [str(read_json(path, _REPAIR)["key"]) for run in runs for path in _stored_films(folder / run)]


def read_films(folder: Path, histories: Mapping[str, xr.Dataset]) -> tuple[Film, ...]:
    """Read the films of the runs whose histories are shown."""
    return tuple(
        _film(run, path.parent, history) for run, history in histories.items() for path in _stored_films(folder / run)
    )


def _stored_films(run: Path) -> list[Path]:
    return sorted(run.glob(f"{CAMERAS}/*/{ERRORS}"))


def _film(run: str, folder: Path, history: xr.Dataset) -> Film:
    # Pictures and videos are slow to load, and few studies have cameras.
    from fingerslip.report.page.content import Film
    from fingerslip.vision.tracks import read_tracks

    numbers = read_json(folder / ERRORS, _REPAIR)
    truth = read_tracks(folder / "truth.nc")
    displayed = {name: numbers[name] for name in ("frames", "markers", "rms", "largest", "kept", "swapped")}
    tracks = read_tracks(folder / "tracks" / "matched.nc")
    return Film(run, folder.name, tracks, truth, displayed, _frames(folder / "video.avi", truth, history))


def _frames(video: Path, truth: xr.Dataset, history: xr.Dataset) -> dict[float, NDArray[np.uint8]]:
    """Return the frames that a report shows by their times [s]; none without a video or a slide."""
    from fingerslip.report.figures.sensor import film_times
    from fingerslip.vision.video import read_frames

    window, times = slide_window(history), truth["time"].values
    if not video.is_file() or window is None:
        return {}
    wanted = [int(np.abs(times - time).argmin()) for time in film_times(window.start, window.end, float(times[0]))]
    frames = {}
    for number, frame in enumerate(read_frames(video)):
        if number in wanted:
            frames[float(times[number])] = frame
        if number >= max(wanted):
            break
    return frames
