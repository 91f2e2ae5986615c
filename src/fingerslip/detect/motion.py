"""How markers moved since rest: displacement and velocity of each, from past frames alone, with gaps filled."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.vision.tracks import seen

if TYPE_CHECKING:
    import xarray as xr

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class MotionSettings:
    """How motion is read from tracks.

    Parameters
    ----------
    rest_frames : int
        Frames at the start whose mean is the rest position: 100 in Cordova Bulens et al. 2023.
    window : int
        Frames through which the velocity is fitted, the newest included. At 0.3 mm/s markers move less in a frame than
        their noise, so the difference of two frames says little; the paper does not print its own. Assumed.
    least_seen : float
        Share of the markers that has to be seen in a frame; a frame with fewer is not classified. Assumed.

    Raises
    ------
    InputError
        Where a number is outside what is meaningful.
    """

    rest_frames: int = 100
    window: int = 11
    least_seen: float = 0.5

    def __post_init__(self) -> None:
        if self.rest_frames < 1:
            raise InputError("rest_frames", f"got {self.rest_frames}", "needs a number of frames >= 1")
        if self.window < 2:
            raise InputError("window", f"got {self.window}", "needs a number of frames >= 2")
        if not 0.0 < self.least_seen <= 1.0:
            raise InputError("least_seen", f"got {self.least_seen}", "needs a share above 0 and up to 1")


@dataclass(frozen=True)
class Motion:
    """Markers over time."""

    time: Floats  # (n_times,) [s]
    rest: Floats  # (n_markers, 2), positions at rest, in the unit of the tracks
    displacement: Floats  # (n_times, n_markers, 2), since rest
    velocity: Floats  # (n_times, n_markers, 2), slope of the displacement over the last frames, per second
    ring: NDArray[np.intp]  # (n_markers,), ring of each marker, 0 in the centre
    seen: Bools  # (n_times, n_markers)
    usable: Bools  # (n_times,), frames in which enough of them were seen

    @property
    def filled(self) -> int:
        """Number of positions that were not seen, and filled."""
        return int((~self.seen).sum())

    def at(self, frames: NDArray[np.intp] | slice) -> Motion:
        """Return some frames of it."""
        over_time = ("time", "displacement", "velocity", "seen", "usable")
        return replace(self, **{name: getattr(self, name)[frames] for name in over_time})


def markers_of(tracks: xr.Dataset, kind: str) -> xr.Dataset:
    """Return the markers of one kind, ``internal`` or ``external``, seen in the plane of the first two axes."""
    chosen = np.flatnonzero(tracks["kind"].values.astype(str) == kind)
    if chosen.size == 0:
        raise InputError("tracks", f"have no {kind} markers", f"needs {kind} markers", "track them too")
    return tracks.isel(marker=chosen, axis=slice(0, 2))


def rest_positions(tracks: xr.Dataset, rest_frames: int) -> Floats:
    """Return the mean positions of markers in the frames at rest, (n_markers, 2)."""
    if tracks.sizes["time"] < rest_frames:
        fault = f"have {tracks.sizes['time']} frames"
        raise InputError("tracks", fault, f"needs the {rest_frames} at rest", "give a smaller rest_frames")
    return mean_at_rest(tracks["position"].values[:rest_frames], tracks["marker"].values)


def mean_at_rest(position: Floats, markers: NDArray[np.intp]) -> Floats:
    """Return the mean (n_markers, 2) of positions (n_frames, n_markers, 2) that are NaN where a marker is not seen."""
    count = (~np.isnan(position).any(axis=2)).sum(axis=0)
    if not count.all():
        where, fault = f"tracks: marker {markers[np.argmin(count)]}", "is seen in none of the frames at rest"
        repair = "leave the marker out, or give a larger rest_frames"
        raise InputError(where, fault, "needs a rest position of every marker", repair)
    mean: Floats = np.nansum(position, axis=0) / count[:, None]
    return mean


def motion_of(tracks: xr.Dataset, settings: MotionSettings | None = None, kind: str = "internal") -> Motion:
    """Return how the markers of one kind moved since rest."""
    settings = settings or MotionSettings()
    chosen = markers_of(tracks, kind)
    rest = rest_positions(chosen, settings.rest_frames)
    visible, time = seen(chosen), chosen["time"].values
    displacement = fill_unseen(chosen["position"].values - rest, visible, neighbour_weights(rest))
    usable = visible.mean(axis=1) >= settings.least_seen
    ring = chosen["ring"].values.astype(np.intp) if "ring" in chosen.variables else np.zeros(len(rest), dtype=np.intp)
    velocity = velocities(time, displacement, visible, settings.window)
    return Motion(time, rest, displacement, velocity, ring, visible, usable)


def neighbour_weights(rest: Floats) -> Floats:
    """Return how much each marker counts where another one is missing, (n, n): distance to the power -4.

    A marker counts most for its neighbours; with fewer markers seen, those farther away take over.
    """
    squared = ((rest[:, None] - rest) ** 2).sum(axis=2)
    spacing = squared[squared > 0].min() if (squared > 0).any() else 1.0
    weights: Floats = (np.maximum(squared, spacing) / spacing) ** -2.0
    np.fill_diagonal(weights, 0.0)
    return weights


def fill_unseen(displacement: Floats, visible: Bools, weights: Floats) -> Floats:
    """Return displacements (n_times, n_markers, 2), those of unseen markers from the seen ones of the same frame.

    They are 0 where none is seen; `visible` is (n_times, n_markers), `weights` (n_markers, n_markers).
    """
    if visible.all():
        return displacement
    total = (visible @ weights.T)[:, :, None]
    sums = np.einsum("tmd,nm->tnd", np.where(visible[:, :, None], displacement, 0.0), weights, optimize=True)
    guessed = np.divide(sums, total, out=np.zeros_like(sums), where=total > 0)
    return np.where(visible[:, :, None], displacement, guessed)


def velocities(time: Floats, displacement: Floats, visible: Bools, window: int) -> Floats:
    """Return the slope of straight lines through the last frames, by least squares, per second.

    A marker's line goes through the frames of the window in which it was seen. With fewer than two of them, as in the
    first frame, its velocity is the mean of the others', and 0 where there are none. Shapes are (n_times,) [s],
    (n_times, n_markers, 2) and (n_times, n_markers).
    """
    seen_before = visible.astype(np.float64)
    count, sum_t, sum_tt = (np.zeros_like(seen_before) for _ in range(3))
    sum_x, sum_tx = (np.zeros_like(displacement) for _ in range(2))
    for back in range(min(window, len(time))):
        now, then = slice(back, None), slice(0, len(time) - back)
        # Times from the newest frame and displacements from its own keep the sums free of rounding.
        ago = (time[then] - time[now])[:, None]
        change = displacement[then] - displacement[now]
        weight = seen_before[then]
        count[now] += weight
        sum_t[now] += weight * ago
        sum_tt[now] += weight * ago**2
        sum_x[now] += weight[:, :, None] * change
        sum_tx[now] += (weight * ago)[:, :, None] * change
    determined = (count > 1.5)[:, :, None]
    numerator = count[:, :, None] * sum_tx - sum_t[:, :, None] * sum_x
    spread = (count * sum_tt - sum_t**2)[:, :, None]
    slope = np.divide(numerator, spread, out=np.zeros_like(numerator), where=determined)
    number = determined.sum(axis=1)
    mean = np.divide(slope.sum(axis=1), number, out=np.zeros_like(slope[:, 0]), where=number > 0)
    return np.where(determined, slope, mean[:, None, :])
