"""The parts of a TacTip: dome, skin with its ridges, rods, markers and window."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import pydantic

from fingerslip.arrays import Floats, Integers
from fingerslip.errors import InputError
from fingerslip.marker_layouts import MarkerLayout, hexagonal_layout, ring_layout
from fingerslip.parameters import NonNegativeLength, PositiveLength, parameters
from fingerslip.units import millimetres

_Count = Annotated[int, pydantic.Field(ge=1, le=1000)]


@parameters
class Dome:
    """The surface that the outermost points of the skin lie on, about the axis of the sensor.

    It is flat up to `flat_radius`, then turns with `radius` until it is upright; above that it is straight.
    """

    radius: Annotated[PositiveLength, "Radius of the dome, or of the rounded edge of a flat sensor [m]."]
    height: Annotated[PositiveLength, "From the lowest point to the window [m]."]
    flat_radius: Annotated[NonNegativeLength, "Radius of the flat middle [m]; 0 for a dome."] = 0.0


@parameters
class Ridges:
    """Concentric undulations of the skin, outside and inside, with a crown on the axis.

    Crowns and valleys are arcs. Flanks are upright where the height is at least half the pitch.
    """

    enabled: Annotated[bool, "Whether the skin has ridges; without them it is smooth."]
    pitch: Annotated[PositiveLength, "From crown to crown, along the outermost surface [m]."]
    height: Annotated[PositiveLength, "From the crown to the valley beside it [m]."]
    number: Annotated[_Count, "Ridges around the one on the axis."]

    @property
    def steepness(self) -> float:
        """Angle of the flanks to the surface [rad]."""
        return min(np.pi / 2, 2.0 * float(np.arctan(2.0 * self.height / self.pitch)))

    @property
    def bend_radius(self) -> float:
        """Radius of the middle of the skin at crowns and in valleys [m]."""
        return self.pitch / (4.0 * float(np.sin(self.steepness)))


@parameters
class Skin:
    """The skin."""

    thickness: Annotated[PositiveLength, "Thickness [m]."]
    ridges: Annotated[Ridges, "Its undulations."]

    def __post_init__(self) -> None:
        least = 2.0 * self.ridges.bend_radius
        if self.ridges.enabled and self.thickness >= least:
            allowed = f"needs < {millimetres(least)}, where the skin fills its grooves"
            raise InputError("thickness", f"got {millimetres(self.thickness)}", allowed, "or make the pitch larger")

    @property
    def relief(self) -> float:
        """From crowns to valleys [m]; 0 for a smooth skin."""
        return self.ridges.height if self.ridges.enabled else 0.0


@parameters
class Rods:
    """Rigid rods from the skin into the gel, along the normal of the dome; their inner ends carry the markers."""

    radius: Annotated[PositiveLength, "Radius, in 2D half the width [m]."]
    embedding: Annotated[PositiveLength, "How far a rod reaches into the skin under its crown [m]."]
    length: Annotated[PositiveLength, "From the innermost points of the skin to the marker [m]."]


@parameters
class Markers:
    """Where the internal markers are: concentric rings, or a hexagonal grid."""

    layout: Annotated[Literal["rings", "hexagonal"], "Arrangement."]
    rings: Annotated[tuple[_Count, ...], "Markers of each ring from the axis outwards, of `rings`."]
    layers: Annotated[_Count, "Hexagons around the middle, of `hexagonal`: n layers are 1 + 3 n (n + 1) markers."]
    spacing: Annotated[
        PositiveLength, "From ring to ring, or from neighbour to neighbour, along the outermost surface [m]."
    ]

    def __post_init__(self) -> None:
        if not self.rings or self.rings[0] != 1 or any(count % 2 for count in self.rings[1:]):
            fault = f"got {', '.join(map(str, self.rings)) or 'none'}"
            raise InputError("rings", fault, "needs 1 on the axis and even numbers around it")

    @property
    def places(self) -> MarkerLayout:
        """All markers, flattened: their distances from the middle are arc lengths on the dome, y is towards +z."""
        if self.layout == "rings":
            return ring_layout(self.spacing, self.rings)
        return hexagonal_layout(self.spacing, self.layers)


@parameters
class Window:
    """The rigid window on which the gel and the rim of the skin are fixed."""

    thickness: Annotated[PositiveLength, "Thickness [m]."]


# Points on an arc of a ridge, and the longest distance of two on the plain skin [m]; cubic splines join them.
_ON_ARC = 7
_LONGEST = 1e-3


def place_points(dome: Dome, along: Floats, depth: Floats | float) -> Floats:
    """Return the points (n, 2) [m], distance from the axis and height above the lowest point, of a dome.

    They are at arc lengths `along` (n,) from the axis along the outermost surface, at a `depth` along its normal [m].
    """
    turned = np.clip((along - dome.flat_radius) / dome.radius, 0.0, np.pi / 2)
    straight = np.maximum(along - dome.flat_radius - 0.5 * np.pi * dome.radius, 0.0)
    inside = dome.radius - depth
    distance = np.minimum(along, dome.flat_radius) + inside * np.sin(turned)
    height = dome.radius - inside * np.cos(turned) + straight
    return np.column_stack([distance, height])


@dataclass(frozen=True)
class SkinLines:
    """The outer and the inner line of the skin, from the axis to the window, finely sampled."""

    outer: Floats  # (n, 2), distance from the axis and height [m]
    inner: Floats  # (n, 2), distance from the axis and height [m]
    corners: Integers  # (k,), rows at which smooth pieces of both lines begin and end: crowns, valleys and both ends


def skin_lines(dome: Dome, skin: Skin, spacing: float) -> SkinLines:
    """Return the lines of the skin of a sensor, on the plain skin with points about as far apart as the spacing [m]."""
    step = spacing / np.ceil(spacing / _LONGEST)
    if not skin.ridges.enabled:
        lines = [_to_window(dome, np.array([[0.0, depth]]), step) for depth in (0.0, skin.thickness)]
        return SkinLines(lines[0], lines[1], np.array([0, len(lines[0]) - 1]))
    ridges, half = skin.ridges, skin.thickness / 2
    far, near = ridges.bend_radius + half, ridges.bend_radius - half
    centres = (far, ridges.height - near)
    # Arc lengths and depths of both lines up to the valley behind the last ridge.
    waves = [_waves(ridges, radii, centres) for radii in ((far, near), (near, far))]
    corners = np.linspace(0, len(waves[0]) - 1, 2 * ridges.number + 2).round().astype(np.int64)
    outer, inner = (_to_window(dome, line, step) for line in waves)
    return SkinLines(outer, inner, np.append(corners, len(outer) - 1))


def _waves(ridges: Ridges, radii: tuple[float, float], centres: tuple[float, float]) -> Floats:
    """Return a line over all ridges, by the radii and depths of centres [m] of the arcs of crowns and valleys.

    It is the half wave from a crown to the valley beside it, and then waves of two mirrored ones.
    """
    angle = np.linspace(0.0, ridges.steepness, _ON_ARC)
    crown = np.column_stack([radii[0] * np.sin(angle), centres[0] - radii[0] * np.cos(angle)])
    valley = np.column_stack([ridges.pitch / 2 - radii[1] * np.sin(angle), centres[1] + radii[1] * np.cos(angle)])
    meets = np.allclose(crown[-1], valley[-1], rtol=0.0, atol=1e-9)
    half = np.vstack([crown, valley[-2 if meets else -1 :: -1]])
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
