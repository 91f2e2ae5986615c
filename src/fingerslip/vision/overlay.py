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
from fingerslip.vision.fields.fields import larger_principal
from fingerslip.vision.tracks import check_tracks
from fingerslip.vision.video import FINE, STATES, opencv, write_video

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "RING_COLOURS",
    "SHOWN_FIELDS",
    "Pen",
    "field_frames",
    "overlay_frames",
    "write_field_overlay",
    "write_overlay",
]


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

    def circle(self, centre: Floats, radius: float, colour: Colour, bold: int = 1) -> None:
        """Draw a circle of a radius [px], lines `bold` times as wide as thin ones."""
        size = round(radius * 2**_FINE)
        self.cv2.circle(self.picture, _fixed_point(centre), size, colour, self.line * bold, self.cv2.LINE_AA, _FINE)

    def arrow(self, position: Floats, vector: Floats, colour: Colour) -> None:
        """Draw an arrow at a place; none where it is shorter than half a pixel."""
        if np.isfinite(vector).all() and np.hypot(*vector) > 0.5:
            for start, end in pairwise(_arrow(position, vector, self.line)):
                self.cv2.line(
                    self.picture, _fixed_point(start), _fixed_point(end), colour, self.line, self.cv2.LINE_AA, _FINE
                )

    def segment(self, start: Floats, end: Floats, colour: Colour) -> None:
        """Draw a line twice as wide as thin ones between two places."""
        self.cv2.line(
            self.picture, _fixed_point(start), _fixed_point(end), colour, 2 * self.line, self.cv2.LINE_AA, _FINE
        )

    def write(self, text: str) -> None:
        """Write in the upper left corner, white with a black shadow."""
        for shift, colour in ((1, _BLACK), (0, _WHITE)):
            corner = (8 * self.line + shift, 18 * self.line + shift)
            font, size = self.cv2.FONT_HERSHEY_SIMPLEX, 0.45 * self.line
            self.cv2.putText(self.picture, text, corner, font, size, colour, self.line, self.cv2.LINE_AA)


def _arrow(start: Floats, vector: Floats, line: int) -> list[Floats]:
    """Return the points of a line that draws an arrow: its shaft, and both sides of its head."""
    tip = start + vector
    length = float(np.hypot(*vector))
    back = vector * (min(0.35 * length, 5.0 * line) / length)
    side = 0.6 * np.array([-back[1], back[0]])
    return [start, tip, tip - back + side, tip, tip - back - side]


def _fixed_point(point: Any) -> tuple[int, int]:
    """Return a place in the fractions of a pixel in which OpenCV draws, held inside what its integers take."""
    x, y = np.clip(np.round(np.asarray(point) * 2**_FINE), -(2**30), 2**30)
    return int(x), int(y)


_ARROWS = ("displacement", "velocity", "rigid_residual")
_COLOURS = ("divergence", "curl", "strain")

#: Fields that overlays show.
SHOWN_FIELDS = (*_ARROWS, *_COLOURS, "contact_centroid")

# Blue first: above zero, below zero and arrows.
_ABOVE, _BELOW, _ARROW = RING_COLOURS[0], RING_COLOURS[4], RING_COLOURS[1]
_BLACK_OVERLAY, _WHITE_OVERLAY = (0, 0, 0), (255, 255, 255)
_DENSEST = 0.75  # share of the colour of the largest value in a picture
_LONGEST = 0.9  # length of the longest arrow over the distance of markers


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
    return _drawn_overlay(iter(frames), fields, name)


def _drawn_overlay(frames: Iterator[Frame], fields: xr.Dataset, name: str) -> Iterator[Frame]:
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
            picture = _colour(cv2, picture, position[number][corners], values[number] / largest)
        pen = Pen(cv2, picture, max(round(frame.shape[0] / _REFERENCE_HEIGHT), 1))
        if vectors is not None:
            for point, vector in zip(position[number], stretch * vectors[number], strict=True):
                pen.arrow(point, vector, _ARROW)
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

    visible = rest[~np.isnan(rest).any(axis=1)]
    return float(np.median(KDTree(visible).query(visible, k=2)[0][:, 1])) if len(visible) > 1 else 1.0


def _colour(cv2: ModuleType, picture: Frame, triangles: Floats, values: Floats) -> Frame:
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
        for shift, colour in ((2.0 * pen.line, _BLACK_OVERLAY), (0.0, _WHITE_OVERLAY)):
            for side in ((arm, 0.0), (0.0, arm)):
                pen.segment(centre + shift - side, centre + shift + side, colour)


def _words(name: str) -> str:
    return {"strain": "principal strain", "rigid_residual": "less rigid motion"}.get(name, name.replace("_", " "))


def _scale(fields: xr.Dataset, name: str, largest: float) -> str:
    if name in _COLOURS:
        return f", up to {100 * largest:.3g} %"
    return f", longest {largest:.3g} {fields[name].attrs['units']}" if name in _ARROWS else ""
