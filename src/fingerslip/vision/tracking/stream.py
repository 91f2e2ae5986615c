"""The markers of a video, followed frame by frame as the frames come."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.vision.exposure import DUPLICATED, Exposure, frame_state, rest_exposure
from fingerslip.vision.opencv import opencv
from fingerslip.vision.tracking.follow import follow, rest_state
from fingerslip.vision.tracking.frames import Channel, Frames, VideoInput, open_frames
from fingerslip.vision.tracking.reference import Reference, first_frames, reference_of
from fingerslip.vision.tracking.topology import LayoutName, check_layout
from fingerslip.vision.tracks import make_tracks

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["MarkerStream", "SeenMarkers", "open_markers"]

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

# Markers are looked for in the mean of this many frames, or of the rest frames where they are fewer.
_AVERAGED = 10
# Positions of a frame that shows nothing new are marked.
_OLD_QUALITY = 0.5


@dataclass(frozen=True)
class SeenMarkers:
    """What was found in a frame."""

    time: float  # time of the frame [s]
    position: NDArray[np.float32]  # (n_markers, 2), positions [px], NaN where a marker is not seen
    quality: NDArray[np.float32]  # (n_markers,), from 0 (not seen) to 1
    state: int  # 0 fine, 1 dark, 2 overexposed, 3 duplicated


@dataclass(frozen=True)
class MarkerStream:
    """The markers of a video, which are followed while one goes through them."""

    frames: Frames  # the frames
    reference: Reference  # the markers at rest, numbered
    mask: Flags | None  # (height, width), pixels that count
    exposure: Exposure  # how light the frames are at rest
    shape: tuple[int, int]  # (int, int), height and width of the frames [px]

    @property
    def at_rest(self) -> xr.Dataset:
        """Tracks of the reference alone, which tell how many markers there are and in which rings."""
        position: Floats = self.reference.markers.position
        return make_tracks(position[None], [0.0], units="px", ring=self.reference.ring, angle=self.reference.angle)

    def __iter__(self) -> Iterator[SeenMarkers]:
        state, before = rest_state(self.reference.markers), None
        for number, frame in enumerate(self.frames.read()):
            light = frame_state(frame, before, self.exposure)
            state, position, quality = follow(self.reference.markers, state, frame, self.mask)
            if light == DUPLICATED:
                quality = np.minimum(quality, _OLD_QUALITY)
            before = frame
            # Single precision is 1e-4 px for the widest images.
            seen = position.astype(np.float32), quality.astype(np.float32)
            yield SeenMarkers(number / self.frames.frame_rate, *seen, light)


def open_markers(
    video: VideoInput,
    *,
    n_markers: int | None = None,
    rest_frames: int = 30,
    layout: LayoutName = "rings",
    mask: Flags | str | Path | None = None,
    bright: bool | None = None,
    frame_rate: float | None = None,
    channel: Channel = "grey",
) -> MarkerStream:
    """Find the markers of a video in its first frames, so that they can be followed frame by frame."""
    check_layout(layout)
    _check_counts(n_markers, rest_frames)
    frames = open_frames(video, frame_rate, channel)
    averaged, first = first_frames(frames.read(), min(rest_frames, _AVERAGED))
    allowed = _mask(mask, first.shape)
    reference = reference_of(averaged, allowed, n_markers, layout, bright, frames.name)
    exposure = rest_exposure(np.clip(averaged, 0, 255).astype(np.uint8))
    height, width = first.shape
    return MarkerStream(frames, reference, allowed, exposure, (height, width))


def _check_counts(n_markers: int | None, rest_frames: int) -> None:
    if n_markers is not None and n_markers < 1:
        raise InputError("n_markers", f"got {n_markers}", "needs a number >= 1")
    if rest_frames < 1:
        raise InputError("rest_frames", f"got {rest_frames}", "needs a number >= 1")


def _mask(mask: NDArray[np.bool_] | str | Path | None, shape: tuple[int, ...]) -> Flags | None:
    if mask is None:
        return None
    if isinstance(mask, str | Path):
        image = opencv().imread(str(mask), 0) if Path(mask).is_file() else None
        if image is None:
            raise InputError("mask", f"{mask} cannot be read as an image", "needs one that is white where markers are")
        mask = image > 127
    allowed = np.ascontiguousarray(mask, dtype=bool)
    if allowed.shape != shape:
        raise InputError("mask", f"got shape {allowed.shape}", f"needs {shape}, the height and width of the frames")
    return allowed
