"""Fingertips that tests of anatomy and meshes share."""

from __future__ import annotations

from typing import Any

import numpy as np

from fingerslip.anatomy import Fingertip, fingertip_from

SECTIONS = ("sagittal", "transverse")
VARIANTS = ("original", "flattened", "scaled")


def change(**groups: Any) -> Fingertip:
    """Return the preset with some values changed, written as in a study file."""
    return fingertip_from({"preset": "wang2014-2d", **groups}, "finger")


def shoelace(points: np.ndarray) -> float:
    """Return the area inside a ring of (n, 2) points, positive where it runs counter-clockwise."""
    x, y = points.T
    return float(0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
