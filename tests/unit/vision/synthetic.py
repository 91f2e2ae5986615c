"""Tracks that tests share."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from fingerslip.marker_layouts import ring_layout
from fingerslip.vision.tracks import make_tracks


def moving_tracks(times: int = 5, units: str = "px", dim: int = 2, **more: Any) -> xr.Dataset:
    """Return 25 markers on rings that move along x; the last one is not seen at the second time."""
    layout = ring_layout(1e-3, (1, 8, 16))
    rest = layout.position * (1e5 if units == "px" else 1.0)
    position = np.zeros((times, layout.count, dim))
    position[:, :, :2] = rest + np.array([320.0, 240.0])
    position[:, :, 0] += np.arange(times)[:, None]
    if times > 1:
        position[1, -1] = np.nan
    given = {"ring": layout.ring, "angle": layout.angle} | more
    return make_tracks(position, np.arange(times) / 30.0, units=units, **given)
