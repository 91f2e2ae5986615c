"""Frames with what the tracker found drawn on them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from types import ModuleType

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.vision.opencv import opencv
from fingerslip.vision.overlay import RING_COLOURS
from fingerslip.vision.tracking.exposure import FINE, STATES

__all__ = ["overlaid"]

Frame = NDArray[np.uint8]
Colour = tuple[int, int, int]

_LIGHT: Colour = (255, 255, 255)
_BITS = 4  # OpenCV draws in sixteenths of a pixel
_DOUBTFUL = 0.6
_REFERENCE_HEIGHT = 480.0  # px, of a frame in which a line of one pixel is right


def overlaid(frames: Iterable[Frame], tracks: xr.Dataset) -> Iterator[Frame]:
    """Yield frames in colour with a circle around every marker that was found and a line from where it rested.

    Circles have the colour of the ring of the marker; those of a quality below 0.6 are thin. The text says how many
    markers were found, of how many, and what is wrong with the frame.

    Parameters
    ----------
    frames : iterable of (height, width) array of uint8
        The frames that were tracked.
    tracks : xarray.Dataset
        What :func:`fingerslip.track_markers` returned for them.

    Yields
    ------
    (height, width, 3) array of uint8
        Each frame with the drawing, blue first.
    """
    cv2 = opencv()
    name = "image_position" if "image_position" in tracks else "position"
    position, quality = tracks[name].values, tracks["quality"].values
    rest = position[: max(int(tracks.attrs.get("rest_frames", 1)), 1)]
    # Where it was first seen: the line is a guide, not a measurement.
    start = rest[np.isfinite(rest[..., 0]).argmax(axis=0), np.arange(rest.shape[1])]
    radius = tracks["radius"].values if "radius" in tracks else np.full(position.shape[1], 6.0)
    states = tracks["frame_state"].values if "frame_state" in tracks else np.zeros(len(position), dtype=int)
    colours = _colours(tracks)
    for t, (frame, here) in enumerate(zip(frames, position, strict=False)):
        picture = cv2.cvtColor(frame, cv2.COLOR_GRAY2BGR) if frame.ndim == 2 else frame.copy()
        line = max(round(frame.shape[0] / _REFERENCE_HEIGHT), 1)
        for n in np.flatnonzero(np.isfinite(here).all(axis=1)):
            _marker(
                cv2, picture, here[n], start[n], radius[n], colours[n], line * (2 if quality[t, n] >= _DOUBTFUL else 1)
            )
        found = int(np.isfinite(here).all(axis=1).sum())
        state = "" if states[t] == FINE else f", {STATES[states[t]]}"
        _text(cv2, picture, f"{float(tracks['time'][t]):.3f} s  {found}/{len(here)} markers{state}", line)
        yield picture


def _colours(tracks: xr.Dataset) -> list[Colour]:
    rings = tracks["ring"].values if "ring" in tracks.coords else np.zeros(tracks.sizes["marker"], dtype=int)
    return [RING_COLOURS[int(ring) % len(RING_COLOURS)] for ring in rings]


def _marker(  # noqa: PLR0917  what is drawn, and how
    cv2: ModuleType,
    picture: Frame,
    here: NDArray[np.float64],
    start: NDArray[np.float64],
    radius: float,
    colour: Colour,
    line: int,
) -> None:
    centre = _fixed(here)
    if np.isfinite(start).all():
        cv2.line(picture, _fixed(start), centre, colour, line, cv2.LINE_AA, _BITS)
    cv2.circle(picture, centre, round((1.6 * radius + 1.0) * 2**_BITS), colour, line, cv2.LINE_AA, _BITS)


def _fixed(point: NDArray[np.float64]) -> tuple[int, int]:
    x, y = np.rint(point * 2**_BITS).astype(int)
    return int(x), int(y)


def _text(cv2: ModuleType, picture: Frame, text: str, line: int) -> None:
    height = 26 * line
    picture[:height, : min(len(text) * 10 * line + 12 * line, picture.shape[1])] = 0
    place = (8 * line, 18 * line)
    cv2.putText(picture, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.5 * line, _LIGHT, line, cv2.LINE_AA)
