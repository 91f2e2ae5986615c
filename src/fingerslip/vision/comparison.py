"""How far tracks are from where the markers truly were: matching, error, lost markers, swaps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from fingerslip.errors import InputError
from fingerslip.vision.tracks import tracks_like

Floats = NDArray[np.float64]

#: Distance from the truth within which a position counts as found [px].
KEPT = 1.0
_FAR = 1e6


@dataclass(frozen=True)
class TrackErrors:
    """How tracks compare with the truth, over all frames and all markers that were in the image."""

    frames: int  # how many there are
    markers: int  # how many there are
    rms: float | None  # root mean square along an axis of the errors of what was kept [px]
    largest: float | None  # largest distance of a position from the truth [px]
    kept: float  # share of the marker-frames with a position within 1 px of the truth [-]
    swapped: int  # marker-frames with a position nearer to another marker


def matched_tracks(tracks: xr.Dataset, truth: xr.Dataset) -> xr.Dataset:
    """Return tracks with the markers and times of the truth, matched one to one where they were first seen."""
    tracked, true = tracks["position"].values, truth["position"].values
    if len(tracked) > len(true):
        raise InputError("tracks", f"has {len(tracked)} frames", f"needs at most {len(true)}, as the truth has")
    position, quality = np.full(true.shape, np.nan), np.zeros(true.shape[:2])
    rows, columns = _pairs(tracked, true)
    position[: len(tracked), columns] = tracked[:, rows]
    quality[: len(tracked), columns] = tracks["quality"].values[:, rows]
    attributes = {**truth.attrs, "source": str(tracks.attrs.get("source", ""))}
    return tracks_like(truth, position, truth["time"].values, quality=quality, attributes=attributes)


def _pairs(tracked: Floats, true: Floats) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return which found marker is which known one: the least sum of distances where each was first seen."""
    first = np.isfinite(tracked).all(axis=2).argmax(axis=0)
    start = tracked[first, np.arange(tracked.shape[1])]
    away = np.linalg.norm(start[:, None] - true[first], axis=2)
    rows, columns = linear_sum_assignment(np.nan_to_num(away, nan=_FAR).clip(max=_FAR))
    real = np.isfinite(away[rows, columns])
    return rows[real], columns[real]


def track_errors(tracks: xr.Dataset, truth: xr.Dataset) -> TrackErrors:
    """Compare tracks with the truth."""
    tracked, true = tracks["position"].values, truth["position"].values
    if tracked.shape != true.shape or (tracks["marker"].values != truth["marker"].values).any():
        raise InputError(
            "tracks, truth", f"got {tracked.shape} beside {true.shape}", "needs the same times and markers"
        )
    visible = np.isfinite(true).all(axis=2)
    error = np.where(visible, np.linalg.norm(tracked - true, axis=2), np.nan)
    good = np.nan_to_num(error, nan=np.inf) < KEPT
    swapped = 0
    # Frame by frame to keep memory small.
    for here, places, limit in zip(tracked, true, error, strict=True):
        apart = np.linalg.norm(here[:, None] - places[None], axis=2)
        swapped += int((np.nan_to_num(limit, nan=-1.0) > np.nan_to_num(apart, nan=np.inf).min(axis=1)).sum())
    return TrackErrors(
        frames=len(true),
        markers=int(visible.any(axis=0).sum()),
        rms=float(np.sqrt(np.mean((tracked - true)[good] ** 2))) if good.any() else None,
        largest=float(np.nanmax(error)) if np.isfinite(error).any() else None,
        kept=float(good.sum() / max(visible.sum(), 1)),
        swapped=swapped,
    )
