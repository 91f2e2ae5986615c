"""The fingerprint of the fingertip in space: ripples across the finger on its palmar side."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from fingerslip.specimens.fingertip.interfaces import fade, surface_depth
from fingerslip.specimens.fingertip.numbers import FingertipNumbers
from fingerslip.specimens.fingertip.outline import outline_curve

__all__ = ["relief_depth"]

Floats = NDArray[np.float64]


def relief_depth(fingertip: FingertipNumbers, points: Floats) -> Floats:
    """Return the depths [m] of the skin at (n, 3) points of its mean surface [m]: negative on fingerprint crests.

    Crests run across the finger; along it the ripples are those of the sagittal section. They fade at the ends of the
    ridge zones of both sections, and there are none on the back.
    """
    along = _palmar_arc_length(dataclasses.replace(fingertip, section="sagittal"), points[:, 0])
    across = _palmar_arc_length(dataclasses.replace(fingertip, section="transverse"), points[:, 2])
    ripple = surface_depth(dataclasses.replace(fingertip, section="sagittal"), along)
    depth: Floats = ripple * fade(fingertip.transverse.zone, across) * (points[:, 1] < 0.0)
    return depth


def _palmar_arc_length(fingertip: FingertipNumbers, place: Floats) -> Floats:
    """Return the arc lengths of the palmar half of a section at positions along its horizontal axis [m]."""
    curve = outline_curve(fingertip)
    widest = curve.points[:, 0].argmax()
    palmar = slice(int(curve.points[:widest, 0].argmin()), int(widest) + 1)
    return np.interp(place, curve.points[palmar, 0], curve.arc_length[palmar])
