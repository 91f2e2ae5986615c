"""The parts of a TacTip: dome, skin with its ridges, rods, markers and window."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
import pydantic

from fingerslip.errors import InputError
from fingerslip.parameters import NonNegativeLength, PositiveLength, parameters
from fingerslip.units import millimetres

_Count = Annotated[int, pydantic.Field(ge=1, le=1000)]


@parameters
class Dome:
    """The surface that the outermost points of the skin lie on, about the axis of the sensor.

    It is flat up to `flat_radius`, then turns with `radius` until it is upright; above that it is straight.

    Parameters
    ----------
    radius : float
        Radius of the dome, or of the rounded edge of a flat sensor [m].
    height : float
        From the lowest point to the window [m].
    flat_radius : float
        Radius of the flat middle [m]; 0 for a dome.
    """

    radius: PositiveLength
    height: PositiveLength
    flat_radius: NonNegativeLength = 0.0


@parameters
class Ridges:
    """Concentric undulations of the skin, outside and inside, with a crown on the axis.

    Crowns and valleys are arcs. Flanks are upright where the height is at least half the pitch.

    Parameters
    ----------
    enabled : bool
        Whether the skin has ridges; without them it is smooth.
    pitch : float
        From crown to crown, along the outermost surface [m].
    height : float
        From the crown to the valley beside it [m].
    number : int
        Ridges around the one on the axis.
    """

    enabled: bool
    pitch: PositiveLength
    height: PositiveLength
    number: _Count

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
    """The skin.

    Parameters
    ----------
    thickness : float
        Thickness [m].
    ridges : Ridges
        Its undulations.
    """

    thickness: PositiveLength
    ridges: Ridges

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
    """Rigid rods from the skin into the gel, along the normal of the dome; their inner ends carry the markers.

    Parameters
    ----------
    radius : float
        Radius, in 2D half the width [m].
    embedding : float
        How far a rod reaches into the skin under its crown [m].
    length : float
        From the innermost points of the skin to the marker [m].
    """

    radius: PositiveLength
    embedding: PositiveLength
    length: PositiveLength


@parameters
class Markers:
    """Where the internal markers are: concentric rings, or a hexagonal grid.

    Parameters
    ----------
    layout : {'rings', 'hexagonal'}
        Arrangement.
    rings : tuple of int
        Markers of each ring from the axis outwards, of `rings`.
    layers : int
        Hexagons around the middle, of `hexagonal`: n layers are 1 + 3 n (n + 1) markers.
    spacing : float
        From ring to ring, or from neighbour to neighbour, along the outermost surface [m].
    """

    layout: Literal["rings", "hexagonal"]
    rings: tuple[_Count, ...]
    layers: _Count
    spacing: PositiveLength

    def __post_init__(self) -> None:
        if not self.rings or self.rings[0] != 1 or any(count % 2 for count in self.rings[1:]):
            fault = f"got {', '.join(map(str, self.rings)) or 'none'}"
            raise InputError("rings", fault, "needs 1 on the axis and even numbers around it")


@parameters
class Window:
    """The rigid window on which the gel and the rim of the skin are fixed.

    Parameters
    ----------
    thickness : float
        Thickness [m].
    """

    thickness: PositiveLength
