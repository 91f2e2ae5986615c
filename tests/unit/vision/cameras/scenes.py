"""Markers and cameras that tests of cameras share."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.marker_layouts import ring_layout
from fingerslip.vision.cameras.camera import Camera, Pose
from fingerslip.vision.cameras.intrinsics import pinhole_for_view
from fingerslip.vision.cameras.looks import PixelCamera, SensorNoise
from fingerslip.vision.tracks import make_tracks

SILENT = SensorNoise(read=0.0)


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


def taken(**more: Any) -> PixelCamera:
    """Return a pixel camera without noise."""
    return PixelCamera(**({"camera": camera(), "noise": SILENT} | more))


def middle(picture: NDArray[Any], place: NDArray[Any], reach: int = 11) -> NDArray[np.float64]:
    """Return the middle of what is brighter than the corner of a window around a place, x and y [px]."""
    x, y = (round(float(value)) for value in place)
    window = picture[y - reach : y + reach + 1, x - reach : x + reach + 1].astype(float)
    weights = np.abs(window - window[0, 0])
    rows, columns = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    return np.array([x + (weights * columns).sum() / weights.sum(), y + (weights * rows).sum() / weights.sum()])
