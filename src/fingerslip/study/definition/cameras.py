"""The parts of a study file that say what cameras see: those that film its runs, and those of a data set of trials."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

import pydantic

from fingerslip.errors import InputError
from fingerslip.parameters import (
    Angle,
    Duration,
    NonNegativeLength,
    NonNegativeNumber,
    PositiveLength,
    parameters,
)
from fingerslip.units import Unit
from fingerslip.vision.cameras import PUBLISHED_FRAME_RATE

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from fingerslip.vision.cameras.camera import Camera

#: `internal` looks at the markers inside a sensor, `external` through the plate at those on its skin.
CameraKind = Literal["internal", "external"]

_FrameRate = Annotated[float, Unit("1/s"), pydantic.Field(gt=0, le=1e4)]
_Pixels = Annotated[int, pydantic.Field(ge=16, le=8192)]
_Seed = Annotated[int, pydantic.Field(ge=0, lt=2**63)]
_Quality = Annotated[int, pydantic.Field(ge=1, le=100)]


@parameters
class CameraView:
    """What a camera of a sensor sees; no published sensor prints these values, so every default is assumed.

    Parameters
    ----------
    distance : float
        From the lens to the markers, the lowest ones for the external camera [m].
    view_width : float
        Length that the width of the image shows at the markers [m].
    width, height : int
        Size of the image [px].
    """

    distance: PositiveLength = 50e-3
    view_width: PositiveLength = 45e-3
    width: _Pixels = 640
    height: _Pixels = 480

    @property
    def metres_per_pixel(self) -> float:
        """Length of a pixel at the markers [m]."""
        return self.view_width / self.width

    def camera(self, kind: str, heights: ArrayLike, **options: Any) -> Camera:
        """Return the camera, aimed at markers: see :func:`~fingerslip.vision.cameras.camera.aimed_camera`."""
        # Cameras are slow to load, and a study is also read where nothing is filmed.
        from fingerslip.vision.cameras.camera import aimed_camera

        size = (self.width, self.height)
        return aimed_camera(kind, heights, self.distance, self.view_width, size=size, **options)


@parameters
class CameraSettings(CameraView):
    """A camera of a study; no published sensor prints these values, so every default is assumed.

    Parameters
    ----------
    tier : {'pixel', 'point'}
        Frames, a video and the tracker, or positions with the errors of the tracker at once.
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


_Count = Annotated[int, pydantic.Field(ge=1, le=360)]


@parameters
class TrialSettings(CameraView):
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
    frame_rate: _FrameRate = PUBLISHED_FRAME_RATE
    noise: tuple[NonNegativeNumber, NonNegativeNumber] = (0.0061, 0.05)
    shift: NonNegativeLength = 0.5e-3
    turn: Angle = 0.0175
    hidden: PositiveLength = 0.3e-3
    patch: PositiveLength = 1e-3
    seed: _Seed = 0

    def __post_init__(self) -> None:
        if self.noise[0] > self.noise[1]:
            raise InputError("noise", f"goes from {self.noise[0]:g} to {self.noise[1]:g}", "needs the smallest first")
