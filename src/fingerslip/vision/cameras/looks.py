"""How markers look in pictures: their size and grey levels, the light, and the noise of the sensor. Numbers only.

Nobody publishes these numbers for sensors of this kind: every default is assumed. Grey levels are those of 8 bits, from
0 to 255.
"""

from __future__ import annotations

import math
from typing import Annotated

import pydantic

from fingerslip.parameters import Angle, Fraction, NonNegativeNumber, Number, PositiveLength, Rate, parameters
from fingerslip.units import Unit
from fingerslip.vision.cameras.camera import Camera
from fingerslip.vision.cameras.intrinsics import PositiveNumber

__all__ = [
    "BRIGHT_ON_DARK",
    "DARK_ON_BRIGHT",
    "HARSH_LIGHT",
    "BrightRing",
    "Glare",
    "Lighting",
    "MarkerLook",
    "PixelCamera",
    "SensorNoise",
]

GreyLevel = Annotated[Number, pydantic.Field(ge=0, le=255)]
Softness = Annotated[Number, pydantic.Field(ge=0.5, le=100)]
Change = Annotated[float, Unit("1/s")]


@parameters
class MarkerLook:
    """What markers look like: round spots of one grey level on a background of another, with soft edges.

    Parameters
    ----------
    radius : float
        Radius of a marker [m]; 0.6 mm, assumed.
    marker, background : float
        Grey levels from 0 to 255 in full light; 200 on 40, assumed.
    softness : float
        Standard deviation of the blur by the lens and the area of a pixel together [px]; 0.7, assumed. At least 0.5:
        with it the middle of a drawn spot is off by up to 0.0025 px, with 0.7 by up to 0.0002 px, if its radius is
        above 2 px; a radius of 0.5 px is off by 0.01 px.
    """

    radius: PositiveLength = 0.6e-3
    marker: GreyLevel = 200.0
    background: GreyLevel = 40.0
    softness: Softness = 0.7


BRIGHT_ON_DARK = MarkerLook()
DARK_ON_BRIGHT = MarkerLook(marker=50.0, background=190.0)


@parameters
class Glare:
    """A round spot of reflected light that stays where it is.

    Parameters
    ----------
    x, y : float
        Its middle, as shares of the width and the height of the image [-].
    radius : float
        Distance at which it falls to 61 % (a Gaussian's standard deviation), as a share of the width [-].
    level : float
        Grey levels that it adds in its middle.
    """

    x: Fraction
    y: Fraction
    radius: PositiveNumber = 0.02
    level: NonNegativeNumber = 150.0


@parameters
class BrightRing:
    """A bright ring around the markers, as the rim of a lit sensor.

    Parameters
    ----------
    radius : float
        Its radius around the middle of the image, as a share of the height [-].
    width : float
        Standard deviation across the ring, as a share of the height [-].
    level : float
        Grey levels that it adds on its line.
    """

    radius: PositiveNumber = 0.46
    width: PositiveNumber = 0.012
    level: NonNegativeNumber = 180.0


@parameters
class Lighting:
    """The light: even by default, each fault of it a switch.

    Parameters
    ----------
    vignetting : float
        Share of the light that is lost in the corners [-]; the loss grows with the squared distance from the middle.
    gradient : float
        Relative change of the light over the width of the image [-].
    gradient_angle : float
        Direction in which it brightens, from x towards y of the image [rad].
    texture : float
        Standard deviation of a pattern of the background that stays [grey levels].
    texture_length : float
        Length over which that pattern changes [px].
    glare : tuple of Glare
        Spots of reflected light.
    ring : BrightRing, optional
        A bright ring.
    drift : float
        Relative change of brightness a second [1/s].
    flicker : float
        Amplitude of a periodic change of brightness [-].
    flicker_rate : float
        Its frequency [1/s]; 100, twice that of mains in Europe.
    """

    vignetting: Fraction = 0.0
    gradient: Number = 0.0
    gradient_angle: Angle = 0.0
    texture: NonNegativeNumber = 0.0
    texture_length: PositiveNumber = 8.0
    glare: tuple[Glare, ...] = ()
    ring: BrightRing | None = None
    drift: Change = 0.0
    flicker: Fraction = 0.0
    flicker_rate: Rate = 100.0


#: Light as bad as that of real sensors may be; assumed, made to try trackers.
HARSH_LIGHT = Lighting(
    vignetting=0.5,
    gradient=0.4,
    gradient_angle=0.25 * math.pi,
    texture=6.0,
    glare=(Glare(0.36, 0.40), Glare(0.62, 0.56, 0.03, 120.0), Glare(0.55, 0.22, 0.015, 200.0)),
    ring=BrightRing(),
    drift=0.002,
    flicker=0.02,
)


@parameters
class SensorNoise:
    """Random noise of the image sensor, new in every pixel of every frame.

    Parameters
    ----------
    read : float
        Standard deviation in the dark [grey levels]; 2, assumed.
    shot : float
        Variance that each grey level of light adds [grey levels]; 0, assumed.
    """

    read: NonNegativeNumber = 2.0
    shot: NonNegativeNumber = 0.0


@parameters
class PixelCamera:
    """A camera that takes pictures.

    Parameters
    ----------
    camera : Camera
        Lens, place and times.
    look : MarkerLook
        Markers and background.
    lighting : Lighting
        The light.
    noise : SensorNoise
        Noise of the image sensor.
    jpeg_quality : int, optional
        Quality from 1 to 100 of the compression that each frame goes through; none by default.
    seed : int
        Seed of everything random: the same seed gives the same frames, whatever part of them is taken.
    """

    camera: Camera
    look: MarkerLook = BRIGHT_ON_DARK
    lighting: Lighting = Lighting()
    noise: SensorNoise = SensorNoise()
    jpeg_quality: Annotated[int, pydantic.Field(ge=1, le=100)] | None = None
    seed: Annotated[int, pydantic.Field(ge=0, lt=2**63)] = 0
