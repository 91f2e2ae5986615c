"""How far tracks are from where the markers truly were: matching, error, lost markers, swaps, and their statistics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pydantic

from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.libraries import xr
from fingerslip.parameters import Fraction, NonNegativeNumber, Number, parameters
from fingerslip.vision.tracks import tracks_like

#: Distance from the truth within which a position counts as found [px].
KEPT = 1.0
_FAR = 1e6
_FEWEST = 3  # frames in which noise is told from what stays


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
    from scipy.optimize import linear_sum_assignment

    # The least sum of distances where each was first seen.
    first = np.isfinite(tracked).all(axis=2).argmax(axis=0)
    start = tracked[first, np.arange(tracked.shape[1])]
    away = np.linalg.norm(start[:, None] - true[first], axis=2)
    rows, columns = linear_sum_assignment(np.nan_to_num(away, nan=_FAR).clip(max=_FAR))
    real = np.isfinite(away[rows, columns])
    rows, columns = rows[real], columns[real]
    position, quality = np.full(true.shape, np.nan), np.zeros(true.shape[:2])
    position[: len(tracked), columns] = tracked[:, rows]
    quality[: len(tracked), columns] = tracks["quality"].values[:, rows]
    attributes = {**truth.attrs, "source": str(tracks.attrs.get("source", ""))}
    return tracks_like(truth, position, truth["time"].values, quality=quality, attributes=attributes)


def _same_markers(tracks: xr.Dataset, truth: xr.Dataset) -> tuple[Floats, Floats]:
    """Return the positions of tracks and those of the truth, both (n_times, n_markers, n_axes)."""
    tracked, true = tracks["position"].values, truth["position"].values
    if tracked.shape != true.shape or (tracks["marker"].values != truth["marker"].values).any():
        fault = f"got {tracked.shape} beside {true.shape}"
        raise InputError("tracks, truth", fault, "needs the same times and markers in both")
    return tracked, true


def track_errors(tracks: xr.Dataset, truth: xr.Dataset) -> TrackErrors:
    """Compare tracks with the truth."""
    tracked, true = _same_markers(tracks, truth)
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


@parameters
class PositionErrors:
    """Statistics of the errors of marker positions, over both axes and all markers.

    See :func:`point_tracks`.
    """

    noise: Annotated[NonNegativeNumber, "Root mean square of what changes from frame to frame, along an axis [px]."]
    bias: Annotated[NonNegativeNumber, "Root mean square over the markers of what stays, along an axis [px]."] = 0.0
    correlation: Annotated[
        Number,
        pydantic.Field(gt=-1, lt=1),
        "Correlation of what changes with the same one frame later [-]; 0 for white noise.",
    ] = 0.0
    lost: Annotated[Fraction, "Share of the markers that are lost in a frame [-]."] = 0.0

    @property
    def rms(self) -> float:
        """Root mean square of the whole error along an axis [px]."""
        return float(np.hypot(self.noise, self.bias))


def position_errors(tracks: xr.Dataset, truth: xr.Dataset) -> PositionErrors:
    """Return the statistics of the errors of tracks."""
    tracked, true = _same_markers(tracks, truth)
    errors, visible = tracked - true, ~np.isnan(true).any(axis=2)
    lost = float(np.isnan(errors[visible]).any(axis=1).mean()) if visible.any() else 0.0
    counts = (~np.isnan(errors)).sum(axis=0)
    enough = (counts >= _FEWEST).all(axis=1)
    if not enough.any():
        raise InputError("tracks", "has no marker in three frames", "needs some, to tell noise from what stays")
    errors, counts = errors[:, enough], counts[enough]
    means = np.nanmean(errors, axis=0)
    changing = errors - means
    variance = float(np.nansum(changing**2) / (counts - 1).sum())
    # The mean of a few frames has a share of the noise itself.
    staying = float((means**2).mean() - variance * (1.0 / counts).mean())
    products, squares = np.nanmean(changing[1:] * changing[:-1]), np.nanmean(changing**2)
    correlation = products / squares if squares > 0 and np.isfinite(products) else 0.0
    bias = np.sqrt(max(staying, 0.0))
    return PositionErrors(np.sqrt(variance), bias, float(np.clip(correlation, -0.999, 0.999)), lost)
