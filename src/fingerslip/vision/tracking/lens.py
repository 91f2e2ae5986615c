"""Positions as a camera without distortion would have them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingerslip.vision.cameras.calibration import read_calibration
from fingerslip.vision.cameras.intrinsics import Fisheye, Pinhole

__all__ = ["lens_of", "undistorted"]

Floats = NDArray[np.float64]


def lens_of(calibration: Pinhole | Fisheye | str | Path, size: tuple[int, int]) -> Pinhole | Fisheye:
    """Return intrinsics, from a file where a path is given.

    Arrays: size (int, int) [px].
    """
    if isinstance(calibration, str | Path):
        found: Pinhole | Fisheye = read_calibration(calibration, size=size)
        return found
    return calibration


def undistorted(lens: Pinhole | Fisheye, position: Floats) -> Floats:
    """Return pixels of a pinhole with the same camera matrix and no distortion; NaN for what it does not see.

    Arrays: position (..., 2) [px].
    """
    rays = lens.directions(position)
    depth = np.where(rays[..., 2] > 0, rays[..., 2], np.nan)
    return rays[..., :2] / depth[..., None] * (lens.focal_x, lens.focal_y) + (lens.centre_x, lens.centre_y)
