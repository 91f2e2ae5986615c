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
    """What one camera saw of one run."""

    run: str  # name of the run
    kind: str  # which camera
    tracks: xr.Dataset  # tracks in pixels of the tracker, with the markers of the truth, and the truth
    truth: xr.Dataset  # tracks in pixels of the tracker, with the markers of the truth, and the truth
    numbers: Mapping[str, float | None]  # how far they are from each other
    frames: Mapping[float, NDArray[np.uint8]]  # (height, width), some frames by their times [s]
