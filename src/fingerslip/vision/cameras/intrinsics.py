"""Intrinsics of a camera: from points in its own frame to pixels and back, by OpenCV's pinhole and fisheye models.

The camera's frame has x to the right, y down and z forwards, from the centre of the lens. Pixels count from the middle
of the first one, as in OpenCV.

Lens distortion of OpenCV's pinhole and fisheye models, forwards and back, on points of the plane at distance one.

Points are (..., 2) arrays of x/z and y/z [-] of the camera frame. Distortion grows with the distance from the axis up
to a largest one, beyond which the polynomials fold the picture back onto itself; what is beyond has no image.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Protocol

import numpy as np
import pydantic
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.parameters import Number, parameters

__all__ = [
    "PINHOLE_COUNTS",
    "Fisheye",
    "Intrinsics",
    "Pinhole",
    "PixelCount",
    "PositiveNumber",
    "distort_pinhole",
    "fisheye_angles",
    "fisheye_distances",
    "fisheye_for_view",
    "largest_angle",
    "largest_radius",
    "pinhole_for_view",
    "undistort_pinhole",
]


Floats = NDArray[np.float64]

#: Numbers of coefficients that a pinhole may have: k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 in OpenCV's order.
PINHOLE_COUNTS = (0, 4, 5, 8, 12)
_REAL = 1e-9
_STEPS, _HALVINGS, _EXACT = 200, 60, 1e-12


def distort_pinhole(points: Floats, coefficients: Sequence[float]) -> Floats:
    """Return where the lens of a pinhole puts undistorted points.

    With r² = x² + y²: x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶)/(1 + k4 r² + k5 r⁴ + k6 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
    + s1 r² + s2 r⁴, and y' alike with p1 (r² + 2 y²) + 2 p2 x y + s3 r² + s4 r⁴ (OpenCV, module calib).

    Arrays: points (..., 2) [-]; returns (..., 2) [-].
    """
    radial, shift = _pinhole_terms(points, coefficients)
    return points * radial[..., None] + shift


def _pinhole_terms(points: Floats, coefficients: Sequence[float]) -> tuple[Floats, Floats]:
    """Return the radial factor (...) and the tangential and prism shift (..., 2) at undistorted points."""
    numerator, denominator = _radial(coefficients)
    p1, p2 = _pad(coefficients)[2:4]
    s1, s2, s3, s4 = _pad(coefficients)[8:]
    x, y = points[..., 0], points[..., 1]
    square = x * x + y * y
    shift = np.stack(
        [
            2.0 * p1 * x * y + p2 * (square + 2.0 * x * x) + (s1 + s2 * square) * square,
            p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y + (s3 + s4 * square) * square,
        ],
        axis=-1,
    )
    return numerator(square) / denominator(square), shift


def undistort_pinhole(points: Floats, coefficients: Sequence[float]) -> Floats:
    """Return the undistorted points of distorted ones, by fixed-point iteration; NaN where it does not converge.

    Arrays: points (..., 2) [-].
    """
    undistorted = np.array(points, dtype=np.float64)
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            radial, shift = _pinhole_terms(undistorted, coefficients)
            last, undistorted = undistorted, (points - shift) / radial[..., None]
            if not (np.abs(undistorted - last) > _EXACT).any():
                break
        wrong = ~(np.abs(distort_pinhole(undistorted, coefficients) - points) < 1e3 * _EXACT).all(axis=-1)
        wrong |= np.hypot(undistorted[..., 0], undistorted[..., 1]) > largest_radius(coefficients)
    undistorted[wrong] = np.nan
    return undistorted


def largest_radius(coefficients: Sequence[float]) -> float:
    """Return the largest distance from the axis [-] that a pinhole's radial distortion images; may be infinite.

    The image radius is r N(r²)/D(r²); it rises until N D + 2 u (N' D - N D') is zero at u = r², or D is.
    """
    numerator, denominator = _radial(coefficients)
    u = Polynomial([0.0, 1.0])
    slope = numerator * denominator + 2.0 * u * (numerator.deriv() * denominator - numerator * denominator.deriv())
    return math.sqrt(min(_first_root(slope), _first_root(denominator)))


def fisheye_distances(angles: Floats, coefficients: Sequence[float]) -> Floats:
    """Return the distance from the axis at which a fisheye images rays at some angles from the axis.

    Theta (1 + k1 theta² + k2 theta⁴ + k3 theta⁶ + k4 theta⁸) (Kannala & Brandt 2006; OpenCV, module fisheye).

    Units: angles [rad].
    """
    lengths: Floats = angles * _fisheye(coefficients)(angles * angles)
    return lengths


def fisheye_angles(distances: Floats, coefficients: Sequence[float]) -> Floats:
    """Return the angles [rad] of what a fisheye images at some distances from the axis; NaN beyond the largest.

    By bisection between the axis and the largest angle, so that it is sure also where the distance hardly rises.
    """
    low = np.zeros_like(distances)
    high = np.full_like(distances, min(largest_angle(coefficients), np.pi))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        inside = fisheye_distances(middle, coefficients) < distances
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    result = 0.5 * (low + high)
    return np.where(np.abs(fisheye_distances(result, coefficients) - distances) < 1e3 * _EXACT, result, np.nan)


def largest_angle(coefficients: Sequence[float]) -> float:
    """Return the largest angle from the axis [rad] that a fisheye images; may be infinite."""
    series = _fisheye(coefficients)
    return math.sqrt(_first_root(series + 2.0 * Polynomial([0.0, 1.0]) * series.deriv()))


def _pad(coefficients: Sequence[float]) -> list[float]:
    return [*coefficients, *[0.0] * (PINHOLE_COUNTS[-1] - len(coefficients))]


def _radial(coefficients: Sequence[float]) -> tuple[Polynomial, Polynomial]:
    """Return numerator and denominator of a pinhole's radial factor as polynomials of r²."""
    k1, k2, _, _, k3, k4, k5, k6 = _pad(coefficients)[:8]
    return Polynomial([1.0, k1, k2, k3]), Polynomial([1.0, k4, k5, k6])


def _fisheye(coefficients: Sequence[float]) -> Polynomial:
    """Return a fisheye's factor as a polynomial of the squared angle."""
    return Polynomial([1.0, *coefficients])


def _first_root(polynomial: Polynomial) -> float:
    """Return the least positive real root of a polynomial whose constant is not 0; infinity without one."""
    # The inverses of the roots are those of the reversed polynomial, whose leading coefficient is never small.
    inverse = Polynomial(polynomial.coef[::-1]).roots()
    real = inverse.real[(np.abs(inverse.imag) <= _REAL * np.abs(inverse)) & (inverse.real > _REAL)]
    return float(1.0 / real.max()) if real.size else math.inf


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
        return self._pixels(distort_pinhole(np.where(beyond[..., None], np.nan, plane), self.distortion))

    def directions(self, pixels: Floats) -> Floats:
        """Return unit vectors (..., 3) of the rays that pixels (..., 2) see; NaN where the lens images none."""
        plane = undistort_pinhole(self._plane(pixels), self.distortion)
        rays = np.concatenate([plane, np.ones_like(plane[..., :1])], axis=-1)
        unit_rays: Floats = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
        return unit_rays


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
