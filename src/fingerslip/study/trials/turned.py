"""The whole sensor in a slide of any direction, from its half in a slide along +x.

A sensor whose rings all have a multiple of k markers looks the same after a turn by 1/k about its axis, and pressed by
a plane square to its axis it moves the same, turned. The half z >= 0 is mirrored at its plane of symmetry. With a plane
that is tilted along the slide, the tilt turns with the slide.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.specimens.tactip.layout import MarkerPlaces

__all__ = ["turned_whole"]

Floats = NDArray[np.float64]

# Of a turn, by which markers may be beside their places.
_ROUNDING = 1e-6


def turned_whole(positions: Floats, half: MarkerPlaces, whole: MarkerPlaces, turn: float) -> Floats:
    """Return where all markers of a sensor are that slides in a direction.

    Arrays: positions (n_times, n_half, 3) [m]; turn [rad]; returns (n_times, n_whole, 3) [m].
    """
    source = np.mod(whole.azimuth - turn, 2.0 * np.pi)
    rows, mirrored = np.empty(len(source), dtype=np.int64), np.empty(len(source), dtype=bool)
    for number, (ring, azimuth) in enumerate(zip(whole.ring, source, strict=True)):
        rows[number], mirrored[number] = _twin(half, int(ring), float(azimuth), turn)
    found = positions[:, rows].copy()
    found[:, mirrored, 2] *= -1.0
    cos, sin = np.cos(turn), np.sin(turn)
    x, z = found[..., 0].copy(), found[..., 2].copy()
    found[..., 0], found[..., 2] = cos * x - sin * z, sin * x + cos * z
    return found


def _twin(half: MarkerPlaces, ring: int, azimuth: float, turn: float) -> tuple[int, bool]:
    """Return the marker of the half at a place of the slide along +x, and whether it is its mirror image."""
    for angle, mirrored in ((azimuth, False), (-azimuth, True)):
        # On the axis there is no angle.
        beside = np.abs(np.angle(np.exp(1j * (half.azimuth - angle)))) * (half.along > 0.0)
        beside[half.ring != ring] = np.inf
        row = int(np.argmin(beside))
        if beside[row] < _ROUNDING:
            return row, mirrored
    found = f"turns ring {ring} by {np.degrees(turn):.4g} degrees to other places"
    raise InputError("trials.directions", found, "needs a layout that such a turn leaves as it is", "take fewer")
