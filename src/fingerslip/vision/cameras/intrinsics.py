"""Intrinsics of a camera: from points in its own frame to pixels and back, by OpenCV's pinhole and fisheye models.

The camera's frame has x to the right, y down and z forwards, from the centre of the lens. Pixels count from the middle
of the first one, as in OpenCV.
"""

from __future__ import annotations

import math
from typing import Annotated, Protocol

import numpy as np
import pydantic
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.parameters import Number, parameters
from fingerslip.vision.cameras.distortion import (
    PINHOLE_COUNTS,
    fisheye_angles,
    fisheye_distances,
    largest_angle,
    largest_radius,
    pinhole_distorted,
    pinhole_undistorted,
)

__all__ = ["Fisheye", "Intrinsics", "Pinhole", "PixelCount", "PositiveNumber", "fisheye_for_view", "pinhole_for_view"]

Floats = NDArray[np.float64]
PixelCount = Annotated[int, pydantic.Field(ge=1, le=100_000)]
PositiveNumber = Annotated[Number, pydantic.Field(gt=0)]


class Intrinsics(Protocol):
    """What a camera does to points in its own frame."""

    @property
    def width(self) -> int:
        """Width of the image [px]."""

    @property
    def height(self) -> int:
        """Height of the image [px]."""

    def project(self, points: Floats) -> Floats:
        """Return pixels (..., 2) of points (..., 3) [m] in the camera's frame; NaN for what has no image.

        Pixels may be outside the image.
        """

    def directions(self, pixels: Floats) -> Floats:
        """Return unit vectors (..., 3) of the rays that pixels (..., 2) see, in the camera's frame; NaN for none."""


class _Matrix:
    """A camera with focal lengths and a principal point."""

    width: PixelCount
    height: PixelCount
    focal_x: PositiveNumber
    focal_y: PositiveNumber
    centre_x: Number
    centre_y: Number

    @property
    def camera_matrix(self) -> Floats:
        """OpenCV's camera matrix, shape (3, 3) [px]."""
        return np.array([[self.focal_x, 0.0, self.centre_x], [0.0, self.focal_y, self.centre_y], [0.0, 0.0, 1.0]])

    def _pixels(self, plane: Floats) -> Floats:
        return plane * (self.focal_x, self.focal_y) + (self.centre_x, self.centre_y)

    def _plane(self, pixels: Floats) -> Floats:
        return (np.asarray(pixels, dtype=np.float64) - (self.centre_x, self.centre_y)) / (self.focal_x, self.focal_y)


@parameters
class Pinhole(_Matrix):
    """A pinhole with OpenCV's lens distortion.

    Parameters
    ----------
    width, height : int
        Size of the image [px].
    focal_x, focal_y : float
        Focal lengths [px].
    centre_x, centre_y : float
        Principal point [px].
    distortion : tuple of float
        None, 4, 5, 8 or 12 coefficients k1, k2, p1, p2, k3, k4, k5, k6, s1 to s4 in OpenCV's order.

    Raises
    ------
    InputError
        For another number of coefficients, and for values that cannot be.

    Examples
    --------
    >>> Pinhole(640, 480, 500.0, 500.0, 319.5, 239.5).project(np.array([0.0, 0.01, 0.1])).tolist()
    [319.5, 289.5]
    """

    width: PixelCount
    height: PixelCount
    focal_x: PositiveNumber
    focal_y: PositiveNumber
    centre_x: Number
    centre_y: Number
    distortion: tuple[Number, ...] = ()

    def __post_init__(self) -> None:
        """Check the number of coefficients."""
        if len(self.distortion) not in PINHOLE_COUNTS:
            _refuse(len(self.distortion), ", ".join(map(str, PINHOLE_COUNTS)))

    def project(self, points: Floats) -> Floats:
        """Return pixels (..., 2) of points (..., 3) [m] in the camera's frame; NaN behind it and beyond the lens."""
        points = np.asarray(points, dtype=np.float64)
        depth = np.where(points[..., 2] > 0, points[..., 2], np.nan)
        plane = points[..., :2] / depth[..., None]
        beyond = np.hypot(plane[..., 0], plane[..., 1]) > largest_radius(self.distortion)
        return self._pixels(pinhole_distorted(np.where(beyond[..., None], np.nan, plane), self.distortion))

    def directions(self, pixels: Floats) -> Floats:
        """Return unit vectors (..., 3) of the rays that pixels (..., 2) see; NaN where the lens images none."""
        plane = pinhole_undistorted(self._plane(pixels), self.distortion)
        rays = np.concatenate([plane, np.ones_like(plane[..., :1])], axis=-1)
        found: Floats = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
        return found


@parameters
class Fisheye(_Matrix):
    """A fisheye camera of OpenCV's model (Kannala & Brandt 2006), without skew.

    Parameters
    ----------
    width, height : int
        Size of the image [px].
    focal_x, focal_y : float
        Focal lengths [px].
    centre_x, centre_y : float
        Principal point [px].
    distortion : tuple of float
        None or four coefficients k1 to k4.

    Raises
    ------
    InputError
        For another number of coefficients, and for values that cannot be.
    """

    width: PixelCount
    height: PixelCount
    focal_x: PositiveNumber
    focal_y: PositiveNumber
    centre_x: Number
    centre_y: Number
    distortion: tuple[Number, ...] = ()

    def __post_init__(self) -> None:
        """Check the number of coefficients."""
        if len(self.distortion) not in (0, 4):
            _refuse(len(self.distortion), "0, 4")

    def project(self, points: Floats) -> Floats:
        """Return pixels (..., 2) of points (..., 3) [m] in the camera's frame; NaN beyond the lens.

        Points beside and behind the camera have images as far as the lens reaches, which OpenCV does not give them.
        """
        points = np.asarray(points, dtype=np.float64)
        across = np.hypot(points[..., 0], points[..., 1])
        angle = np.arctan2(across, points[..., 2])
        angle = np.where(angle > largest_angle(self.distortion), np.nan, angle)
        distance = fisheye_distances(angle, self.distortion)
        # On the axis the direction does not matter.
        scale = distance / np.where(across > 0, across, 1.0)
        return self._pixels(points[..., :2] * scale[..., None])

    def directions(self, pixels: Floats) -> Floats:
        """Return unit vectors (..., 3) of the rays that pixels (..., 2) see; NaN where the lens images none."""
        plane = self._plane(pixels)
        distance = np.hypot(plane[..., 0], plane[..., 1])
        angle = fisheye_angles(distance, self.distortion)
        across = plane * (np.sin(angle) / np.where(distance > 0, distance, 1.0))[..., None]
        return np.concatenate([across, np.cos(angle)[..., None]], axis=-1)


def _refuse(count: int, allowed: str) -> None:
    repair = "leave zeros at the end out; the tilt of a sensor is not modelled"
    raise InputError("distortion", f"got {count} coefficients", f"needs one of {allowed}", repair)


def pinhole_for_view(width: int, height: int, view_width: float, distance: float) -> Pinhole:
    """Return a pinhole without distortion that sees a given width at a given distance.

    Parameters
    ----------
    width, height : int
        Size of the image [px].
    view_width : float
        Length that the width of the image shows [m].
    distance : float
        Distance from the lens [m] at which it does.

    Raises
    ------
    InputError
        Where a length is not above 0.

    Examples
    --------
    >>> pinhole_for_view(640, 480, 0.064, 0.05).focal_x
    500.0
    """
    _check_view(view_width, distance)
    focal = width * distance / view_width
    return Pinhole(width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1))


def fisheye_for_view(width: int, height: int, view_width: float, distance: float) -> Fisheye:
    """Return a fisheye with equal distances for equal angles that sees a given width at a given distance."""
    _check_view(view_width, distance)
    focal = 0.5 * width / math.atan2(0.5 * view_width, distance)
    return Fisheye(width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1))


def _check_view(view_width: float, distance: float) -> None:
    if not (view_width > 0 and distance > 0):
        raise InputError("view_width, distance", f"got {view_width}, {distance}", "needs lengths > 0 in metres")
