"""Displacement from rest and smooth velocity of markers, some of which are not seen at times."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError

__all__ = ["rest_positions", "smooth_velocity", "window_frames"]

Floats = NDArray[np.float64]

_DEGREE = 2


def rest_positions(position: Floats, frames: int) -> Floats:
    """Return the mean position of each marker in the first frames, shape (n_markers, n_axes); NaN where never seen.

    Arrays: position (n_times, n_markers, n_axes).
    """
    if not 1 <= frames <= len(position):
        raise InputError("rest", f"got {frames} frames", f"needs 1 to {len(position)}, as many as there are")
    first = position[:frames]
    counts = (~np.isnan(first)).sum(axis=0)
    found: Floats = np.where(counts > 0, np.nansum(first, axis=0) / np.maximum(counts, 1), np.nan)
    return found


def window_frames(times: Floats, smoothing: float) -> int:
    """Return the odd number of frames, at least five, that a smoothing time [s] spans."""
    if not (np.isfinite(smoothing) and smoothing > 0):
        raise InputError("smoothing", f"got {smoothing}", "needs a time > 0 in seconds")
    step = float(np.median(np.diff(times))) if times.size > 1 else np.inf
    frames = 2 * max(round(0.5 * smoothing / step), _DEGREE) + 1
    if frames > times.size:
        found = f"{times.size} frames, and the smoothing time spans {frames}"
        raise InputError("tracks: time", f"has {found}", "needs as many frames", "give a shorter smoothing time")
    return frames


def smooth_velocity(position: Floats, times: Floats, frames: int) -> Floats:
    """Return the velocity of markers by parabolas fitted to a few frames (Savitzky & Golay 1964).

    Where every frame is there, at even times, this is the filter of Savitzky and Golay; here times may be uneven, and
    frames in which a marker was not seen have no weight. At both ends the parabola of the first or last frames is used.
    White noise of a deviation s in the positions becomes s sqrt(3 / (h (h + 1) (2 h + 1))) / step in the velocity, with
    2 h + 1 frames.

    Arrays: position (n_times, n_markers, n_axes); times (n_times,) [s]; returns (n_times, n_markers, n_axes).
    """
    half, count = frames // 2, times.size
    middles = np.clip(np.arange(count), half, count - 1 - half)
    known = np.asarray(~np.isnan(position).any(axis=2))
    filled = np.nan_to_num(position)
    span = times[middles + half] - times[middles - half]
    moments = np.zeros((2 * _DEGREE + 1, count, known.shape[1]))
    sums = np.zeros((_DEGREE + 1, *position.shape))
    for offset in range(-half, half + 1):
        rows = middles + offset
        # Times in units of the window keep the equations well conditioned.
        powers = ((times[rows] - times) / span)[None, :] ** np.arange(2 * _DEGREE + 1)[:, None]
        moments += powers[:, :, None] * known[rows]
        sums += powers[: _DEGREE + 1, :, None, None] * filled[rows]
    velocity = _slopes(moments, sums) / span[:, None, None]
    velocity[~known | (moments[0] < _DEGREE + 2)] = np.nan
    return velocity


def _slopes(moments: Floats, sums: Floats) -> Floats:
    """Return the slopes of fitted parabolas by Cramer's rule from their moments: no small systems to be solved."""
    m0, m1, m2, m3, m4 = moments
    s0, s1, s2 = sums
    determinant = m0 * (m2 * m4 - m3 * m3) - m1 * (m1 * m4 - m2 * m3) + m2 * (m1 * m3 - m2 * m2)
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second, third = (
            (factor / determinant)[..., None] for factor in (m2 * m3 - m1 * m4, m0 * m4 - m2 * m2, m1 * m2 - m0 * m3)
        )
        slopes: Floats = first * s0 + second * s1 + third * s2
    return slopes
