"""The outer skin outline as a curve by arc length, and points at a depth below it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.specimens.fingertip.numbers import FingertipNumbers, SagittalOutline, TransverseOutline

__all__ = ["Curve", "arc_length_at_cut", "at_depth", "inward_normal", "outline_curve", "position"]

Floats = NDArray[np.float64]

_SPACING = 1e-5


@dataclass(frozen=True)
class Curve:
    """A finely sampled plane curve that runs counter-clockwise round the finger."""

    arc_length: Floats  # (n,), arc length from the lowest point of the skin [m], increasing
    points: Floats  # (n, 2), positions [m]
    tangents: Floats  # (n, 2), unit tangents
    closed: bool  # whether the last point is the first one again


def outline_curve(fingertip: FingertipNumbers) -> Curve:
    """Return the mean outer skin surface, without fingerprint.

    In the sagittal section the curve goes on beyond the proximal cut, far enough for the layers below it to reach
    the cut.
    """
    outline = fingertip.outline
    if isinstance(outline, SagittalOutline):
        return _sagittal(outline)
    return _transverse(outline)


def position(curve: Curve, arc_length: Floats) -> Floats:
    """Return the (n, 2) points of `curve` [m] at (n,) arc lengths [m]."""
    return _interpolate(curve, curve.points, arc_length)


def inward_normal(curve: Curve, arc_length: Floats) -> Floats:
    """Return the (n, 2) unit normals [-] into the finger at (n,) arc lengths [m]."""
    tangent = _interpolate(curve, curve.tangents, arc_length)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    return np.column_stack([-tangent[:, 1], tangent[:, 0]])


def at_depth(curve: Curve, arc_length: Floats, depth: Floats | float) -> Floats:
    """Return the (n, 2) points at `depth` [m] below the outline, negative above it."""
    inward = np.broadcast_to(np.asarray(depth, dtype=float), np.shape(arc_length))
    return position(curve, arc_length) + inward[:, None] * inward_normal(curve, arc_length)


def arc_length_at_cut(fingertip: FingertipNumbers, curve: Curve, depth: float) -> tuple[float, float]:
    """Return the arc lengths at which the curve at `depth` meets its palmar and its dorsal end.

    The ends are the proximal cut of the sagittal section; a transverse section is closed and ends on its back.
    """
    if curve.closed:
        return float(curve.arc_length[0]), float(curve.arc_length[-1])
    beyond = at_depth(curve, curve.arc_length, depth)[:, 0] + fingertip.sagittal.pad_length
    crossing = np.flatnonzero(np.diff(np.sign(beyond)))
    first, last = (_root(curve.arc_length, beyond, index) for index in (crossing[0], crossing[-1]))
    return first, last


def _root(arc_length: Floats, values: Floats, index: np.intp) -> float:
    share = values[index] / (values[index] - values[index + 1])
    return float(arc_length[index] + share * (arc_length[index + 1] - arc_length[index]))


def _interpolate(curve: Curve, values: Floats, arc_length: Floats) -> Floats:
    return np.column_stack([np.interp(arc_length, curve.arc_length, component) for component in values.T])


def _sagittal(outline: SagittalOutline) -> Curve:
    # The layers below lean by up to the slope at the cut; one half height beyond it is ample.
    beyond = -outline.pad_length - outline.half_height
    pad = _pad(outline, _steps(beyond, 0.0))
    tip = _ellipse(outline.tip_length, outline.half_height, -np.pi / 2, np.pi / 2)
    x = _steps(0.0, beyond)
    back = np.column_stack([x, np.full_like(x, outline.half_height)])
    flat = np.tile([-1.0, 0.0], (len(x), 1))
    points = np.vstack([pad[0][:-1], tip[0][:-1], back])
    tangents = np.vstack([pad[1][:-1], tip[1][:-1], flat])
    return _curve(points, tangents, start=len(pad[0]) - 1, closed=False)


def _pad(outline: SagittalOutline, x: Floats) -> tuple[Floats, Floats]:
    share = outline.pad_rise / outline.pad_length**2
    points = np.column_stack([x, -outline.half_height + share * x**2])
    return points, _unit(np.column_stack([np.ones_like(x), 2 * share * x]))


def _transverse(outline: TransverseOutline) -> Curve:
    points, tangents = _ellipse(outline.half_width, outline.half_height, -1.5 * np.pi, 0.5 * np.pi)
    return _curve(points, tangents, start=(len(points) - 1) // 2, closed=True)


def _ellipse(width: float, height: float, first: float, last: float) -> tuple[Floats, Floats]:
    count = 2 * int(np.ceil((last - first) * max(width, height) / _SPACING / 2)) + 1
    angle = np.linspace(first, last, count)
    points = np.column_stack([width * np.cos(angle), height * np.sin(angle)])
    return points, _unit(np.column_stack([-width * np.sin(angle), height * np.cos(angle)]))


def _steps(first: float, last: float) -> Floats:
    return np.linspace(first, last, int(np.ceil(abs(last - first) / _SPACING)) + 1)


def _unit(vectors: Floats) -> Floats:
    unit: Floats = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return unit


def _curve(points: Floats, tangents: Floats, start: int, closed: bool) -> Curve:
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return Curve(length - length[start], points, tangents, closed)
