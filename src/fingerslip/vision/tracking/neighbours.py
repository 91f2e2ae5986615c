"""What the neighbours of a marker say of it: where it should be, and whether it can be where it was found."""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

__all__ = ["consistent", "expected_displacement", "nearest_neighbours"]

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

_COUNT = 8
# Gradients count as if they were known to be zero to this many squared neighbour distances: rims extrapolate less.
_STIFFNESS = 0.5


def nearest_neighbours(points: Floats) -> tuple[NDArray[np.intp], Floats]:
    """Return the nearest neighbours of each point and the distance to the first.

    Arrays: points (n, 2) [px]; returns (n, k) [px].
    """
    count = min(_COUNT, len(points) - 1)
    if count < 1:
        return np.empty((len(points), 0), dtype=np.intp), np.full(len(points), np.inf)
    distances, indices = cKDTree(points).query(points, k=count + 1)
    return indices[:, 1:].astype(np.intp), distances[:, 1].astype(np.float64)


def consistent(
    reference: Floats, displacement: Floats, sure: Flags, neighbours: NDArray[np.intp], allowed: Floats
) -> Flags:
    """Tell which markers are displaced as their neighbours are.

    The one that differs most from the others is left out, and the rest judged again, until all agree.

    Arrays: reference (n, 2) [px]; displacement (n, 2) [px]; sure (n,); neighbours (n, k); allowed (n,) [px].
    """
    kept = sure.copy()
    _drop_strangers(reference, displacement, kept, neighbours, allowed)
    return kept


def expected_displacement(
    reference: Floats, displacement: Floats, usable: Flags, neighbours: NDArray[np.intp]
) -> tuple[Floats, NDArray[np.intp]]:
    """Return what the neighbours' displacements, fitted by an affine map, say of each marker.

    Arrays: reference, displacement (n, 2) [px]; usable (n,); neighbours (n, k); returns (n, 2) [px].
    """
    out = np.empty_like(displacement)
    counts = np.empty(len(reference), dtype=np.intp)
    _expect(reference, displacement, usable, neighbours, out, counts)
    return out, counts


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _expect(  # type: ignore[no-untyped-def]  # noqa: PLR0917
    reference, displacement, usable, neighbours, out, counts
):
    for n in range(len(reference)):
        counts[n] = _expect_one(reference, displacement, usable, neighbours, n, out)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _expect_one(  # type: ignore[no-untyped-def]  # noqa: PLR0917
    reference, displacement, usable, neighbours, n, out
):
    """Fit the neighbours' displacements around marker n; return how many there are."""
    count, mx, my, mu, mv = 0, 0.0, 0.0, 0.0, 0.0
    for k in neighbours[n]:
        if usable[k]:
            count += 1
            mx += reference[k, 0] - reference[n, 0]
            my += reference[k, 1] - reference[n, 1]
            mu += displacement[k, 0]
            mv += displacement[k, 1]
    if count == 0:
        out[n, 0], out[n, 1] = math.nan, math.nan
        return count
    mx, my, mu, mv = mx / count, my / count, mu / count, mv / count
    xx, xy, yy, xu, yu, xv, yv, nearest = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, math.inf
    for k in neighbours[n]:
        if usable[k]:
            dx, dy = reference[k, 0] - reference[n, 0], reference[k, 1] - reference[n, 1]
            nearest = min(nearest, dx * dx + dy * dy)
            dx, dy = dx - mx, dy - my
            du, dv = displacement[k, 0] - mu, displacement[k, 1] - mv
            xx += dx * dx
            xy += dx * dy
            yy += dy * dy
            xu += dx * du
            yu += dy * du
            xv += dx * dv
            yv += dy * dv
    xx += _STIFFNESS * nearest
    yy += _STIFFNESS * nearest
    determinant = xx * yy - xy * xy
    out[n, 0] = mu - ((yy * xu - xy * yu) * mx + (xx * yu - xy * xu) * my) / determinant
    out[n, 1] = mv - ((yy * xv - xy * yv) * mx + (xx * yv - xy * xv) * my) / determinant
    return count


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _drop_strangers(reference, displacement, kept, neighbours, largest):  # type: ignore[no-untyped-def]
    expected = np.zeros((len(reference), 2))
    for _ in range(len(reference)):
        worst, which = 1.0, -1
        for n in range(len(reference)):
            if kept[n] and _expect_one(reference, displacement, kept, neighbours, n, expected) > 2:
                apart = math.hypot(displacement[n, 0] - expected[n, 0], displacement[n, 1] - expected[n, 1])
                if apart / largest[n] > worst:
                    worst, which = apart / largest[n], n
        if which < 0:
            return
        kept[which] = False
