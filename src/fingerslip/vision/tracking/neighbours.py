"""What the neighbours of a marker, and all markers together, say of where it is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

__all__ = ["assign", "common_shift", "consistent", "expected_displacement", "nearest_neighbours"]

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Integers = NDArray[np.intp]

_COUNT = 8
_BINS = 6  # bins of shifts that are counted, to a distance between markers
_ROUNDS = 4
# So many neighbours that are displaced alike, within this share of what is allowed, are enough.
_SOME, _ALIKE = 2, 0.25


def nearest_neighbours(points: Floats) -> tuple[Integers, Floats]:
    """Return the nearest neighbours (n, k) of points (n, 2) [px], and the distance (n,) to the first [px]."""
    count = min(_COUNT, len(points) - 1)
    if count < 1:
        return np.empty((len(points), 0), dtype=np.intp), np.full(len(points), np.inf)
    distances, indices = cKDTree(points).query(points, k=count + 1)
    return indices[:, 1:].astype(np.intp), distances[:, 1].astype(np.float64)


def expected_displacement(displacement: Floats, usable: Flags, neighbours: Integers) -> tuple[Floats, Integers]:
    """Return the median of the neighbours' displacements, NaN where none is usable, and how many there are.

    Arrays: displacement (n, 2) [px]; usable (n,); neighbours (n, k); returns (n, 2) [px], (n,).
    """
    count = usable[neighbours].sum(axis=1)
    if not neighbours.shape[1]:
        return np.full_like(displacement, np.nan), count
    # What is not usable comes last.
    values = np.sort(np.where(usable[neighbours][..., None], displacement[neighbours], np.inf), axis=1)
    rows = np.arange(len(displacement))
    middle = 0.5 * (values[rows, np.maximum(count - 1, 0) // 2] + values[rows, np.maximum(count, 1) // 2 * (count > 1)])
    return np.where(count[:, None] > 0, middle, np.nan), count


def consistent(displacement: Floats, sure: Flags, neighbours: Integers, allowed: Floats) -> Flags:
    """Tell which markers are displaced as their neighbours are: about as the median of them, or as some of them.

    Where a contact slips in part, markers at its edge go with the few on their side. Arrays: displacement (n, 2) [px];
    sure (n,); neighbours (n, k); allowed (n,) [px].
    """
    accepted = sure.copy()
    for _ in range(_ROUNDS):
        expected, count = expected_displacement(displacement, accepted, neighbours)
        far = accepted & (count > 2) & (np.linalg.norm(displacement - expected, axis=1) > allowed)
        apart = np.linalg.norm(displacement[neighbours[far]] - displacement[far, None], axis=2)
        alike = (accepted[neighbours[far]] & (apart < _ALIKE * allowed[far, None])).sum(axis=1)
        far[far] = alike < _SOME
        if not far.any():
            break
        accepted &= ~far
    return accepted


def common_shift(points: Floats, candidates: Floats, spacing: float) -> Floats:
    """Return the shift (2,) [px] at which most points (n, 2) [px] have a candidate (m, 2) [px].

    Markers that move by more than half their distance look like others that moved the other way, so nothing local tells
    the two apart. The pattern as a whole does, because it ends somewhere.
    """
    shifts = (candidates[None] - points[:, None]).reshape(-1, 2)
    cells = np.rint(shifts * (_BINS / spacing)).astype(np.intp)
    low = cells.min(axis=0) - 1
    size = cells.max(axis=0) - low + 2
    votes = np.zeros(size, dtype=np.intp)
    np.add.at(votes, tuple((cells - low).T), 1)
    # Neighbouring cells vote together.
    near = np.sum([np.roll(votes, (i, j), (0, 1)) for i in (-1, 0, 1) for j in (-1, 0, 1)], axis=0)
    best = np.array(np.unravel_index(int(near.argmax()), near.shape)) + low
    return np.asarray(shifts[np.abs(cells - best).max(axis=1) <= 1].mean(axis=0))


def assign(expected: Floats, reach: Floats, candidates: Floats) -> tuple[Integers, Integers]:
    """Match markers and candidates one to one so that the sum of all distances, in shares of the reach, is smallest.

    A marker that is not matched counts as one at the end of its reach. Arrays: expected (n, 2), reach (n,),
    candidates (m, 2) [px]; returns (k,), (k,).

    Examples
    --------
    Two markers want the same candidate: the sum decides.

    >>> import numpy as np
    >>> expected, candidates = np.array([[0.0, 0.0], [10.0, 0.0]]), np.array([[6.0, 0.0], [15.0, 0.0]])
    >>> rows, columns = assign(expected, np.full(2, 8.0), candidates)
    >>> rows.tolist(), columns.tolist()
    ([0, 1], [0, 1])
    """
    apart = np.linalg.norm(expected[:, None] - candidates[None], axis=2) / reach[:, None]
    rows, columns = linear_sum_assignment(np.minimum(apart, 1.0))
    near = apart[rows, columns] < 1.0
    return rows[near], columns[near]
