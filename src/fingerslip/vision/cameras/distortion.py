"""Lens distortion of OpenCV's pinhole and fisheye models, forwards and back, on points of the plane at distance one.

Points are (..., 2) arrays of x/z and y/z [-] of the camera frame. Distortion grows with the distance from the axis up
to a largest one, beyond which the polynomials fold the picture back onto itself; what is beyond has no image.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

__all__ = [
    "PINHOLE_COUNTS",
    "fisheye_angles",
    "fisheye_distances",
    "largest_angle",
    "largest_radius",
    "pinhole_distorted",
    "pinhole_undistorted",
]

Floats = NDArray[np.float64]

#: Numbers of coefficients that a pinhole may have: k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 in OpenCV's order.
PINHOLE_COUNTS = (0, 4, 5, 8, 12)
_REAL = 1e-9
_STEPS, _HALVINGS, _EXACT = 200, 60, 1e-12


def pinhole_distorted(points: Floats, coefficients: Sequence[float]) -> Floats:
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
    p1, p2 = _padded(coefficients)[2:4]
    s1, s2, s3, s4 = _padded(coefficients)[8:]
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


def pinhole_undistorted(points: Floats, coefficients: Sequence[float]) -> Floats:
    """Return the undistorted points of distorted ones, by fixed-point iteration; NaN where it does not converge.

    Arrays: points (..., 2) [-].
    """
    found = np.array(points, dtype=np.float64)
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            radial, shift = _pinhole_terms(found, coefficients)
            last, found = found, (points - shift) / radial[..., None]
            if not (np.abs(found - last) > _EXACT).any():
                break
        wrong = ~(np.abs(pinhole_distorted(found, coefficients) - points) < 1e3 * _EXACT).all(axis=-1)
        wrong |= np.hypot(found[..., 0], found[..., 1]) > largest_radius(coefficients)
    found[wrong] = np.nan
    return found


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
    found: Floats = angles * _fisheye(coefficients)(angles * angles)
    return found


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
    found = 0.5 * (low + high)
    return np.where(np.abs(fisheye_distances(found, coefficients) - distances) < 1e3 * _EXACT, found, np.nan)


def largest_angle(coefficients: Sequence[float]) -> float:
    """Return the largest angle from the axis [rad] that a fisheye images; may be infinite."""
    series = _fisheye(coefficients)
    return math.sqrt(_first_root(series + 2.0 * Polynomial([0.0, 1.0]) * series.deriv()))


def _padded(coefficients: Sequence[float]) -> list[float]:
    return [*coefficients, *[0.0] * (PINHOLE_COUNTS[-1] - len(coefficients))]


def _radial(coefficients: Sequence[float]) -> tuple[Polynomial, Polynomial]:
    """Return numerator and denominator of a pinhole's radial factor as polynomials of r²."""
    k1, k2, _, _, k3, k4, k5, k6 = _padded(coefficients)[:8]
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
