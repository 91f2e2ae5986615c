"""How good tracks are: how many markers were seen, noise at rest, intervals in which markers were lost, jumps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.vision.tracking.neighbours import expected_displacement, nearest_neighbours
from fingerslip.vision.tracks import seen

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Lost", "jumps", "lost_intervals", "noise_at_rest", "seen_count", "seen_share"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Lost:
    """An interval in which a marker was not seen."""

    marker: int  # number of the marker
    first: int  # first and last frame without it
    last: int  # first and last frame without it
    returned: bool  # whether it was seen again

    @property
    def frames(self) -> int:
        """How many frames it lasted."""
        return self.last - self.first + 1


def seen_count(tracks: xr.Dataset) -> NDArray[np.intp]:
    """Return how many markers were seen in each frame, shape (n_times,)."""
    count: NDArray[np.intp] = seen(tracks).sum(axis=1)
    return count


def seen_share(tracks: xr.Dataset) -> float:
    """Return the share of all marker-frames that have a position."""
    return float(seen(tracks).mean())


def lost_intervals(tracks: xr.Dataset) -> list[Lost]:
    """Return every interval in which a marker was not seen, by marker and time."""
    gone = ~seen(tracks)
    # A frame on either side in which all are seen makes every interval begin and end.
    edges = np.diff(np.pad(gone, ((1, 1), (0, 0))).astype(np.int8), axis=0)
    found = []
    for column, number in enumerate(tracks["marker"].values):
        first, behind = np.flatnonzero(edges[:, column] == 1), np.flatnonzero(edges[:, column] == -1)
        found += [
            Lost(int(number), int(a), int(b) - 1, bool(b < len(gone))) for a, b in zip(first, behind, strict=True)
        ]
    return found


def noise_at_rest(tracks: xr.Dataset) -> Floats:
    """Return the standard deviation of each marker in the rest frames, the root mean square of both axes, (n,) [px]."""
    noise: Floats = np.sqrt((tracks["rest_noise"].values ** 2).mean(axis=1))
    return noise


def jumps(tracks: xr.Dataset) -> Floats:
    """Return how far each marker moved between frames beyond what its neighbours did [px].

    Arrays: returns (n_times - 1, n_markers).
    """
    position, there = tracks["position"].values, seen(tracks)
    # Markers that were not seen at rest have no neighbours by their reference: their place is far away.
    reference = np.where(np.isfinite(tracks["reference"].values), tracks["reference"].values, 1e6)
    neighbours, _ = nearest_neighbours(reference)
    out = np.full((max(len(position) - 1, 0), position.shape[1]), np.nan)
    for t in range(len(out)):
        both = there[t] & there[t + 1]
        step = np.where(both[:, None], position[t + 1] - position[t], 0.0)
        expected, counts = expected_displacement(reference, step, both, neighbours)
        known = both & (counts > 2)
        out[t, known] = np.linalg.norm(step - expected, axis=1)[known]
    return out
