"""The pixel camera: frames of markers with every fault of real ones, and where the markers truly are in them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.vision.cameras.camera import Camera, frame_times, interpolated, pixels_per_metre, seen_kind, true_tracks
from fingerslip.vision.cameras.kernels import draw_spots, expose, normal_table
from fingerslip.vision.cameras.lighting import brightness, empty_picture, marker_picture
from fingerslip.vision.cameras.look import PixelCamera
from fingerslip.vision.opencv import opencv
from fingerslip.vision.video import write_video

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["film", "frames_of"]

Floats = NDArray[np.float64]
Frame = NDArray[np.uint8]

_CHUNK = 64  # frames whose spots are computed together


def film(pixel_camera: PixelCamera, tracks: xr.Dataset, path: str | Path, *, codec: str | None = None) -> xr.Dataset:
    """Film markers, write the video whole or not at all, and return where the markers truly are in it.

    Parameters
    ----------
    pixel_camera : PixelCamera
        The camera.
    tracks : xarray.Dataset
        Tracks in metres. A marker that is NaN is not drawn.
    path : path
        A video file or a folder; see :func:`~fingerslip.vision.video.write_video`.
    codec : str, optional
        Codec of the file.

    Returns
    -------
    xarray.Dataset
        True tracks in pixels, as of :func:`~fingerslip.vision.cameras.camera.true_tracks`.

    Raises
    ------
    InputError
        Where the tracks are not in metres, have no time, or have no marker that the camera sees.
    ResultError
        Where the file cannot be written.
    """
    truth = true_tracks(pixel_camera.camera, tracks)
    write_video(path, frames_of(pixel_camera, tracks), pixel_camera.camera.frame_rate, codec=codec)
    return truth.assign_attrs(source=f"truth of {Path(path).name}")


def frames_of(
    pixel_camera: PixelCamera, tracks: xr.Dataset, *, start: int = 0, stop: int | None = None
) -> Iterator[Frame]:
    """Yield the frames that a camera takes of markers.

    During the exposure a marker moves straight and evenly, half of the way before the time of the frame, so that the
    middle of its spot is its true position at that time.

    Parameters
    ----------
    pixel_camera : PixelCamera
        The camera.
    tracks : xarray.Dataset
        Tracks in metres. A marker that is NaN is not drawn.
    start, stop : int, optional
        First frame and the one behind the last. They are as in the whole video.

    Yields
    ------
    (height, width) array of uint8
        Each frame, an array of its own.

    Raises
    ------
    InputError
        Where the tracks are not in metres, or have no marker that the camera sees.
    """
    chosen = seen_kind(pixel_camera.camera, tracks)
    empty, covered = empty_picture(pixel_camera), marker_picture(pixel_camera)
    times = frame_times(pixel_camera.camera, chosen)
    last = times.size if stop is None else min(stop, times.size)
    for first in range(start, last, _CHUNK):
        numbers = np.arange(first, min(first + _CHUNK, last))
        spots = _spots(pixel_camera, chosen, times[numbers])
        factors = brightness(pixel_camera.lighting, times[numbers])
        for number, factor, middles, halves, radii in zip(numbers, factors, *spots, strict=True):
            picture = empty.copy()
            draw_spots(picture, covered, middles, halves, radii, pixel_camera.look.softness)
            yield _developed(pixel_camera, picture, int(number), float(factor))


def _spots(pixel_camera: PixelCamera, tracks: xr.Dataset, times: Floats) -> tuple[Floats, Floats, Floats]:
    """Return middles, half movements (n_times, n_markers, 2) and radii (n_times, n_markers) of the spots [px]."""
    camera = pixel_camera.camera
    points = _in_space(interpolated(tracks, times))
    radii = pixel_camera.look.radius * pixels_per_metre(camera, points)
    return _image(camera, points), _half_movements(camera, tracks, times), radii


def _half_movements(camera: Camera, tracks: xr.Dataset, times: Floats) -> Floats:
    """Return how far spots move in half of the exposure [px], 0 where that is not known."""
    known = tracks["time"].values
    opened, closed = (np.clip(times + side * camera.exposure, known[0], known[-1]) for side in (-0.5, 0.5))
    ends = [_image(camera, _in_space(interpolated(tracks, one))) for one in (closed, opened)]
    # At both ends of the tracks half of the exposure lies outside: the speed is that of the other half.
    span = np.where(closed > opened, closed - opened, np.inf)[:, None, None]
    return np.nan_to_num(0.5 * camera.exposure * (ends[0] - ends[1]) / span)


def _image(camera: Camera, points: Floats) -> Floats:
    """Return pixels also outside the image, where the spots of markers may reach into it."""
    return camera.intrinsics.project(camera.pose.to_camera(points))


def _in_space(points: Floats) -> Floats:
    return points if points.shape[-1] == 3 else np.concatenate([points, np.zeros_like(points[..., :1])], axis=-1)


def _developed(pixel_camera: PixelCamera, picture: NDArray[np.float32], number: int, factor: float) -> Frame:
    """Return the frame that the sensor and the compression make of the light."""
    noise = pixel_camera.noise
    frame: Frame = expose(picture, factor, noise.read**2, noise.shot, pixel_camera.seed, number, normal_table())
    return frame if pixel_camera.jpeg_quality is None else _compressed(frame, pixel_camera.jpeg_quality)


def _compressed(frame: Frame, quality: int) -> Frame:
    """Return a frame that went through JPEG."""
    cv2 = opencv()
    _, content = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, quality])
    back: Frame = cv2.imdecode(content, cv2.IMREAD_GRAYSCALE)
    return back
