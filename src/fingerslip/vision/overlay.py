"""Overlay videos: frames with a circle at each marker and arrows, such as of the displacement, drawn on them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.vision.exposure import FINE, STATES
from fingerslip.vision.opencv import opencv
from fingerslip.vision.tracks import check_tracks
from fingerslip.vision.video import write_video

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["RING_COLOURS", "Pen", "overlay_frames", "write_overlay"]

Frame = NDArray[np.uint8]
Floats = NDArray[np.float64]
Colour = tuple[int, int, int]

#: Colours of rings from the centre outwards, blue first; they repeat. Those of Okabe and Ito.
RING_COLOURS: Sequence[Colour] = (
    (0, 94, 213),
    (0, 159, 230),
    (115, 158, 0),
    (233, 180, 86),
    (178, 114, 0),
    (167, 121, 204),
)
_BLACK: Colour = (0, 0, 0)
_WHITE: Colour = (255, 255, 255)
_FINE = 4  # bits below the pixel to which OpenCV draws
_RADIUS = 2.0  # px, of markers whose tracks do not say it
_DOUBTFUL = 0.6
_REFERENCE_HEIGHT = 480.0  # px, of a frame in which a line of one pixel is right


def write_overlay(
    frames: Iterable[Frame], tracks: xr.Dataset, path: str | Path, *, arrows: Floats | None = None, stretch: float = 1.0
) -> int:
    """Write frames with their markers and arrows as a video, whole or not at all."""
    rate = tracks.attrs.get("frame_rate")
    if rate is None:
        raise InputError("tracks: frame_rate", "is not there", "needs the frames a second", "set it in tracks.attrs")
    return write_video(path, overlay_frames(frames, tracks, arrows=arrows, stretch=stretch), float(rate))


def overlay_frames(
    frames: Iterable[Frame], tracks: xr.Dataset, *, arrows: Floats | None = None, stretch: float = 1.0
) -> Iterator[Frame]:
    """Yield frames with a circle at each marker that is seen, an arrow at it, time and count, in colours of rings.

    Circles of markers whose quality is below 0.6 are thin. What tracks say of a frame (`frame_state`) is written, and
    the size of circles is that of the markers (`radius`) where tracks have them, as those of a video do.

    Arrays: frames (height, width); arrows (n_times, n_markers, 2) [px]; returns (height, width, 3).
    """
    check_tracks(tracks)
    position = tracks["position"].values
    if tracks["position"].attrs["units"] != "px":
        raise InputError("tracks: position", "is in m", "needs px, to be drawn on frames")
    vectors = _since_first_seen(position) if arrows is None else np.asarray(arrows, dtype=np.float64)
    if vectors.shape != position.shape:
        raise InputError("arrows", f"got shape {vectors.shape}", f"needs {position.shape}, as the positions have")
    return _drawn(iter(frames), tracks, stretch * vectors)


def _since_first_seen(position: Floats) -> Floats:
    if not position.size:
        return position
    first = (~np.isnan(position).any(axis=2)).argmax(axis=0)
    vectors: Floats = position - position[first, np.arange(position.shape[1])]
    return vectors


def _drawn(frames: Iterator[Frame], tracks: xr.Dataset, vectors: Floats) -> Iterator[Frame]:
    cv2, position, quality = opencv(), tracks["position"].values, tracks["quality"].values
    radii = tracks["radius"].values if "radius" in tracks else np.full(tracks.sizes["marker"], _RADIUS)
    colours = _colours(tracks)
    for number, time in enumerate(tracks["time"].values):
        frame = next(frames, None)
        if frame is None:
            raise InputError("frames", f"got {number}", f"needs {position.shape[0]}, as many as the tracks have times")
        picture = cv2.cvtColor(frame, cv2.COLOR_GRAY2BGR) if frame.ndim == 2 else frame.copy()
        pen = Pen(cv2, picture, max(round(frame.shape[0] / _REFERENCE_HEIGHT), 1))
        seen = ~np.isnan(position[number]).any(axis=1)
        for marker in np.flatnonzero(seen):
            bold = 2 if quality[number, marker] >= _DOUBTFUL else 1
            pen.circle(position[number, marker], 1.6 * radii[marker] + 1.0, colours[marker], bold)
            pen.arrow(position[number, marker], vectors[number, marker], colours[marker])
        pen.write(f"{time:.3f} s   {seen.sum()} of {seen.size} markers{_state(tracks, number)}")
        yield picture


def _colours(tracks: xr.Dataset) -> list[Colour]:
    rings = tracks["ring"].values if "ring" in tracks.coords else np.zeros(tracks.sizes["marker"], dtype=int)
    return [RING_COLOURS[int(ring) % len(RING_COLOURS)] for ring in rings]


def _state(tracks: xr.Dataset, number: int) -> str:
    """Return what is wrong with a frame; nothing where tracks do not say it."""
    state = int(tracks["frame_state"].values[number]) if "frame_state" in tracks else FINE
    return "" if state == FINE else f", {STATES[state]}"


@dataclass(frozen=True)
class Pen:
    """What draws on a picture."""

    cv2: ModuleType  # openCV
    picture: Frame  # (height, width, 3), what is drawn on, in place
    line: int  # width of a thin line [px]

    def circle(self, place: Floats, radius: float, colour: Colour, bold: int = 1) -> None:
        """Draw a circle of a radius [px], lines `bold` times as wide as thin ones."""
        size = round(radius * 2**_FINE)
        self.cv2.circle(self.picture, _fixed(place), size, colour, self.line * bold, self.cv2.LINE_AA, _FINE)

    def arrow(self, place: Floats, vector: Floats, colour: Colour) -> None:
        """Draw an arrow at a place; none where it is shorter than half a pixel."""
        if np.isfinite(vector).all() and np.hypot(*vector) > 0.5:
            for start, end in pairwise(_arrow(place, vector, self.line)):
                self.cv2.line(self.picture, _fixed(start), _fixed(end), colour, self.line, self.cv2.LINE_AA, _FINE)

    def segment(self, start: Floats, end: Floats, colour: Colour) -> None:
        """Draw a line twice as wide as thin ones between two places."""
        self.cv2.line(self.picture, _fixed(start), _fixed(end), colour, 2 * self.line, self.cv2.LINE_AA, _FINE)

    def write(self, text: str) -> None:
        """Write in the upper left corner, white with a black shadow."""
        for shift, colour in ((1, _BLACK), (0, _WHITE)):
            place = (8 * self.line + shift, 18 * self.line + shift)
            font, size = self.cv2.FONT_HERSHEY_SIMPLEX, 0.45 * self.line
            self.cv2.putText(self.picture, text, place, font, size, colour, self.line, self.cv2.LINE_AA)


def _arrow(place: Floats, vector: Floats, line: int) -> list[Floats]:
    """Return the points of a line that draws an arrow: its shaft, and both sides of its head."""
    tip = place + vector
    length = float(np.hypot(*vector))
    back = vector * (min(0.35 * length, 5.0 * line) / length)
    side = 0.6 * np.array([-back[1], back[0]])
    return [place, tip, tip - back + side, tip, tip - back - side]


def _fixed(place: Any) -> tuple[int, int]:
    """Return a place in the fractions of a pixel in which OpenCV draws, held inside what its integers take."""
    x, y = np.clip(np.round(np.asarray(place) * 2**_FINE), -(2**30), 2**30)
    return int(x), int(y)
