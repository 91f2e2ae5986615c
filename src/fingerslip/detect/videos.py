"""Recordings as tracks: files of tracks as they are, videos by following their markers; both cameras of a sensor."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from fingerslip.detect.recordings import TRACK_FILES, read_any_tracks
from fingerslip.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from fingerslip.vision.tracking.topology import LayoutName

__all__ = ["read_recording", "readers"]


def read_recording(
    path: Path, n_markers: int | None = None, rest_frames: int = 100, layout: LayoutName = "rings"
) -> xr.Dataset:
    """Return the tracks of a recording: read where it is a file of tracks, else followed through the video.

    What is wrong with a video stands in the attribute ``warnings`` of its tracks.
    """
    if path.suffix in TRACK_FILES:
        return read_any_tracks(path)
    # The tracker is slow to load, and files of tracks do not need it.
    from fingerslip.vision.tracking.track import TrackingWarning, track_markers

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", TrackingWarning)
        tracks = track_markers(path, n_markers=n_markers, rest_frames=rest_frames, layout=layout)
    if n_markers is not None and tracks.sizes["marker"] != n_markers:
        found = f"shows {tracks.sizes['marker']} markers"
        raise InputError(
            str(path), found, f"needs {n_markers}", "look at it with fingerslip track, or give another number"
        )
    # What only its quality page needs stays behind: data sets hold positions and qualities.
    return tracks.drop_vars([name for name in tracks.data_vars if name not in ("position", "quality")])


def readers(
    n_markers: int | None = None,
    n_external: int | None = None,
    rest_frames: int = 100,
    layout: LayoutName = "rings",
) -> tuple[Callable[[Path], xr.Dataset], Callable[[Path], xr.Dataset]]:
    """Return what reads the recordings of the inner and of the outer camera; see :func:`read_recording`.

    The markers of the outer camera are numbered by rows: only the middle one of them counts by itself.
    """
    inner = partial(read_recording, n_markers=n_markers, rest_frames=rest_frames, layout=layout)
    outer = partial(read_recording, n_markers=n_external, rest_frames=rest_frames, layout="free")
    return inner, outer
