"""The point camera: tracks in pixels with the errors of a tracker, without pictures, for thousands of trials."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import numpy as np
import pydantic
from numpy.typing import NDArray

from fingerslip.parameters import parameters
from fingerslip.vision.cameras.camera import Camera, true_tracks
from fingerslip.vision.cameras.errors import PositionErrors
from fingerslip.vision.tracks import make_tracks

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["MEASURED_ERRORS", "PointCamera", "point_tracks"]

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
