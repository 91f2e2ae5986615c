"""Overlay videos: frames with their markers and arrows, or with a field between the markers, drawn on them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from fingerslip.arrays import Flags, Floats
from fingerslip.errors import InputError
from fingerslip.libraries import xr
from fingerslip.vision.fields import larger_principal
from fingerslip.vision.tracking.layouts import nearest_neighbours
from fingerslip.vision.tracks import check_tracks
from fingerslip.vision.video import FINE, STATES, Frame, opencv

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
_ABOVE, _BELOW, _ARROW = RING_COLOURS[0], RING_COLOURS[4], RING_COLOURS[1]  # above zero, below zero and arrows
_ALONG = RING_COLOURS[3]  # what goes with the others
_FINE = 4  # bits below the pixel to which OpenCV draws
_RADIUS = 2.0  # px, of markers whose tracks do not say it
_DOUBTFUL = 0.6
_REFERENCE_HEIGHT = 480.0  # px, of a frame in which a line of one pixel is right
_DENSEST = 0.75  # share of the colour of the largest value in a picture
_LONGEST = 0.9  # length of the longest arrow over the distance of markers

_ARROWS = ("displacement", "velocity", "rigid_residual")
_COLOURS = ("divergence", "curl", "strain")
#: Fields that overlays show.
SHOWN_FIELDS = (*_ARROWS, *_COLOURS, "contact_centroid")


def overlay_frames(
    frames: Iterable[Frame],
    tracks: xr.Dataset,
    *,
    arrows: Floats | None = None,
    marked: Flags | Floats | None = None,
) -> Iterator[Frame]:
    """Yield frames (height, width, 3) with a circle at each marker that is seen, an arrow to it, time and count.

    Colours are those of rings, white for markers that do not move with their neighbours (`still`), or where `marked`
    (n_times, n_markers) is given orange and blue, white where that is NaN. Circles are as large as the markers
    (`radius`), thin where their quality is below 0.6. Arrows (n_times, n_markers, 2) [px] are displacements unless
    given, their heads at the markers. What tracks say of a frame (`frame_state`) is written.
    """
    position, quality = check_tracks(tracks)["position"].values, tracks["quality"].values
    _check_pixels(tracks, "tracks")
    seen, count = ~np.isnan(position).any(axis=2), tracks.sizes["marker"]
    if arrows is None and position.size:
        arrows = position - position[seen.argmax(axis=0), np.arange(count)]
    vectors = position if arrows is None else np.asarray(arrows, dtype=np.float64)
    if vectors.shape != position.shape:
        raise InputError("arrows", f"got shape {vectors.shape}", f"needs {position.shape}, as the positions have")
    radii = tracks["radius"].values if "radius" in tracks else np.full(count, _RADIUS)
    rings = tracks["ring"].values if "ring" in tracks.coords else np.zeros(count, dtype=int)
    still = tracks["still"].values if "still" in tracks else np.zeros(count, dtype=int)
    states = tracks["frame_state"].values if "frame_state" in tracks else np.full(len(position), FINE)

    def draw(number: int, pen: _Pen) -> str:
        for marker in np.flatnonzero(seen[number]):
            colour = RING_COLOURS[int(rings[marker]) % len(RING_COLOURS)]
            if marked is not None:
                colour = _ABOVE if marked[number, marker] else _ALONG
            if still[marker] if marked is None else np.isnan(marked[number, marker]):
                colour = _WHITE
            bold = 2 if quality[number, marker] >= _DOUBTFUL else 1
            pen.circle(position[number, marker], 1.6 * radii[marker] + 1.0, colour, bold)
            pen.arrow(position[number, marker] - vectors[number, marker], vectors[number, marker], colour)
        state = "" if states[number] == FINE else f", {STATES[int(states[number])]}"
        return f"{seen[number].sum()} of {count} markers{state}"

    return _draw_all(frames, tracks, "tracks", draw)


def field_frames(frames: Iterable[Frame], fields: xr.Dataset, name: str) -> Iterator[Frame]:
    """Yield frames (height, width, 3) with a field drawn on them at the places of the markers, the same scale in all.

    Displacement is drawn as long as it is; other arrows so that the longest one nearly reaches the next marker.
    Divergence, curl and the larger principal strain are colours of the triangles between markers, orange above zero and
    blue below. The contact centroid is a cross on each picture.
    """
    if name not in SHOWN_FIELDS:
        raise InputError("field", f"got {name!r}", f"needs one of {', '.join(SHOWN_FIELDS)}")
    _check_pixels(fields, "fields")
    position, corners = fields["position"].values, fields["triangle_marker"].values
    words = {"strain": "principal strain", "rigid_residual": "less rigid motion"}.get(name, name.replace("_", " "))
    if name in _ARROWS:
        vectors = fields[name].values
        largest = float(np.nanmax(np.hypot(vectors[..., 0], vectors[..., 1]), initial=0.0))
        words += f", longest {largest:.3g} {fields[name].attrs['units']}"
        if name != "displacement" and largest:
            rest = fields["rest"].values[~np.isnan(fields["rest"].values).any(axis=1)]
            spacing = float(np.median(nearest_neighbours(rest)[1])) if len(rest) > 1 else 1.0
            vectors = vectors * (_LONGEST * spacing / largest)
    elif name in _COLOURS:
        # Where markers have values, triangles have the mean of their corners.
        values = larger_principal(fields[name].values) if name == "strain" else fields[name].values[:, corners].mean(2)
        largest = float(np.nanmax(np.abs(values), initial=0.0))
        words += f", up to {100 * largest:.3g} %"

    def draw(number: int, pen: _Pen) -> str:
        if name in _COLOURS and largest:
            pen.colour(position[number][corners], values[number] / largest)
        if name in _ARROWS:
            for point, vector in zip(position[number], vectors[number], strict=True):
                pen.arrow(point, vector, _ARROW)
        pen.cross(fields["contact_centroid"].values[number])
        return words

    return _draw_all(frames, fields, "fields", draw)


def _check_pixels(moving: xr.Dataset, name: str) -> None:
    if moving["position"].attrs["units"] != "px":
        raise InputError(f"{name}: position", "is in m", "needs px, to be drawn on frames")


def _draw_all(
    frames: Iterable[Frame], moving: xr.Dataset, name: str, draw: Callable[[int, _Pen], str]
) -> Iterator[Frame]:
    """Yield frames in colour with what `draw` draws on the one of each number, and its words behind the time."""
    frames, cv2 = iter(frames), opencv()
    for number, time in enumerate(moving["time"].values):
        frame = next(frames, None)
        if frame is None:
            needed = moving.sizes["time"]
            raise InputError("frames", f"got {number}", f"needs {needed}, as many as the {name} have times")
        picture = cv2.cvtColor(frame, cv2.COLOR_GRAY2BGR) if frame.ndim == 2 else frame.copy()
        pen = _Pen(cv2, picture, max(round(frame.shape[0] / _REFERENCE_HEIGHT), 1))
        pen.write(f"{time:.3f} s   {draw(number, pen)}")
        yield picture


@dataclass(frozen=True)
class _Pen:
    """What draws on a picture."""

    cv2: Any
    picture: Frame  # (height, width, 3), what is drawn on, in place
    line: int  # width of a thin line [px]

    def circle(self, centre: Floats, radius: float, colour: Colour, bold: int = 1) -> None:
        """Draw a circle of a radius [px], lines `bold` times as wide as thin ones."""
        size = round(radius * 2**_FINE)
        self.cv2.circle(self.picture, _fixed_point(centre), size, colour, self.line * bold, self.cv2.LINE_AA, _FINE)

    def segment(self, start: Floats, end: Floats, colour: Colour, bold: int = 1) -> None:
        """Draw a straight line."""
        ends, width = (_fixed_point(start), _fixed_point(end)), self.line * bold
        self.cv2.line(self.picture, *ends, colour, width, self.cv2.LINE_AA, _FINE)

    def arrow(self, start: Floats, vector: Floats, colour: Colour) -> None:
        """Draw a shaft and both sides of a head; nothing where the arrow is shorter than half a pixel."""
        length = float(np.hypot(*vector))
        if length > 0.5 and np.isfinite(vector).all():
            tip, back = start + vector, vector * (min(0.35 * length, 5.0 * self.line) / length)
            side = 0.6 * np.array([-back[1], back[0]])
            for first, last in pairwise([start, tip, tip - back + side, tip, tip - back - side]):
                self.segment(first, last, colour)

    def cross(self, centre: Floats) -> None:
        """Draw a cross, white with a black shadow as words are, so that it is seen on any ground."""
        if np.isfinite(centre).all():
            arm = 8.0 * self.line
            for shift, colour in ((2.0 * self.line, _BLACK), (0.0, _WHITE)):
                for side in ((arm, 0.0), (0.0, arm)):
                    self.segment(centre + shift - side, centre + shift + side, colour, bold=2)

    def colour(self, triangles: Floats, values: Floats) -> None:
        """Lay colours over (n, 3, 2) triangles [px] of values from -1 to 1, none where one is NaN."""
        colour, share = self.picture.copy(), np.zeros(self.picture.shape[:2], dtype=np.float32)
        for corners, value in zip(triangles, values, strict=True):
            if np.isfinite(value) and np.isfinite(corners).all():
                points = np.round(corners).astype(np.int32)
                self.cv2.fillConvexPoly(colour, points, _ABOVE if value > 0 else _BELOW)
                self.cv2.fillConvexPoly(share, points, _DENSEST * abs(float(value)))
        mixed = np.round(self.picture + share[..., None] * (colour.astype(np.float32) - self.picture))
        self.picture[:] = mixed.astype(np.uint8)

    def write(self, text: str) -> None:
        """Write in the upper left corner, white with a black shadow."""
        for shift, colour in ((1, _BLACK), (0, _WHITE)):
            corner = (8 * self.line + shift, 18 * self.line + shift)
            font, size = self.cv2.FONT_HERSHEY_SIMPLEX, 0.45 * self.line
            self.cv2.putText(self.picture, text, corner, font, size, colour, self.line, self.cv2.LINE_AA)


def _fixed_point(point: Any) -> tuple[int, int]:
    """Return a place in the fractions of a pixel in which OpenCV draws, held inside what its integers take."""
    x, y = np.clip(np.round(np.asarray(point) * 2**_FINE), -(2**30), 2**30)
    return int(x), int(y)
