"""Markers, tracks and cameras that tests share."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.marker_layouts import ring_layout
from fingerslip.vision.cameras.camera import Camera, Pose
from fingerslip.vision.cameras.intrinsics import pinhole_for_view
from fingerslip.vision.cameras.pixel import PixelCamera, SensorNoise
from fingerslip.vision.tracks import make_tracks

SILENT = SensorNoise(read=0.0)
GREY = np.full((120, 160), 90, dtype=np.uint8)


def moving_tracks(times: int = 5, units: str = "px", dim: int = 2, **more: Any) -> xr.Dataset:
    """Return 25 markers on rings that move along x; the last one is not seen at the second time."""
    layout = ring_layout(1e-3, (1, 8, 16))
    position = np.zeros((times, layout.count, dim))
    position[:, :, :2] = layout.position * (1e5 if units == "px" else 1.0) + np.array([320.0, 240.0])
    position[:, :, 0] += np.arange(times)[:, None]
    if times > 1:
        position[1, -1] = np.nan
    labels = {"ring": layout.ring, "angle": layout.angle} | more
    return make_tracks(position, np.arange(times) / 30.0, units=units, **labels)


def camera(width: int = 160, height: int = 120, **more: Any) -> Camera:
    """Return a camera 50 mm above the plane z = 0, with ten pixels to the millimetre."""
    lens = pinhole_for_view(width, height, width * 1e-4, 0.05)
    return Camera(lens, Pose((0.0, 0.0, 0.05), (0.0, 0.0, 0.0)), **more)


def sliding(seconds: float = 0.2, speed: float = 1e-3, pitch: float = 3e-3) -> xr.Dataset:
    """Return nine markers on a ring and in its centre that slide along x [m]."""
    layout = ring_layout(pitch, (1, 8))
    times = np.linspace(0.0, seconds, 21)
    position = np.zeros((times.size, layout.count, 3))
    position[:, :, :2] = layout.position
    position[:, :, 0] += speed * times[:, None]
    return make_tracks(position, times, units="m", ring=layout.ring, angle=layout.angle)


def hide(tracks: xr.Dataset, times: Any, marker: Any) -> xr.Dataset:
    """Return tracks in which a marker is not seen at some times."""
    tracks = tracks.copy(deep=True)
    tracks["position"].values[times, marker] = np.nan
    tracks["quality"].values[times, marker] = 0.0
    return tracks


def silent_camera(**more: Any) -> PixelCamera:
    """Return a pixel camera without noise."""
    return PixelCamera(**({"camera": camera(), "noise": SILENT} | more))


def middle(picture: NDArray[Any], place: NDArray[Any], reach: int = 11) -> NDArray[np.float64]:
    """Return the middle of what is brighter than the corner of a window around a place, x and y [px]."""
    x, y = (round(float(value)) for value in place)
    window = picture[y - reach : y + reach + 1, x - reach : x + reach + 1].astype(float)
    weights = np.abs(window - window[0, 0])
    rows, columns = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    return np.array([x + (weights * columns).sum() / weights.sum(), y + (weights * rows).sum() / weights.sum()])
