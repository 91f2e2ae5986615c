"""How often a triangulated surface winds around a point: inside or outside, whatever small defects it has."""

from __future__ import annotations

import math

import numba
import numpy as np

from fingerslip.arrays import Floats


def winding_numbers(corners: Floats, points: Floats) -> Floats:
    """Return the generalised winding number of a surface around points (Jacobson, Kavan & Sorkine-Hornung 2013).

    It is the solid angle under which the surface is seen, over 4 pi: 1 inside and 0 outside a closed surface whose
    normals face outwards, and in between near a hole; (n,) for points (n, 3) [m] and corners (m, 3, 3) [m].
    """
    return np.asarray(_winding_numbers(np.ascontiguousarray(corners), np.ascontiguousarray(points)))


@numba.njit(cache=True)
def _winding_numbers(corners: Floats, points: Floats) -> Floats:
    numbers = np.empty(len(points))
    for row in range(len(points)):
        total = 0.0
        for triangle in range(len(corners)):
            total += _half_solid_angle(corners[triangle], points[row])
        numbers[row] = total / (2.0 * math.pi)
    return numbers


@numba.njit(cache=True)
def _half_solid_angle(corners: Floats, point: Floats) -> float:
    """Return half the solid angle of a triangle (van Oosterom & Strackee 1983)."""
    ax, ay, az = corners[0, 0] - point[0], corners[0, 1] - point[1], corners[0, 2] - point[2]
    bx, by, bz = corners[1, 0] - point[0], corners[1, 1] - point[1], corners[1, 2] - point[2]
    cx, cy, cz = corners[2, 0] - point[0], corners[2, 1] - point[1], corners[2, 2] - point[2]
    a = math.sqrt(ax * ax + ay * ay + az * az)
    b = math.sqrt(bx * bx + by * by + bz * bz)
    c = math.sqrt(cx * cx + cy * cy + cz * cz)
    triple = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    ab, bc, ca = ax * bx + ay * by + az * bz, bx * cx + by * cy + bz * cz, cx * ax + cy * ay + cz * az
    return math.atan2(triple, a * b * c + ab * c + bc * a + ca * b)
