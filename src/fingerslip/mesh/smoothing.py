"""Smoothing of quadrilaterals: badly shaped cells are improved by moving their free nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["scaled_jacobians", "smoothed"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]

_SWEEPS = 20
_GOOD_ENOUGH = 0.7


def scaled_jacobians(points: Floats, cells: Integers) -> Floats:
    """Return the least scaled Jacobian [-] of the corners of each cell, negative where inverted.

    Arrays: points (n, 2); cells (m, 3); returns (m,).
    """
    corners = points[cells]
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    cross = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    length = np.linalg.norm(ahead, axis=2) * np.linalg.norm(back, axis=2)
    least: Floats = (cross / np.where(length > 0, length, 1.0)).min(axis=1)
    return least


def smoothed(points: Floats, cells: Integers, fixed: Flags) -> Floats:
    """Return node positions in which no node's worst cell is worse than before.

    Each sweep moves the free nodes of badly shaped cells half way to the mean of their neighbours, and takes back
    every move that makes the worst cell at a node worse.

    Arrays: points (n, 2) [m]; cells (m, 4); fixed (n,); returns (n, 2) [m].
    """
    before = points
    for _ in range(_SWEEPS):
        quality = _node_quality(before, cells)
        moving = ~fixed & (quality < _GOOD_ENOUGH)
        before = _accepted(before, _moved(before, cells, moving), cells, quality)
    return before


def _moved(points: Floats, cells: Integers, moving: Flags) -> Floats:
    start, end = cells.ravel(), np.roll(cells, -1, axis=1).ravel()
    first, second = np.concatenate([start, end]), np.concatenate([end, start])
    count = np.bincount(first, minlength=len(points))
    total = np.column_stack([np.bincount(first, points[second, k], minlength=len(points)) for k in (0, 1)])
    mean = total / np.maximum(count, 1)[:, None]
    moved: Floats = np.where(moving[:, None], 0.5 * (points + mean), points)
    return moved


def _accepted(before: Floats, after: Floats, cells: Integers, quality: Floats) -> Floats:
    """Take back the moves of all nodes of cells at which quality falls, until none does."""
    while True:
        worse = _node_quality(after, cells) < quality
        touched = np.zeros(len(before), dtype=bool)
        touched[cells[worse[cells].any(axis=1)]] = True
        back = touched & np.any(after != before, axis=1)
        if not back.any():
            return after
        after = np.where(back[:, None], before, after)


def _node_quality(points: Floats, cells: Integers) -> Floats:
    worst = np.ones(len(points))
    np.minimum.at(worst, cells, scaled_jacobians(points, cells)[:, None])
    return worst
