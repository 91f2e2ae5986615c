"""How the finger in space stands to the plate: turned about z, its lowest point where that of the section is."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from fingerslip.specimens.fingertip.numbers import FingertipNumbers
from fingerslip.specimens.fingertip.outline import outline_curve
from fingerslip.specimens.fingertip.skin_surface import solid_shape

__all__ = ["posed"]

Floats = NDArray[np.float64]


def posed(fingertip: FingertipNumbers, points: Floats) -> Floats:
    """Return (n, 3) points [m] of a level finger where they are when the finger stands at its angle.

    The finger is turned about z and shifted so that the lowest point of its skin is at x = 0, y = -`half_height`.
    """
    turn = _turn(solid_shape(fingertip).angle)
    curve = outline_curve(dataclasses.replace(fingertip, section="sagittal"))
    skin = curve.points[curve.points[:, 0] >= -fingertip.sagittal.pad_length] @ turn.T
    lowest = skin[skin[:, 1].argmin()]
    turned = points.copy()
    turned[:, :2] = points[:, :2] @ turn.T - lowest - [0.0, fingertip.sagittal.half_height]
    return turned


def _turn(angle: float) -> Floats:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
