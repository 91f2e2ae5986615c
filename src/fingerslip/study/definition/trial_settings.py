"""How the runs of a study become trials of a data set: directions, cameras and their errors."""

from __future__ import annotations

from typing import Annotated

import pydantic

from fingerslip.errors import InputError
from fingerslip.parameters import Angle, Duration, NonNegativeLength, NonNegativeNumber, PositiveLength, parameters
from fingerslip.units import Unit
from fingerslip.vision.cameras import PUBLISHED_FRAME_RATE

__all__ = ["TrialSettings"]

_Rate = Annotated[float, Unit("1/s"), pydantic.Field(gt=0, le=1e4)]
_Pixels = Annotated[int, pydantic.Field(ge=16, le=8192)]
_Count = Annotated[int, pydantic.Field(ge=1, le=360)]
_Seed = Annotated[int, pydantic.Field(ge=0, lt=2**63)]


@parameters
class TrialSettings:
    """How the runs of a study become trials; ``fingerslip detect simulate`` makes the data set.

    Every run of a study with samples is one trial: samples take turns through the directions, so that their number is
    that of directions times repeats. Without samples every run is done in all directions. No published sensor prints
    the values of its cameras: every default here is assumed.

    Parameters
    ----------
    directions : int
        Directions of the slide or fall, evenly over a turn. The run goes along +x; the others are that run turned,
        which is exact for an upright sensor whose rings all have a multiple of so many markers.
    rest : float
        Time at rest that is filmed before the slide [s]; the last part of the hold.
    frame_rate : float
        Frames a second of both cameras [1/s].
    distance : float
        From the lenses to the markers [m].
    view_width : float
        Length that the width of both images shows at the markers [m].
    width, height : int
        Size of the images [px].
    noise : (float, float)
        Smallest and largest standard deviation of the positions in a trial [px].
    shift : float
        Cameras are placed beside the axis by up to this along both axes, anew in each trial [m].
    turn : float
        Cameras are turned about their axis by up to this, anew in each trial [rad].
    hidden : float
        Skin deeper than this inside the convex hull of the outside is in a groove, and must not touch [m]; it is
        watched.
    patch : float
        Distance of neighbouring contact patches [m]: within each the traction is constant.
    seed : int
        Seed of everything random but the samples.
    """

    directions: _Count = 8
    rest: Duration = 1.5
    frame_rate: _Rate = PUBLISHED_FRAME_RATE
    distance: PositiveLength = 50e-3
    view_width: PositiveLength = 45e-3
    width: _Pixels = 640
    height: _Pixels = 480
    noise: tuple[NonNegativeNumber, NonNegativeNumber] = (0.0061, 0.05)
    shift: NonNegativeLength = 0.5e-3
    turn: Angle = 0.0175
    hidden: PositiveLength = 0.3e-3
    patch: PositiveLength = 1e-3
    seed: _Seed = 0

    def __post_init__(self) -> None:
        if self.noise[0] > self.noise[1]:
            raise InputError("noise", f"goes from {self.noise[0]:g} to {self.noise[1]:g}", "needs the smallest first")

    @property
    def metres_per_pixel(self) -> float:
        """Length of a pixel at the markers [m]."""
        return self.view_width / self.width
