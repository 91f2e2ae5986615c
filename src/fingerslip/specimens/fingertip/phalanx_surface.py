"""The surface of the distal phalanx in space: sections across the finger, each with the shape of the transverse one.

The section at x lies between the palmar and the dorsal line of the sagittal contour; its width is the phalanx's there.
So the cut z = 0 is the sagittal contour, and the cut x = 0 the transverse one.
"""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.specimens.fingertip.numbers import FingertipNumbers
from fingerslip.specimens.fingertip.phalanx_contour import (
    heights_in_the_middle,
    palmar_face,
    phalanx_contour,
    reaches_cut,
)
from fingerslip.specimens.fingertip.skin_surface import depth_below_skin, skin_section, solid_shape
from fingerslip.units import coordinates, millimetres

__all__ = ["PhalanxSurface", "phalanx_surface"]

Floats = NDArray[np.float64]

_ROW_SPACING = 1e-4
_QUARTER = 24
_CORNER_ROWS = 7
_FACE_ROWS = 16
# Thickness changes little from row to row, and distances to the skin are slow to compute.
_CHECKED = 3


@dataclass(frozen=True)
class PhalanxSurface:
    """Points of the phalanx's surface in rows across the finger."""

    points: Floats  # (rows, columns, 3), positions [m], rows from the proximal to the distal end
    open: bool  # whether the first row lies on the proximal cut


@dataclass(frozen=True)
class _Rows:
    """Position, lowest and highest point in the middle plane, and half width of each row [m]."""

    x: Floats
    low: Floats
    high: Floats
    half_width: Floats
    open: bool


def phalanx_surface(fingertip: FingertipNumbers) -> PhalanxSurface:
    """Return the surface of the phalanx of a fingertip in space.

    Raises
    ------
    InputError
        Where the fingertip has only sections, and where the phalanx leaves no tissue.
    """
    solid_shape(fingertip)
    rows = _scaled_rows(fingertip) if fingertip.phalanx.variant == "scaled" else _rows(fingertip)
    across, up = _shape(fingertip)
    middle, half = (rows.low + rows.high) / 2, (rows.high - rows.low) / 2
    x = np.broadcast_to(rows.x[:, None], (len(rows.x), len(up)))
    y = middle[:, None] + half[:, None] * up
    surface = np.stack([x, y, rows.half_width[:, None] * across], axis=-1)
    _check_tissue(fingertip, surface)
    return PhalanxSurface(surface, rows.open)


def _shape(fingertip: FingertipNumbers) -> tuple[Floats, Floats]:
    """Return the transverse contour, its half width and its half height in the middle plane scaled to one."""
    contour = phalanx_contour(dataclasses.replace(fingertip, section="transverse"))
    palmar, dorsal = heights_in_the_middle(contour)
    half = _right_half(contour)
    across = half[:, 0] / half[:, 0].max()
    up = 2 * (half[:, 1] - palmar) / (dorsal - palmar) - 1.0
    widest = int(across.argmax())
    across, up = _evenly(across, up, [0, widest, len(across) - 1])
    return np.concatenate([across, -across[-2:0:-1]]), np.concatenate([up, up[-2:0:-1]])


def _right_half(contour: Floats) -> Floats:
    """Return the part of a counter-clockwise contour at x >= 0, from its palmar to its dorsal end."""
    ring = contour[:-1]
    first = int(np.flatnonzero((ring[:, 0] > 0.0) & (np.roll(ring[:, 0], 1) <= 0.0))[0])
    right = np.roll(ring, -first, axis=0)
    palmar, dorsal = heights_in_the_middle(contour)
    return np.vstack([[[0.0, palmar]], right[: int(np.argmin(right[:, 0] > 0.0))], [[0.0, dorsal]]])


def _evenly(x: Floats, y: Floats, stops: list[int]) -> tuple[Floats, Floats]:
    """Divide a curve into equal parts between stops, a quarter of the columns each."""
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    pieces = [np.linspace(length[a], length[b], _QUARTER + 1) for a, b in itertools.pairwise(stops)]
    wanted = np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])
    return np.interp(wanted, length, x), np.interp(wanted, length, y)


def _rows(fingertip: FingertipNumbers) -> _Rows:
    """Return the rows of a phalanx with a flat distal end, whose edge is rounded."""
    phalanx, radius = fingertip.phalanx.sagittal, fingertip.phalanx.corner_radius
    start, stop = -fingertip.sagittal.pad_length, phalanx.distal_end - radius
    phalanx_contour(dataclasses.replace(fingertip, section="sagittal"))
    body = _through_origin(start, stop)
    turn = np.linspace(0.0, np.pi / 2, _CORNER_ROWS)[1:]
    shrinking = np.linspace(1.0, 0.0, _FACE_ROWS)[1:]
    x = np.concatenate([body, stop + radius * np.sin(turn), np.full(len(shrinking), phalanx.distal_end)])
    inset = np.concatenate([np.zeros(len(body)), radius * (1 - np.cos(turn)), np.full(len(shrinking), radius)])
    share = np.concatenate([np.ones(len(body) + len(turn)), shrinking])
    low, high = palmar_face(fingertip, np.minimum(x, stop)) + inset, phalanx.dorsal_level - inset
    middle, half = (low + high) / 2, (high - low) / 2
    width = _half_width(fingertip, np.minimum(x, stop)) - inset
    return _Rows(x, middle - share * half, middle + share * half, share * width, open=True)


def _through_origin(start: float, stop: float) -> Floats:
    """Return positions from start to stop, one of them at zero."""
    before = np.linspace(start, 0.0, int(np.ceil(-start / _ROW_SPACING)) + 1)
    return np.concatenate([before[:-1], np.linspace(0.0, stop, int(np.ceil(stop / _ROW_SPACING)) + 1)])


def _half_width(fingertip: FingertipNumbers, x: Floats) -> Floats:
    """Return the half width [m] of the phalanx: base, waist, tuft and end joined by a monotone curve."""
    from scipy.interpolate import PchipInterpolator

    phalanx, widths = fingertip.phalanx, solid_shape(fingertip).phalanx
    places = [-fingertip.sagittal.pad_length, widths.waist_position, 0.0, phalanx.sagittal.distal_end]
    known = [widths.base_half_width, widths.waist_half_width, phalanx.transverse.half_width, widths.end_half_width]
    if widths.end_half_width <= phalanx.corner_radius:
        found, allowed = f"got {millimetres(widths.end_half_width)}", f"needs > {millimetres(phalanx.corner_radius)}"
        raise InputError("solid.phalanx.end_half_width", found, f"{allowed} (phalanx.corner_radius)")
    half_width: Floats = PchipInterpolator(places, known)(x)
    return half_width


def _scaled_rows(fingertip: FingertipNumbers) -> _Rows:
    """Return the rows of the outline moved inward, in both planes."""
    contour = phalanx_contour(dataclasses.replace(fingertip, section="sagittal"))
    first, last = float(contour[:, 0].min()), float(contour[:, 0].max())
    if not first < -fingertip.phalanx.corner_radius < fingertip.phalanx.corner_radius < last:
        found = f"reaches from x = {millimetres(first)} to {millimetres(last)}"
        raise InputError("phalanx", found, "needs to reach to both sides of x = 0", "write a smaller tissue_thickness")
    x = _closing(first, last, reaches_cut(contour))
    low, high = _heights(contour, x)
    across = phalanx_contour(dataclasses.replace(fingertip, section="transverse"))
    width = across[:, 0].max() * _planform(fingertip, x, (first, last), reaches_cut(contour))
    return _Rows(x, low, high, width, reaches_cut(contour))


def _closing(first: float, last: float, is_open: bool) -> Floats:
    """Return positions from first to last, close to each other where the phalanx closes."""
    count = int(np.ceil((last - first) / _ROW_SPACING)) + 1
    ahead = last * np.sin(np.linspace(0.0, np.pi / 2, count))
    behind = np.linspace(0.0, first, count) if is_open else first * np.sin(np.linspace(0.0, np.pi / 2, count))
    return np.concatenate([behind[:0:-1], ahead])


def _heights(contour: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Return the lowest and the highest point of a sagittal contour at positions x [m]."""
    if not reaches_cut(contour):
        contour = np.vstack([np.roll(contour[:-1], -int(contour[:-1, 0].argmin()), axis=0)] * 2)
        contour = contour[: len(contour) // 2 + 1]
    tip = int(contour[:, 0].argmax())
    palmar, dorsal = contour[: tip + 1], contour[tip:][::-1]
    low, high = (np.interp(x, part[:, 0], part[:, 1]) for part in (palmar, dorsal))
    low[-1] = high[-1] = contour[tip, 1]
    return low, high


def _planform(fingertip: FingertipNumbers, x: Floats, ends: tuple[float, float], is_open: bool) -> Floats:
    """Return the half width of a scaled phalanx relative to that at x = 0: the outline from above, moved inward."""
    offset = fingertip.layers.skin_thickness + fingertip.phalanx.tissue_thickness
    tip, widest = fingertip.sagittal.tip_length, fingertip.transverse.half_width
    angle = np.linspace(0.0, np.pi / 2, 500)
    ring = np.column_stack([tip * np.sin(angle), widest * np.cos(angle)])
    normal = np.column_stack([widest * np.sin(angle), tip * np.cos(angle)])
    moved = np.maximum(ring - offset * normal / np.linalg.norm(normal, axis=1, keepdims=True), 0.0)
    order = np.argsort(moved[:, 0], kind="stable")
    ahead = np.interp(np.maximum(x, 0.0) / ends[1], moved[order, 0] / moved[:, 0].max(), moved[order, 1])
    behind = np.maximum(skin_section(fingertip, np.minimum(x, 0.0))[2] - offset, 0.0) / (widest - offset)
    share: Floats = np.where(x > 0.0, ahead / (widest - offset), behind)
    return share if is_open else share * _rounded_end(x, ends[0], min(widest - offset, -ends[0]))


def _rounded_end(x: Floats, first: float, length: float) -> Floats:
    """Return the share of the width where an end that lies inside the finger closes as an ellipse."""
    back = np.clip((first + length - x) / length, 0.0, 1.0)
    share: Floats = np.sqrt(1.0 - back**2)
    return share


def _check_tissue(fingertip: FingertipNumbers, surface: Floats) -> None:
    """Refuse a phalanx that comes nearer to the dermis than a tenth of the skin's thickness."""
    points = surface[::_CHECKED, ::2].reshape(-1, 3)
    thickness = depth_below_skin(fingertip, points) - fingertip.layers.skin_thickness
    needed = 0.1 * fingertip.layers.skin_thickness
    thinnest = int(thickness.argmin())
    if thickness[thinnest] < needed:
        place = coordinates(points[thinnest], 3)
        allowed = f"needs >= {millimetres(needed, 3)} between phalanx and dermis"
        found = f"{millimetres(thickness[thinnest], 3)} of tissue at {place}"
        raise InputError("phalanx", found, allowed, "make the skin thinner or the phalanx smaller")
