"""The rigid motion that fits moving markers best, and what it leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["RigidMotions", "fit_rigid_motions"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class RigidMotions:
    """Rigid motions from rest, one for each time; NaN where too few markers are seen."""

    translation: Floats  # (n_times, n_axes), mean displacement of the markers that are seen, in units of the positions
    rotation: Floats  # (n_times,), angle [rad]: in the plane from x towards y, in space without a sign
    residual: Floats  # (n_times, n_markers, n_axes)


def fit_rigid_motions(rest: Floats, position: Floats) -> RigidMotions:
    """Fit a rotation and a translation to markers at each time by least squares (Kabsch 1976).

    Arrays: rest (n_markers, n_axes); position (n_times, n_markers, n_axes).
    """
    dim = rest.shape[1]
    known = ~(np.isnan(position).any(axis=2) | np.isnan(rest).any(axis=1))
    weights = known / np.maximum(known.sum(axis=1), 1)[:, None]
    before, after = np.nan_to_num(rest), np.nan_to_num(position)
    middle_before, middle_after = weights @ before, np.einsum("tm,tma->ta", weights, after)
    spread = (before[None] - middle_before[:, None]) * weights[:, :, None]
    turns = _rotations(np.einsum("tma,tmb->tab", spread, after - middle_after[:, None]))
    turned = np.einsum("tab,tmb->tma", turns, before[None] - middle_before[:, None])
    residual = after - middle_after[:, None] - turned
    residual[~known] = np.nan
    enough = known.sum(axis=1) >= dim
    residual[~enough] = np.nan
    translation = np.where(enough[:, None], middle_after - middle_before, np.nan)
    return RigidMotions(translation, np.where(enough, _angles(turns), np.nan), residual)


def _rotations(covariance: Floats) -> Floats:
    """Return the rotations (n, d, d) that bring vectors nearest to others, from their covariance (n, d, d)."""
    left, _, right = np.linalg.svd(covariance)
    # Without a reflection: the direction that matters least gives way.
    signs = np.sign(np.linalg.det(left @ right))
    right[:, -1] *= np.where(signs == 0, 1.0, signs)[:, None]
    turns: Floats = np.swapaxes(left @ right, 1, 2)
    return turns


def _angles(turns: Floats) -> Floats:
    if turns.shape[1] == 2:
        return np.arctan2(turns[:, 1, 0], turns[:, 0, 0])
    axis = np.stack([turns[:, i, j] - turns[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=1)
    angles: Floats = np.arctan2(np.linalg.norm(axis, axis=1), np.trace(turns, axis1=1, axis2=2) - 1.0)
    return angles
