"""The lines of the skin in a plane through the axis, and where a depth below the outermost surface is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.specimens.tactip.parts import Dome, Ridges, Skin

__all__ = ["SkinLines", "inward", "place_points", "skin_lines"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Points on an arc of a ridge, and the longest distance of two on the plain skin [m]; cubic splines join them.
_ON_ARC = 7
_LONGEST = 1e-3


@dataclass(frozen=True)
class SkinLines:
    """The outer and the inner line of the skin, from the axis to the window, finely sampled."""

    outer: Floats  # (n, 2), distance from the axis and height [m]
    inner: Floats  # (n, 2), distance from the axis and height [m]
    corners: Integers  # (k,), rows at which smooth pieces of both lines begin and end: crowns, valleys and both ends


def place_points(dome: Dome, along: Floats, depth: Floats) -> Floats:
    """Return the points at arc lengths from the axis and depths below the outermost surface.

    Parameters
    ----------
    dome : Dome
        The outermost surface.
    along : (n,) array
        Arc length along the outermost surface, from the axis [m].
    depth : (n,) array
        Depth along its normal [m].

    Returns
    -------
    (n, 2) array
        Distance from the axis and height above the lowest point [m].
    """
    turned = np.clip((along - dome.flat_radius) / dome.radius, 0.0, np.pi / 2)
    straight = np.maximum(along - dome.flat_radius - 0.5 * np.pi * dome.radius, 0.0)
    inside = dome.radius - depth
    distance = np.minimum(along, dome.flat_radius) + inside * np.sin(turned)
    height = dome.radius - inside * np.cos(turned) + straight
    return np.column_stack([distance, height])


def inward(dome: Dome, along: Floats) -> Floats:
    """Return the unit vectors into the sensor, normal to the outermost surface at arc lengths (n,), shape (n, 2)."""
    turned = np.clip((along - dome.flat_radius) / dome.radius, 0.0, np.pi / 2)
    return np.column_stack([-np.sin(turned), np.cos(turned)])


def skin_lines(dome: Dome, skin: Skin, spacing: float) -> SkinLines:
    """Return the lines of the skin of a sensor.

    Units: spacing [m].
    """
    step = spacing / np.ceil(spacing / _LONGEST)
    if not skin.ridges.enabled:
        lines = [_to_window(dome, np.array([[0.0, depth]]), step) for depth in (0.0, skin.thickness)]
        return SkinLines(lines[0], lines[1], np.array([0, len(lines[0]) - 1]))
    waves = _ridge_line(skin.ridges, skin.thickness)
    corners = np.linspace(0, len(waves[0]) - 1, 2 * skin.ridges.number + 2).round().astype(np.int64)
    outer, inner = (_to_window(dome, line, step) for line in waves)
    return SkinLines(outer, inner, np.append(corners, len(outer) - 1))


def _ridge_line(ridges: Ridges, thickness: float) -> tuple[Floats, Floats]:
    """Return arc lengths and depths of both lines up to the valley behind the last ridge."""
    far, near = ridges.bend_radius + thickness / 2, ridges.bend_radius - thickness / 2
    centres = (far, ridges.height - near)
    outer, inner = (_half_wave(ridges, radii, centres) for radii in ((far, near), (near, far)))
    return _repeat(outer, ridges), _repeat(inner, ridges)


def _half_wave(ridges: Ridges, radii: tuple[float, float], centres: tuple[float, float]) -> Floats:
    """Return a line from a crown to the valley beside it, of the radii and depths of centres [m] of both arcs."""
    angle = np.linspace(0.0, ridges.steepness, _ON_ARC)
    crown = np.column_stack([radii[0] * np.sin(angle), centres[0] - radii[0] * np.cos(angle)])
    valley = np.column_stack([ridges.pitch / 2 - radii[1] * np.sin(angle), centres[1] + radii[1] * np.cos(angle)])
    meets = np.allclose(crown[-1], valley[-1], rtol=0.0, atol=1e-9)
    return np.vstack([crown, valley[-2 if meets else -1 :: -1]])


def _repeat(half: Floats, ridges: Ridges) -> Floats:
    """Return the line over all ridges: the half wave, and then waves of two mirrored ones."""
    up = np.column_stack([ridges.pitch - half[:, 0], half[:, 1]])[::-1]
    wave = np.vstack([up[1:], (half + np.array([ridges.pitch, 0.0]))[1:]])
    waves = [wave + np.array([number * ridges.pitch, 0.0]) for number in range(ridges.number)]
    return np.vstack([half, *waves])


def _to_window(dome: Dome, line: Floats, step: float) -> Floats:
    """Return the points of a line in 2D, continued at its last depth up to the window."""
    last, depth = line[-1]
    # The same number of points for both lines of a skin.
    between = np.arange(1, np.ceil((_end(dome, 0.0) - last) / step - 0.5)) * step
    end = _end(dome, depth)
    rest = np.append(last + between * min(1.0, (end - last) / (_end(dome, 0.0) - last)), end)
    along = np.concatenate([line[:, 0], rest])
    points = place_points(dome, along, np.concatenate([line[:, 1], np.full(len(rest), depth)]))
    points[-1, 1] = dome.height
    return points


def _end(dome: Dome, depth: float) -> float:
    """Return the arc length at which a depth reaches the window [m]."""
    above = dome.height - dome.radius
    if above >= 0.0:
        return dome.flat_radius + 0.5 * np.pi * dome.radius + above
    turned = float(np.arccos(np.clip(-above / (dome.radius - depth), -1.0, 1.0)))
    return dome.flat_radius + dome.radius * turned
