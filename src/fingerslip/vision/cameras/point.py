"""Point cameras: markers seen with the errors of a tracker, without frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pydantic

from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.libraries import xr
from fingerslip.parameters import parameters
from fingerslip.vision.cameras.camera import (
    Camera,
    frame_times,
    image_attributes,
    image_points,
    interpolate,
    pixels_per_metre,
    true_tracks,
)
from fingerslip.vision.cameras.pixel import PixelCamera, frames_of
from fingerslip.vision.comparison import PositionErrors, position_errors
from fingerslip.vision.tracks import make_tracks, tracks_like
from fingerslip.vision.video import Frame

#: Finds markers in frames: gets the frames and where the markers are in the first (n_markers, 2) [px], returns their
#: positions (n_frames, n_markers, 2) [px], NaN where lost.
Locate = Callable[[Iterator[Frame], Floats], Floats]
_FLOOR, _CLEAR = 0.2, 6.0
# Positions of pairs are rounded to this share of a pixel, far below their noise, so that files are small.
_ROUNDING = 1.0 / 1024.0


def measure_errors(pixel_camera: PixelCamera, tracks: xr.Dataset, locate: Locate) -> PositionErrors:
    """Return the statistics of the errors with which markers are found in frames of a camera.

    Parameters
    ----------
    pixel_camera : PixelCamera
        The camera.
    tracks : xarray.Dataset
        Tracks in metres; a second of them is enough to calibrate a point camera.
    locate : callable
        See :data:`Locate`; :func:`following` makes one of a function of single frames.

    Raises
    ------
    InputError
        Where the tracks cannot be filmed, or `locate` returns another shape or finds too little.

    Examples
    --------
    >>> import fingerslip as fs
    >>> from fingerslip.vision.cameras.point import following, window_centroids
    >>> tracks = fs.make_tracks([[[0.0, 0.0, 0.0]], [[1e-3, 0.0, 0.0]]], [0.0, 1.0], units="m")
    >>> filming = fs.PixelCamera(fs.internal_camera(50e-3, 40e-3), fs.MarkerLook(radius=0.4e-3))
    >>> errors = fs.measure_errors(filming, tracks, following(window_centroids))
    >>> f"{errors.rms:.2f} px"
    '0.01 px'
    >>> seen = fs.point_tracks(fs.PointCamera(filming.camera, errors), tracks)  # without any frame
    """
    truth = true_tracks(pixel_camera.camera, tracks)
    positions = np.asarray(locate(frames_of(pixel_camera, tracks), truth["position"].values[0]), dtype=np.float64)
    if positions.shape != truth["position"].shape:
        raise InputError("locate", f"returned shape {positions.shape}", f"needs {truth['position'].shape}")
    # What is outside the image has no truth to be compared with.
    positions[np.isnan(truth["position"].values)] = np.nan
    return position_errors(tracks_like(truth, positions, truth["time"].values), truth)


def following(centroids: Callable[[Frame, Floats], Floats]) -> Locate:
    """Make a :data:`Locate` of a function such as :func:`window_centroids`, which finds markers in one frame.

    A marker is expected to move on as between the last two frames; one that was lost, to be where it was expected last.
    """

    def locate(frames: Iterator[Frame], start: Floats) -> Floats:
        expected, last, result = start.copy(), start, []
        for frame in frames:
            places = centroids(frame, expected)
            ahead = np.where(np.isnan(last) | np.isnan(places), places, 2.0 * places - last)
            expected, last = np.where(np.isnan(ahead), expected, ahead), places
            result.append(places)
        return np.array(result).reshape(-1, *start.shape)

    return locate


def window_centroids(frame: Frame, expected: Floats, reach: int = 9) -> Floats:
    """Return the centroid of what differs from the surroundings of each marker, weighted by how much it does.

    A plain method for calibration: pixels that differ by less than a fifth of the largest difference do not count.
    The frame is (height, width); markers are expected within a pixel or two at (n, 2) [px]. A window is twice `reach`
    wide [px]: a marker must fit, its neighbours must not. NaN where the window is not inside the frame, or nothing in
    it stands out by more than six standard deviations of its border.
    """
    height, width = frame.shape
    starts = np.round(np.nan_to_num(expected, nan=-1e6)).astype(int)
    inside = ((starts >= reach) & (starts < (width - reach, height - reach))).all(axis=1)
    offsets = np.arange(-reach, reach + 1)
    centroids = np.full(expected.shape, np.nan)
    columns, rows = starts[inside, 0, None] + offsets, starts[inside, 1, None] + offsets
    windows = frame[rows[:, :, None], columns[:, None, :]].astype(np.float64)
    border = np.concatenate([windows[:, [0, -1], :].reshape(len(windows), -1), windows[:, :, 0], windows[:, :, -1]], 1)
    height_above = np.abs(windows - np.median(border, axis=1)[:, None, None])
    largest = height_above.max(axis=(1, 2))
    weights = np.maximum(height_above - _FLOOR * largest[:, None, None], 0.0)
    clear = largest > _CLEAR * border.std(axis=1)
    total = np.where(clear, weights.sum(axis=(1, 2)), np.nan)
    centroids[inside, 0] = (weights.sum(axis=1) * columns).sum(axis=1) / total
    centroids[inside, 1] = (weights.sum(axis=2) * rows).sum(axis=1) / total
    return centroids


#: What :func:`~fingerslip.vision.cameras.point.window_centroids` gets wrong on frames of the default pixel camera with
#: ten pixels to the millimetre, where markers slide at 0.3 mm/s for 6 s. Measured; a test measures it again.
MEASURED_ERRORS = PositionErrors(noise=0.0061, bias=0.0018, correlation=0.09)


@parameters
class PointCamera:
    """A camera that gives positions at once.

    See :func:`point_tracks`.
    """

    camera: Annotated[Camera, "Lens, place and times."]
    errors: Annotated[
        PositionErrors,
        "Errors of the positions. :func:`~fingerslip.vision.cameras.point.measure_errors` calibrates them on a pixel "
        "camera with any tracker.",
    ] = MEASURED_ERRORS
    seed: Annotated[int, pydantic.Field(ge=0, lt=2**63), "Seed of the errors: the same seed gives the same tracks."] = 0


def point_tracks(point_camera: PointCamera, tracks: xr.Dataset) -> xr.Dataset:
    """Return what a tracker would find in the film of markers, in pixels at the times of the camera's frames.

    The error of each marker along each axis is a normal number that stays, and noise of the first order: each value is
    the `correlation` times the last one and new noise. Lost markers are NaN, each frame anew.

    Parameters
    ----------
    point_camera : PointCamera
        The camera.
    tracks : xarray.Dataset
        Tracks in metres.

    Raises
    ------
    InputError
        Where the tracks are not in metres, or have no marker that the camera sees.

    Examples
    --------
    >>> import fingerslip as fs
    >>> tracks = fs.make_tracks([[[0.0, 0.0, 0.0]], [[1e-3, 0.0, 0.0]]], [0.0, 1.0], units="m")
    >>> errors = fs.PositionErrors(noise=0.05, lost=0.2)
    >>> camera = fs.PointCamera(fs.internal_camera(50e-3, 40e-3), errors, seed=1)
    >>> seen = fs.point_tracks(camera, tracks)
    >>> seen.sizes["time"], int((seen["quality"] == 0.0).sum())
    (31, 4)
    """
    truth = true_tracks(point_camera.camera, tracks)
    shape = truth["position"].shape
    errors, random = point_camera.errors, np.random.default_rng([point_camera.seed, 2])
    position = truth["position"].values + errors.bias * random.standard_normal(shape[1:])
    noise = random.standard_normal(shape)
    if errors.correlation and len(noise):
        from scipy import signal

        # The first value has the variance of all others already.
        noise[1:] *= np.sqrt(1.0 - errors.correlation**2)
        noise = signal.lfilter([1.0], [1.0, -errors.correlation], noise, axis=0)
    position += errors.noise * noise
    position[random.random(shape[:2]) < errors.lost] = np.nan
    source = f"point camera, seed {point_camera.seed}"
    return tracks_like(truth, position, truth["time"].values, attributes=truth.attrs | {"source": source})


@dataclass(frozen=True)
class CameraPair:
    """The cameras of one trial."""

    internal: Camera
    external: Camera  # of the same frame rate
    errors: PositionErrors = MEASURED_ERRORS  # errors of the positions of both
    seed: int = 0  # seed of the errors

    def __post_init__(self) -> None:
        rates = self.internal.frame_rate, self.external.frame_rate
        if rates[0] != rates[1]:
            fault = f"got {rates[0]:g} and {rates[1]:g} frames a second"
            raise InputError("cameras: frame_rate", fault, "needs one rate of both cameras")
        for kind in ("internal", "external"):
            sees = getattr(self, kind).sees
            if sees != kind:
                raise InputError(f"cameras: {kind}", f"sees {sees} markers", f"needs a camera that sees {kind} ones")


def pair_tracks(pair: CameraPair, markers: xr.Dataset) -> xr.Dataset:
    """Return what both cameras and a tracker make of markers [m], in pixels, the internal markers first."""
    seen = [
        point_tracks(PointCamera(camera, pair.errors, 2 * pair.seed + number), markers)
        for number, camera in enumerate((pair.internal, pair.external))
    ]
    # All but the markers is the same in both.
    same: dict[str, Any] = {"data_vars": "minimal", "coords": "minimal", "compat": "override", "join": "override"}
    both = xr.concat(seen, "marker", combine_attrs="override", **same)
    position = both["position"].values
    # The length of a pixel in the middle of the image, as far away as what the camera looks at.
    scale = 1.0 / float(pixels_per_metre(pair.external, np.asarray(pair.external.pose.target)))
    attributes = {
        **image_attributes(pair.external, f"simulation, point cameras, seed {pair.seed}"),
        "metres_per_pixel_x": scale,
        "metres_per_pixel_y": scale,
    }
    return tracks_like(both, np.round(position / _ROUNDING) * _ROUNDING, both["time"].values, attributes=attributes)


def plate_mark(pair: CameraPair, displacement: Floats, time: Floats) -> xr.Dataset:
    """Return the track [px] of a marker on the plate as the external camera sees it, by displacement (n, 3) [m]."""
    mark = make_tracks(displacement[:, None], time, units="m", kind="external")
    camera, times = pair.external, frame_times(pair.external, mark)
    # As far as a marker may fall it is in sight: it need not be in the middle of the image.
    image = image_points(camera, interpolate(mark, times))
    noise = pair.errors.noise * np.random.default_rng([pair.seed, 3]).standard_normal(image.shape)
    return make_tracks(image + noise, times, units="px", kind="external")
