"""The outer skin outline as a curve by arc length, points below it, and the depths of fingerprint and epidermis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerslip.arrays import Floats, Integers
from fingerslip.specimens.fingertip.numbers import FingertipNumbers, RidgeZone, SagittalOutline

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
    points, tangents = _ellipse(outline.half_width, outline.half_height, -1.5 * np.pi, 0.5 * np.pi)
    return _curve(points, tangents, start=(len(points) - 1) // 2, closed=True)


def _sagittal(outline: SagittalOutline) -> Curve:
    # The layers below lean by up to the slope at the cut; one half height beyond it is ample.
    beyond = -outline.pad_length - outline.half_height
    x, share = _steps(beyond, 0.0), outline.pad_rise / outline.pad_length**2
    pad = np.column_stack([x, -outline.half_height + share * x**2])
    pad_tangents = _unit(np.column_stack([np.ones_like(x), 2 * share * x]))
    tip, tip_tangents = _ellipse(outline.tip_length, outline.half_height, -np.pi / 2, np.pi / 2)
    x = _steps(0.0, beyond)
    back = np.column_stack([x, np.full_like(x, outline.half_height)])
    points = np.vstack([pad[:-1], tip[:-1], back])
    tangents = np.vstack([pad_tangents[:-1], tip_tangents[:-1], np.tile([-1.0, 0.0], (len(x), 1))])
    return _curve(points, tangents, start=len(pad) - 1, closed=False)


def _ellipse(width: float, height: float, first: float, last: float) -> tuple[Floats, Floats]:
    count = 2 * int(np.ceil((last - first) * max(width, height) / _SPACING / 2)) + 1
    angle = np.linspace(first, last, count)
    points = np.column_stack([width * np.cos(angle), height * np.sin(angle)])
    return points, _unit(np.column_stack([-width * np.sin(angle), height * np.cos(angle)]))


def _steps(first: float, last: float) -> Floats:
    return np.linspace(first, last, int(np.ceil(abs(last - first) / _SPACING)) + 1)


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def _curve(points: Floats, tangents: Floats, start: int, closed: bool) -> Curve:
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return Curve(length - length[start], points, tangents, closed)


def position(curve: Curve, arc_length: Floats) -> Floats:
    """Return the (n, 2) points of `curve` [m] at (n,) arc lengths [m]."""
    return _interpolate(curve, curve.points, arc_length)


def inward_normal(curve: Curve, arc_length: Floats) -> Floats:
    """Return the (n, 2) unit normals [-] into the finger at (n,) arc lengths [m]."""
    tangent = _unit(_interpolate(curve, curve.tangents, arc_length))
    return np.column_stack([-tangent[:, 1], tangent[:, 0]])


def _interpolate(curve: Curve, values: Floats, arc_length: Floats) -> Floats:
    return np.column_stack([np.interp(arc_length, curve.arc_length, component) for component in values.T])


def at_depth(curve: Curve, arc_length: Floats, depth: Floats | float) -> Floats:
    """Return the (n, 2) points at `depth` [m] below the outline, negative above it."""
    inward = np.broadcast_to(np.asarray(depth, dtype=float), np.shape(arc_length))
    return position(curve, arc_length) + inward[:, None] * inward_normal(curve, arc_length)


def nearest(points: Floats, places: Floats) -> tuple[Floats, Integers]:
    """Return how far places (n, dim) are from the nearest of some points (m, dim) [m], and the rows of these points."""
    # SciPy's trees are slow to import, and only meshes need them.
    from scipy.spatial import cKDTree

    distances, rows = cKDTree(points).query(places)
    return distances, rows


def arc_length_at_cut(fingertip: FingertipNumbers, curve: Curve, depth: float) -> tuple[float, float]:
    """Return the arc lengths at which the curve at `depth` meets its palmar and its dorsal end.

    The ends are the proximal cut of the sagittal section; a transverse section is closed and ends on its back.
    """
    s = curve.arc_length
    if curve.closed:
        return float(s[0]), float(s[-1])
    beyond = at_depth(curve, s, depth)[:, 0] + fingertip.sagittal.pad_length
    crossing = np.flatnonzero(np.diff(np.sign(beyond)))
    ends = []
    for k in (crossing[0], crossing[-1]):
        share = beyond[k] / (beyond[k] - beyond[k + 1])
        ends.append(float(s[k] + share * (s[k + 1] - s[k])))
    return ends[0], ends[1]


def fade(zone: RidgeZone, arc_length: Floats) -> Floats:
    """Return the share [-] of ridges and ripples at arc lengths (n,) [m]: 1 in the zone, smoothly to 0 at its ends."""
    inside = np.minimum(arc_length - zone.start, zone.end - arc_length)
    return smooth_step(inside / zone.fade)


def smooth_step(share: Floats) -> Floats:
    """Return shares that grow from 0 to 1, without bends at both ends."""
    clipped = np.clip(share, 0.0, 1.0)
    return np.asarray(clipped**2 * (3.0 - 2.0 * clipped))


def surface_depth(fingertip: FingertipNumbers, arc_length: Floats) -> Floats:
    """Return the depth [m] of the outer skin surface at arc lengths (n,) [m]: negative on fingerprint crests."""
    fingerprint = fingertip.fingerprint
    if not fingerprint.enabled:
        return np.zeros_like(arc_length)
    ripple = np.cos(2 * np.pi * arc_length / fingerprint.pitch + fingerprint.phase)
    return np.asarray(-0.5 * fingerprint.height * ripple * fade(fingertip.zone, arc_length))


def interface_depth(fingertip: FingertipNumbers, arc_length: Floats) -> Floats:
    """Return the depth [m] of the epidermis-dermis interface at arc lengths (n,) [m]; mean: the epidermis thickness."""
    thickness = fingertip.layers.epidermis_thickness
    if not fingertip.ridges.enabled:
        return np.full_like(arc_length, thickness)
    # Squared cosines, both kinds of ridges in turn.
    ridges, wave = fingertip.ridges, np.cos(2 * np.pi * arc_length / fingertip.ridges.pitch)
    height = np.where(wave > 0.0, ridges.intermediate_height, ridges.limiting_height)
    profile = height * wave**2 - ridges.mean_height
    return np.asarray(thickness + profile * fade(fingertip.zone, arc_length))
