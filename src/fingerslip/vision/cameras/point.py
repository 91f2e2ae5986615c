"""The point camera: tracks in pixels with the errors of a tracker, without pictures, for thousands of trials."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np
import pydantic
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.parameters import parameters
from fingerslip.vision.cameras import PUBLISHED_FRAME_RATE
from fingerslip.vision.cameras.camera import (
    Camera,
    frame_times,
    image_attributes,
    interpolate,
    pixels_per_metre,
    true_tracks,
)
from fingerslip.vision.cameras.errors import PositionErrors
from fingerslip.vision.tracks import make_tracks

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "MEASURED_ERRORS",
    "PUBLISHED_FRAME_RATE",
    "CameraPair",
    "PointCamera",
    "metres_per_pixel",
    "pair_tracks",
    "plate_mark",
    "point_tracks",
]


Floats = NDArray[np.float64]

#: What :func:`~fingerslip.vision.cameras.errors.window_centroids` gets wrong on frames of the default pixel camera with
#: ten pixels to the millimetre, where markers slide at 0.3 mm/s for 6 s. Measured; a test measures it again.
MEASURED_ERRORS = PositionErrors(noise=0.0061, bias=0.0018, correlation=0.09)


@parameters
class PointCamera:
    """A camera that gives positions at once.

    Parameters
    ----------
    camera : Camera
        Lens, place and times.
    errors : PositionErrors
        Errors of the positions. :func:`~fingerslip.vision.cameras.errors.measure_errors` calibrates them on a pixel
        camera with any tracker.
    seed : int
        Seed of the errors: the same seed gives the same tracks.
    """

    camera: Camera
    errors: PositionErrors = MEASURED_ERRORS
    seed: Annotated[int, pydantic.Field(ge=0, lt=2**63)] = 0


def point_tracks(point_camera: PointCamera, tracks: xr.Dataset) -> xr.Dataset:
    """Return what a tracker would find in the film of markers.

    The error of each marker along each axis is a normal number that stays, and noise of the first order: each value is
    the `correlation` times the last one and new noise. Lost markers are NaN, each frame anew.

    Parameters
    ----------
    point_camera : PointCamera
        The camera.
    tracks : xarray.Dataset
        Tracks in metres.

    Returns
    -------
    xarray.Dataset
        Tracks in pixels at the times of the camera's frames.

    Raises
    ------
    InputError
        Where the tracks are not in metres, or have no marker that the camera sees.
    """
    truth = true_tracks(point_camera.camera, tracks)
    shape = truth["position"].shape
    errors, random = point_camera.errors, np.random.default_rng([point_camera.seed, 2])
    position = truth["position"].values + errors.bias * random.standard_normal(shape[1:])
    position += errors.noise * _noise(random.standard_normal(shape), errors.correlation)
    position[random.random(shape[:2]) < errors.lost] = np.nan
    more = {name: truth[name].values for name in ("ring", "angle") if name in truth.coords}
    return make_tracks(
        position,
        truth["time"].values,
        units="px",
        kind=point_camera.camera.sees,
        marker=truth["marker"].values,
        attributes=truth.attrs | {"source": f"point camera, seed {point_camera.seed}"},
        **more,
    )


def _noise(white: Floats, correlation: float) -> Floats:
    """Return noise of unit variance whose neighbours along the first axis are correlated, from white noise."""
    if correlation == 0 or white.shape[0] == 0:
        return white
    from scipy import signal

    # The first value has the variance of all others already.
    driven = np.concatenate([white[:1], np.sqrt(1.0 - correlation**2) * white[1:]])
    noise: Floats = signal.lfilter([1.0], [1.0, -correlation], driven, axis=0)
    return noise


# Positions are kept to this share of a pixel, far below their noise, so that files are small.
_KEPT = 1.0 / 1024.0


@dataclass(frozen=True)
class CameraPair:
    """The cameras of one trial."""

    internal: Camera  # both cameras, with one frame rate
    external: Camera  # both cameras, with one frame rate
    errors: PositionErrors = MEASURED_ERRORS  # errors of the positions of both
    seed: int = 0  # seed of the errors

    def __post_init__(self) -> None:
        """Check that both take the same frames, each of its own markers."""
        rates = self.internal.frame_rate, self.external.frame_rate
        if rates[0] != rates[1]:
            fault = f"got {rates[0]:g} and {rates[1]:g} frames a second"
            raise InputError("cameras: frame_rate", fault, "needs one rate of both cameras")
        for kind in ("internal", "external"):
            sees = getattr(self, kind).sees
            if sees != kind:
                raise InputError(f"cameras: {kind}", f"sees {sees} markers", f"needs a camera that sees {kind} ones")


def pair_tracks(pair: CameraPair, markers: xr.Dataset) -> xr.Dataset:
    """Return what both cameras and a tracker make of markers.

    Units: markers [m]; returns [px].
    """
    seen = [
        point_tracks(PointCamera(camera, pair.errors, 2 * pair.seed + number), markers)
        for number, camera in enumerate((pair.internal, pair.external))
    ]
    position = np.concatenate([tracks_of_camera["position"].values for tracks_of_camera in seen], axis=1)
    more = {
        name: np.concatenate([tracks_of_camera[name].values for tracks_of_camera in seen])
        for name in ("marker", "ring", "angle")
        if all(name in tracks_of_camera.coords for tracks_of_camera in seen)
    }
    scale = metres_per_pixel(pair.external)
    return make_tracks(
        np.round(position / _KEPT) * _KEPT,
        seen[0]["time"].values,
        units="px",
        kind=[kind for tracks_of_camera in seen for kind in tracks_of_camera["kind"].values.astype(str)],
        attributes={
            **image_attributes(pair.external, f"simulation, point cameras, seed {pair.seed}"),
            "metres_per_pixel_x": scale,
            "metres_per_pixel_y": scale,
        },
        **more,
    )


def plate_mark(pair: CameraPair, displacement: NDArray[np.float64], time: NDArray[np.float64]) -> xr.Dataset:
    """Return the track of a marker on the plate, below the axis at first, as the external camera sees it [px].

    Arrays: displacement (n, 3) [m]; time (n,) [s].
    """
    mark = make_tracks(displacement[:, None], time, units="m", kind="external")
    camera, times = pair.external, frame_times(pair.external, mark)
    # As far as a marker may fall it is in sight: it need not be in the middle of the image.
    image = camera.intrinsics.project(camera.pose.to_camera(interpolate(mark, times)))
    noise = pair.errors.noise * np.random.default_rng([pair.seed, 3]).standard_normal(image.shape)
    return make_tracks(image + noise, times, units="px", kind="external")


def metres_per_pixel(camera: Camera) -> float:
    """Return the length of a pixel in the middle of the image, as far away as what the camera looks at [m]."""
    return 1.0 / float(pixels_per_metre(camera, np.asarray(camera.pose.target, dtype=np.float64)))
