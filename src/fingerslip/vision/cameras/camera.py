"""Cameras: lens, pose, frame rate, and how markers look to them.

Cameras: where they stand, what they see, and when they look. Markers that move become tracks in pixels.

Light goes straight: refraction at windows, gels and plates is not modelled. All rows of the image are exposed at the
same time.

How markers look in pictures: their size and grey levels, the light, and the noise of the sensor. Numbers only.

Nobody publishes these numbers for sensors of this kind: every default is assumed. Grey levels are those of 8 bits, from
0 to 255.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
import pydantic
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.parameters import Angle, Fraction, Length, NonNegativeNumber, Number, PositiveLength, Rate, parameters
from fingerslip.units import Unit
from fingerslip.vision.cameras.intrinsics import Fisheye, Pinhole, PositiveNumber
from fingerslip.vision.tracks import check_tracks, make_tracks

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "BRIGHT_ON_DARK",
    "DARK_ON_BRIGHT",
    "HARSH_LIGHT",
    "BrightRing",
    "Camera",
    "Glare",
    "Lighting",
    "MarkerLook",
    "PixelCamera",
    "Pose",
    "SensorNoise",
    "frame_times",
    "interpolate",
    "pixels_of",
    "pixels_per_metre",
    "true_tracks",
]


Floats = NDArray[np.float64]
FrameRate = Annotated[float, Unit("1/s"), pydantic.Field(gt=0, le=1e4)]
Exposure = Annotated[float, Unit("s", "ms"), pydantic.Field(ge=0)]
Vector = tuple[Length, Length, Length]
_ROUNDING = 1e-9


@parameters
class Pose:
    """Where a camera stands and what it looks at.

    Parameters
    ----------
    position : (float, float, float)
        Centre of the lens [m].
    target : (float, float, float)
        A point on the axis of the lens, in front of the camera [m].
    up : (float, float, float)
        Direction [-] that is up in the image, as far as it is square to the axis.

    Raises
    ------
    InputError
        Where the position is the target, or the camera looks along `up`.
    """

    position: Vector
    target: Vector
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)

    def __post_init__(self) -> None:
        """Check that the directions differ."""
        axis = np.subtract(self.target, self.position)
        if not np.linalg.norm(np.cross(axis, self.up)) > _ROUNDING * np.linalg.norm(axis) * np.linalg.norm(self.up):
            fault = f"got a camera that looks along {tuple(axis.tolist())}, with {self.up} up"
            raise InputError("pose", fault, "needs a target that is not the position, and another direction up")

    @property
    def rotation(self) -> Floats:
        """Right, down and forward of the camera as rows [-], shape (3, 3): a rotation."""
        forward = np.subtract(self.target, self.position)
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right = right / np.linalg.norm(right)
        return np.stack([right, np.cross(forward, right), forward])

    def to_camera(self, points: Floats) -> Floats:
        """Return points (..., 3) [m] in the camera's own frame: x right, y down, z forward."""
        coordinates: Floats = (np.asarray(points, dtype=np.float64) - self.position) @ self.rotation.T
        return coordinates


@parameters
class Camera:
    """A camera.

    Parameters
    ----------
    intrinsics : Pinhole or Fisheye
        Lens and size of the image.
    pose : Pose
        Where it stands.
    sees : {'internal', 'external'}
        Kind of the markers that it sees: the inside of a sensor, or its skin through a plate.
    frame_rate : float
        Frames a second [1/s]; 30, assumed.
    exposure : float
        Time for which a frame is exposed [s]; 10 ms, assumed. It may not be longer than a frame.

    Raises
    ------
    InputError
        Where the exposure is longer than a frame, or another value cannot be.
    """

    intrinsics: Pinhole | Fisheye
    pose: Pose
    sees: Literal["internal", "external"] = "internal"
    frame_rate: FrameRate = 30.0
    exposure: Exposure = 10e-3

    def __post_init__(self) -> None:
        """Check that the shutter closes before the next frame."""
        if self.exposure > 1.0 / self.frame_rate:
            raise InputError(
                "exposure", f"got {self.exposure} s", f"needs at most a frame, {1 / self.frame_rate:.4g} s"
            )


def pixels_of(camera: Camera, points: Floats) -> Floats:
    """Return the pixels (..., 2) at which a camera sees points (..., 2 or 3) [m]; NaN for what it does not see.

    Points of the plane have z = 0. What is outside the image is not seen.
    """
    points = np.asarray(points, dtype=np.float64)
    if points.shape[-1] == 2:
        points = np.concatenate([points, np.zeros_like(points[..., :1])], axis=-1)
    pixels = camera.intrinsics.project(camera.pose.to_camera(points))
    largest = np.array([camera.intrinsics.width, camera.intrinsics.height]) - 0.5
    # The image begins half a pixel before the middle of its first pixel.
    outside = ~((pixels >= -0.5) & (pixels <= largest)).all(axis=-1)
    pixels[outside] = np.nan
    return pixels


def pixels_per_metre(camera: Camera, points: Floats, step: float = 1e-6) -> Floats:
    """Return how long a metre at points (..., 3) [m], square to the line of sight, is in the image [px/m].

    The geometric mean over both directions, by central differences.

    Arrays: points (..., 3) [m]; step [m].
    """
    local = camera.pose.to_camera(points)
    sight = local / np.linalg.norm(local, axis=-1, keepdims=True)
    # Two directions square to the line of sight, from the axis of the camera that is least along it.
    first = np.cross(sight, np.eye(3)[np.abs(sight).argmin(axis=-1)])
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    project = camera.intrinsics.project
    slopes = [
        (project(local + step * side) - project(local - step * side)) / (2 * step)
        for side in (first, np.cross(sight, first))
    ]
    area = slopes[0][..., 0] * slopes[1][..., 1] - slopes[0][..., 1] * slopes[1][..., 0]
    scale: Floats = np.sqrt(np.abs(area))
    return scale


def frame_times(camera: Camera, tracks: xr.Dataset) -> Floats:
    """Return the times [s] of the frames that a camera takes of tracks, from the first to the last time of them.

    The time of a frame is the middle of its exposure.
    """
    times = tracks["time"].values
    if times.size == 0:
        return np.empty(0)
    count = int(np.floor((times[-1] - times[0]) * camera.frame_rate + _ROUNDING)) + 1
    times_of_frames: Floats = times[0] + np.arange(count) / camera.frame_rate
    return times_of_frames


def interpolate(tracks: xr.Dataset, times: Floats) -> Floats:
    """Return where markers are at some times [s], shape (n_times, n_markers, n_axes), straight between the known times.

    Before the first and after the last time they rest. Between two times, at one of which a marker is not known, it is
    not known either.
    """
    times_known, position = tracks["time"].values, tracks["position"].values
    times = np.clip(times, times_known[0], times_known[-1])
    before = np.clip(np.searchsorted(times_known, times, side="right") - 1, 0, max(times_known.size - 2, 0))
    after = np.minimum(before + 1, times_known.size - 1)
    span = np.where(after > before, times_known[after] - times_known[before], 1.0)
    share = ((times - times_known[before]) / span)[:, None, None]
    # At a known time the other end does not matter, seen or not.
    positions = np.where(share == 0, position[before], (1 - share) * position[before] + share * position[after])
    return np.where(share == 1, position[after], positions)


def true_tracks(camera: Camera, tracks: xr.Dataset) -> xr.Dataset:
    """Return what a camera without any fault sees of markers: their tracks in pixels at the times of its frames.

    Parameters
    ----------
    camera : Camera
        The camera.
    tracks : xarray.Dataset
        Tracks in metres at any times.

    Returns
    -------
    xarray.Dataset
        Tracks in pixels of the markers of the kind that the camera sees; NaN outside the image. With the attributes
        of the image.

    Raises
    ------
    InputError
        Where the tracks are not in metres, or have no marker of that kind.
    """
    chosen = seen_kind(camera, tracks)
    times = frame_times(camera, chosen)
    position = interpolate(chosen, times) if times.size else chosen["position"].values
    more = {name: chosen[name].values for name in ("ring", "angle") if name in chosen.coords}
    return make_tracks(
        pixels_of(camera, position),
        times,
        units="px",
        kind=camera.sees,
        marker=chosen["marker"].values,
        attributes=image_attributes(camera, "camera without faults"),
        **more,
    )


def seen_kind(camera: Camera, tracks: xr.Dataset) -> xr.Dataset:
    """Return the tracks of the markers that a camera sees; see :func:`true_tracks` for what is refused."""
    check_tracks(tracks)
    if tracks["position"].attrs["units"] != "m":
        raise InputError("tracks: position", "is in px", "cameras need positions in m", "see tracks_in_metres")
    chosen = tracks.isel(marker=np.flatnonzero(tracks["kind"].values == camera.sees))
    if chosen.sizes["marker"] == 0:
        raise InputError("tracks: kind", f"has no {camera.sees} marker", "the camera sees no others", "change sees")
    return chosen


def image_attributes(camera: Camera, source: str) -> dict[str, object]:
    """Return the attributes of tracks in the image of a camera."""
    return {
        "image_width": camera.intrinsics.width,
        "image_height": camera.intrinsics.height,
        "frame_rate": camera.frame_rate,
        "source": source,
    }


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
