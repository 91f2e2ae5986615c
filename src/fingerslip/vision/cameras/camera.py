"""Cameras: lens, pose and frame rate. Markers that move become tracks in pixels.

Light goes straight: refraction at windows, gels and plates is not modelled. All rows of the image are exposed at the
same time. The heights, views, rates and exposures of real sensors are not published: all defaults are assumed.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
import pydantic
from numpy.typing import ArrayLike

from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.libraries import xr
from fingerslip.parameters import Length, parameters
from fingerslip.units import Unit
from fingerslip.vision.cameras.intrinsics import Fisheye, Pinhole, lens_for_view
from fingerslip.vision.tracks import check_tracks, tracks_like

FrameRate = Annotated[float, Unit("1/s"), pydantic.Field(gt=0, le=1e4)]
Exposure = Annotated[float, Unit("s", "ms"), pydantic.Field(ge=0)]
Vector = tuple[Length, Length, Length]
_ROUNDING = 1e-9
_STEP = 1e-6  # [m] of differences


@parameters
class Pose:
    """Where a camera stands and what it looks at.

    See :class:`Camera`.
    """

    position: Annotated[Vector, "Centre of the lens [m]."]
    target: Annotated[Vector, "A point on the axis of the lens, in front of the camera [m]."]
    up: Annotated[
        tuple[float, float, float], "Direction [-] that is up in the image, as far as it is square to the axis."
    ] = (0.0, 1.0, 0.0)

    def __post_init__(self) -> None:
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
        """Return points (..., 2 or 3) [m] in the camera's own frame: x right, y down, z forward. In 2D z is 0."""
        points = np.asarray(points, dtype=np.float64)
        if points.shape[-1] == 2:
            points = np.concatenate([points, np.zeros_like(points[..., :1])], axis=-1)
        return np.asarray((points - self.position) @ self.rotation.T)


@parameters
class Camera:
    """A camera.

    Examples
    --------
    >>> import numpy as np
    >>> import fingerslip as fs
    >>> lens = fs.pinhole_for_view(640, 480, view_width=40e-3, distance=50e-3)
    >>> camera = fs.Camera(lens, fs.Pose(position=(0.0, 0.0, 50e-3), target=(0.0, 0.0, 0.0)), frame_rate=60.0)
    >>> lens.project(camera.pose.to_camera(np.array([1e-3, 0.0, 0.0]))).tolist()
    [335.5, 239.5]
    """

    intrinsics: Annotated[Pinhole | Fisheye, "Lens and size of the image."]
    pose: Annotated[Pose, "Where it stands."]
    sees: Annotated[
        Literal["internal", "external"],
        "Kind of the markers that it sees: the inside of a sensor, or its skin through a plate.",
    ] = "internal"
    frame_rate: Annotated[FrameRate, "Frames a second [1/s]; 30, assumed."] = 30.0
    exposure: Annotated[
        Exposure, "Time for which a frame is exposed [s]; 10 ms, assumed. It may not be longer than a frame."
    ] = 10e-3

    def __post_init__(self) -> None:
        if self.exposure > 1.0 / self.frame_rate:
            raise InputError(
                "exposure", f"got {self.exposure} s", f"needs at most a frame, {1 / self.frame_rate:.4g} s"
            )


def image_points(camera: Camera, points: Floats) -> Floats:
    """Return the pixels (..., 2) of points (..., 2 or 3) [m], also outside the image."""
    return camera.intrinsics.project(camera.pose.to_camera(points))


def pixels_of(camera: Camera, points: Floats) -> Floats:
    """Return the pixels (..., 2) at which a camera sees points (..., 2 or 3) [m]; NaN for what is outside the image."""
    pixels = image_points(camera, points)
    largest = np.array([camera.intrinsics.width, camera.intrinsics.height]) - 0.5
    # The image begins half a pixel before the middle of its first pixel.
    pixels[~((pixels >= -0.5) & (pixels <= largest)).all(axis=-1)] = np.nan
    return pixels


def pixels_per_metre(camera: Camera, points: Floats) -> Floats:
    """Return how long a metre at points (..., 2 or 3) [m], square to the line of sight, is in the image [px/m].

    The geometric mean over both directions, by central differences.
    """
    local = camera.pose.to_camera(points)
    sight = local / np.linalg.norm(local, axis=-1, keepdims=True)
    # Two directions square to the line of sight, from the axis of the camera that is least along it.
    first = np.cross(sight, np.eye(3)[np.abs(sight).argmin(axis=-1)])
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    project = camera.intrinsics.project
    slopes = [
        (project(local + _STEP * side) - project(local - _STEP * side)) / (2 * _STEP)
        for side in (first, np.cross(sight, first))
    ]
    area = slopes[0][..., 0] * slopes[1][..., 1] - slopes[0][..., 1] * slopes[1][..., 0]
    return np.asarray(np.sqrt(np.abs(area)))


def frame_times(camera: Camera, tracks: xr.Dataset) -> Floats:
    """Return the middles of the exposures [s] of the frames that a camera takes from the first to the last time."""
    times = tracks["time"].values
    if times.size == 0:
        return np.empty(0)
    count = int(np.floor((times[-1] - times[0]) * camera.frame_rate + _ROUNDING)) + 1
    return np.asarray(times[0] + np.arange(count) / camera.frame_rate)


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

    Markers are those of the kind that the camera sees; outside the image they are NaN.

    Parameters
    ----------
    camera : Camera
        The camera.
    tracks : xarray.Dataset
        Tracks in metres at any times.

    Raises
    ------
    InputError
        Where the tracks are not in metres, or have no marker of that kind.

    Examples
    --------
    A marker that moves by 1 mm in a second, before a camera of ten frames a second:

    >>> import fingerslip as fs
    >>> tracks = fs.make_tracks([[[0.0, 0.0]], [[1e-3, 0.0]]], [0.0, 1.0], units="m", kind="external")
    >>> camera = fs.external_camera(distance=50e-3, view_width=40e-3, frame_rate=10.0)
    >>> fs.true_tracks(camera, tracks)["position"].sel(marker=0, axis="x").values[:3].round(3).tolist()
    [319.5, 321.1, 322.7]
    """
    chosen = seen_kind(camera, tracks)
    times = frame_times(camera, chosen)
    position = interpolate(chosen, times) if times.size else chosen["position"].values
    attributes = image_attributes(camera, "camera without faults")
    return tracks_like(chosen, pixels_of(camera, position), times, attributes=attributes)


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


def internal_camera(
    distance: float,
    view_width: float,
    *,
    target: float = 0.0,
    size: tuple[int, int] = (640, 480),
    lens: Literal["pinhole", "fisheye"] = "pinhole",
    frame_rate: float = 30.0,
    exposure: float = 10e-3,
) -> Camera:
    """Return a camera of internal markers, above them on a sensor's axis y; x is to the right and z down in its image.

    Parameters
    ----------
    distance : float
        Height of the lens above the target [m].
    view_width : float
        Length along x that the image shows at the target [m].
    target : float, optional
        Height y of the point on the axis that it looks at [m].
    size : (int, int), optional
        Width and height of the image [px].
    lens : {'pinhole', 'fisheye'}, optional
        Kind of the lens, without distortion of its own.
    frame_rate : float, optional
        Frames a second [1/s].
    exposure : float, optional
        Exposure of a frame [s].

    Examples
    --------
    >>> import fingerslip as fs
    >>> from fingerslip.vision.cameras.camera import pixels_of
    >>> pixels_of(fs.internal_camera(50e-3, 64e-3), [1e-3, 0.0, 2e-3]).round(6).tolist()
    [329.5, 259.5]
    """
    pose = Pose((0.0, target + distance, 0.0), (0.0, target, 0.0), (0.0, 0.0, -1.0))
    return Camera(lens_for_view(lens, *size, view_width, distance), pose, "internal", frame_rate, exposure)


def external_camera(
    distance: float,
    view_width: float,
    *,
    target: float = 0.0,
    size: tuple[int, int] = (640, 480),
    lens: Literal["pinhole", "fisheye"] = "pinhole",
    frame_rate: float = 30.0,
    exposure: float = 10e-3,
) -> Camera:
    """Return a camera of external markers, below a transparent plate; it looks up, and z points up in its image.

    Parameters
    ----------
    distance : float
        Depth of the lens below the target [m]; see :func:`true_tracks`.
    view_width, target, size, lens, frame_rate, exposure : optional
        As of :func:`internal_camera`.
    """
    pose = Pose((0.0, target - distance, 0.0), (0.0, target, 0.0), (0.0, 0.0, 1.0))
    return Camera(lens_for_view(lens, *size, view_width, distance), pose, "external", frame_rate, exposure)


def aimed_camera(kind: str, heights: ArrayLike, distance: float, view_width: float, **more: Any) -> Camera:
    """Return a camera aimed at markers at heights (n_markers,) [m]: the middle from inside, the lowest from outside."""
    seen = np.asarray(heights, dtype=np.float64)
    if kind == "internal":
        return internal_camera(distance, view_width, target=float(np.nanmean(seen)), **more)
    return external_camera(distance, view_width, target=float(np.nanmin(seen)), **more)
