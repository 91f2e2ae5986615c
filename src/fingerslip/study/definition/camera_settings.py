"""Cameras of a study: from where its sensor is filmed, and how good the pictures are."""

from __future__ import annotations

from typing import Annotated, Literal

import pydantic

from fingerslip.errors import InputError
from fingerslip.parameters import Duration, NonNegativeNumber, PositiveLength, parameters
from fingerslip.units import Unit

__all__ = ["CameraKind", "CameraSettings"]

#: `internal` looks at the markers inside a sensor, `external` through the plate at those on its skin.
CameraKind = Literal["internal", "external"]

_FrameRate = Annotated[float, Unit("1/s"), pydantic.Field(gt=0, le=1e4)]
_Pixels = Annotated[int, pydantic.Field(ge=16, le=8192)]
_Seed = Annotated[int, pydantic.Field(ge=0, lt=2**63)]
_Quality = Annotated[int, pydantic.Field(ge=1, le=100)]


@parameters
class CameraSettings:
    """A camera of a study; no published sensor prints these values, so every default is assumed.

    Parameters
    ----------
    tier : {'pixel', 'point'}
        Frames, a video and the tracker, or positions with the errors of the tracker at once.
    distance : float
        From the lens to the markers, the lowest ones for the external camera [m].
    view_width : float
        Length that the width of the image shows at the markers [m].
    width, height : int
        Size of the image [px].
    lens : {'pinhole', 'fisheye'}
        Kind of the lens.
    frame_rate : float
        Frames a second [1/s].
    exposure : float
        Exposure of a frame [s].
    marker_radius : float
        Radius of the markers [m].
    markers : {'bright', 'dark'}
        Whether markers are brighter than what is around them.
    light : {'even', 'harsh'}
        The light: even, or with vignette, gradient, texture, glare and a bright ring.
    noise : float
        Standard deviation of the noise of a pixel [grey levels].
    jpeg_quality : int, optional
        Quality of the compression of each frame; none without it.
    rest : float
        Time that is filmed before the motion begins [s]: the tracker needs markers at rest.
    seed : int
        Seed of everything random: the same seed gives the same frames.
    """

    tier: Literal["pixel", "point"] = "pixel"
    distance: PositiveLength = 50e-3
    view_width: PositiveLength = 45e-3
    width: _Pixels = 640
    height: _Pixels = 480
    lens: Literal["pinhole", "fisheye"] = "pinhole"
    frame_rate: _FrameRate = 30.0
    exposure: Duration = 10e-3
    marker_radius: PositiveLength = 0.5e-3
    markers: Literal["bright", "dark"] = "bright"
    light: Literal["even", "harsh"] = "even"
    noise: NonNegativeNumber = 2.0
    jpeg_quality: _Quality | None = None
    rest: Duration = 1.0
    seed: _Seed = 0

    def __post_init__(self) -> None:
        if self.exposure > 1.0 / self.frame_rate:
            allowed = f"needs at most a frame, {1e3 / self.frame_rate:.4g} ms"
            raise InputError("exposure", f"got {1e3 * self.exposure:g} ms", allowed)
