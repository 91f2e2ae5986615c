"""What the cameras of a study saw of a run, as the report shows it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Film"]


@dataclass(frozen=True)
class Film:
    """What one camera saw of one run.

    Parameters
    ----------
    run : str
        Name of the run.
    kind : {'internal', 'external'}
        Which camera.
    tracks, truth : xarray.Dataset
        Tracks in pixels of the tracker, with the markers of the truth, and the truth.
    numbers : mapping of str to float or None
        How far they are from each other; the fields of :class:`~fingerslip.vision.comparison.TrackErrors`.
    frames : mapping of float to (height, width) array of uint8
        Some frames by their times [s]; none of a point camera.
    """

    run: str
    kind: str
    tracks: xr.Dataset
    truth: xr.Dataset
    numbers: Mapping[str, float | None]
    frames: Mapping[float, NDArray[np.uint8]]
