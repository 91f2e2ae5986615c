"""What rests in tracks: the first frames."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fingerslip.vision.tracking.layouts import nearest_neighbours

Floats = NDArray[np.float64]

FEWEST = 5  # frames and markers without which there is no rest and no pattern
# Rest ends where markers leave it by so many times their noise, and by this share of the distance between them.
STIRRED, _STIR = 3.0, 0.02


def rest_length(position: Floats) -> int:
    """Return in how many of the first frames the markers (n_frames, n_markers, 2) rest, as they do in five or more."""
    at_rest: Floats = np.ma.masked_invalid(position[:FEWEST]).mean(axis=0).filled(np.nan)
    is_seen = np.isfinite(at_rest).all(axis=1)
    if len(position) <= FEWEST or is_seen.sum() < FEWEST:
        return len(position)
    spacing = float(np.median(nearest_neighbours(at_rest[is_seen])[1]))
    stirred = np.sqrt(np.ma.masked_invalid(((position - at_rest) ** 2).sum(axis=2)).mean(axis=1))
    limit = max(STIRRED * float(stirred[:FEWEST].mean()), _STIR * spacing)
    later = np.flatnonzero((stirred[FEWEST:] > limit).filled(False))
    return max(FEWEST, FEWEST + int(later[0]) - 2) if later.size else len(position)
