"""Overlay videos of the fields of markers: arrows or colours on the frames, and the contact centroid."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.vision.fields.triangles import larger_principal
from fingerslip.vision.opencv import opencv
from fingerslip.vision.overlay import RING_COLOURS, Pen
from fingerslip.vision.video import write_video

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["SHOWN_FIELDS", "field_frames", "write_field_overlay"]

Frame = NDArray[np.uint8]
Floats = NDArray[np.float64]

_ARROWS = ("displacement", "velocity", "rigid_residual")
_COLOURS = ("divergence", "curl", "strain")

#: Fields that overlays show.
SHOWN_FIELDS = (*_ARROWS, *_COLOURS, "contact_centroid")

# Blue first: above zero, below zero and arrows.
_ABOVE, _BELOW, _ARROW = RING_COLOURS[0], RING_COLOURS[4], RING_COLOURS[1]
_BLACK, _WHITE = (0, 0, 0), (255, 255, 255)
_DENSEST = 0.75  # share of the colour of the largest value in a picture
_LONGEST = 0.9  # length of the longest arrow over the distance of markers
_REFERENCE_HEIGHT = 480.0  # px, of a frame in which a line of one pixel is right


def write_field_overlay(frames: Iterable[Frame], fields: xr.Dataset, name: str, path: str | Path) -> int:
    """Write frames with a field of their markers as a video, whole or not at all.

    Parameters
    ----------
    frames, fields, name
        As for :func:`field_frames`. The fields must say their ``frame_rate``, as those of a tracked video do.
    path : path
        A video file or a folder; see :func:`~fingerslip.vision.video.write_video`.

    Returns
    -------
    int
        Number of frames.

    Raises
    ------
    InputError
        Where there is no such field or frame rate, fields are not in pixels, or there are less frames than times.
    ResultError
        Where the file cannot be written.
    """
    rate = fields.attrs.get("frame_rate")
    if rate is None:
        raise InputError("fields: frame_rate", "is not there", "needs the frames a second", "set it in fields.attrs")
    return write_video(path, field_frames(frames, fields, name), float(rate))


def field_frames(frames: Iterable[Frame], fields: xr.Dataset, name: str) -> Iterator[Frame]:
    """Yield frames with a field drawn on them at the places of the markers, the same scale in all.

    Displacement is drawn as long as it is; other arrows so that the longest one nearly reaches the next marker.
    Divergence, curl and the larger principal strain are colours of the triangles between markers, orange above zero and
    blue below. The contact centroid is a cross on each picture.

    Arrays: frames (height, width); returns (height, width, 3).
    """
    if name not in SHOWN_FIELDS:
        raise InputError("field", f"got {name!r}", f"needs one of {', '.join(SHOWN_FIELDS)}")
    if fields["position"].attrs["units"] != "px":
        raise InputError("fields: position", "is in m", "needs px, to be drawn on frames")
    return _drawn(iter(frames), fields, name)


def _drawn(frames: Iterator[Frame], fields: xr.Dataset, name: str) -> Iterator[Frame]:
    cv2, position = opencv(), fields["position"].values
    corners, centroid = fields["triangle_marker"].values, fields["contact_centroid"].values
    values = _in_triangles(fields, name) if name in _COLOURS else None
    vectors = fields[name].values if name in _ARROWS else None
    sizes = np.abs(values) if values is not None else np.zeros(0)
    sizes = np.hypot(*np.moveaxis(vectors, -1, 0)) if vectors is not None else sizes
    largest = float(np.nanmax(sizes, initial=0.0))
    stretch = 1.0 if name == "displacement" or not largest else _LONGEST * _spacing(fields["rest"].values) / largest
    for number, time in enumerate(fields["time"].values):
        frame = next(frames, None)
        if frame is None:
            raise InputError("frames", f"got {number}", f"needs {len(position)}, as many as the fields have times")
        picture = cv2.cvtColor(frame, cv2.COLOR_GRAY2BGR) if frame.ndim == 2 else frame.copy()
        if values is not None and largest:
            picture = _coloured(cv2, picture, position[number][corners], values[number] / largest)
        pen = Pen(cv2, picture, max(round(frame.shape[0] / _REFERENCE_HEIGHT), 1))
        if vectors is not None:
            for place, vector in zip(position[number], stretch * vectors[number], strict=True):
                pen.arrow(place, vector, _ARROW)
        _cross(pen, centroid[number])
        pen.write(f"{time:.3f} s   {_words(name)}{_scale(fields, name, largest)}")
        yield picture


def _in_triangles(fields: xr.Dataset, name: str) -> Floats:
    """Return a field as one value for each time and triangle; the mean of its corners where markers have values."""
    if name == "strain":
        return larger_principal(fields["strain"].values)
    means: Floats = fields[name].values[:, fields["triangle_marker"].values].mean(axis=2)
    return means


def _spacing(rest: Floats) -> float:
    """Return the median distance of markers from the nearest other one [px]."""
    from scipy.spatial import KDTree

    known = rest[~np.isnan(rest).any(axis=1)]
    return float(np.median(KDTree(known).query(known, k=2)[0][:, 1])) if len(known) > 1 else 1.0


def _coloured(cv2: ModuleType, picture: Frame, triangles: Floats, values: Floats) -> Frame:
    """Return a picture with colours over (n, 3, 2) triangles [px] of values from -1 to 1, none where one is NaN."""
    colour, share = picture.copy(), np.zeros(picture.shape[:2], dtype=np.float32)
    for corners, value in zip(triangles, values, strict=True):
        if np.isfinite(value) and np.isfinite(corners).all():
            points = np.round(corners).astype(np.int32)
            cv2.fillConvexPoly(colour, points, _ABOVE if value > 0 else _BELOW)
            cv2.fillConvexPoly(share, points, _DENSEST * abs(float(value)))
    mixed: Frame = np.round(picture + share[..., None] * (colour.astype(np.float32) - picture)).astype(np.uint8)
    return mixed


def _cross(pen: Pen, centre: Floats) -> None:
    """Draw a cross, white with a black shadow as words are, so that it is seen on any ground."""
    if np.isfinite(centre).all():
        arm = 8.0 * pen.line
        for shift, colour in ((2.0 * pen.line, _BLACK), (0.0, _WHITE)):
            for side in ((arm, 0.0), (0.0, arm)):
                pen.segment(centre + shift - side, centre + shift + side, colour)


def _words(name: str) -> str:
    return {"strain": "principal strain", "rigid_residual": "less rigid motion"}.get(name, name.replace("_", " "))


def _scale(fields: xr.Dataset, name: str, largest: float) -> str:
    if name in _COLOURS:
        return f", up to {100 * largest:.3g} %"
    return f", longest {largest:.3g} {fields[name].attrs['units']}" if name in _ARROWS else ""
