"""Which of the things that were found is which of the markers that are looked for: one to one, within reach."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

__all__ = ["assign"]

Floats = NDArray[np.float64]

_FAR = 1e6


def assign(
    expected: Floats, reach: Floats, candidates: Floats, quality: Floats
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Match markers and candidates so that the sum of all distances, in shares of the reach, is smallest.

    Arrays: expected (n, 2) [px]; reach (n,) [px]; candidates (m, 2) [px]; quality (m,); returns (k,).

    Examples
    --------
    Two markers want the same candidate: the sum decides.

    >>> import numpy as np
    >>> expected, found = np.array([[0.0, 0.0], [10.0, 0.0]]), np.array([[6.0, 0.0], [15.0, 0.0]])
    >>> rows, columns = assign(expected, np.full(2, 8.0), found, np.ones(2))
    >>> rows.tolist(), columns.tolist()
    ([0, 1], [0, 1])
    """
    groups = _distinct(candidates, quality, 0.25 * float(reach.min()))
    apart = np.linalg.norm(expected[:, None] - candidates[groups][None], axis=2) / reach[:, None]
    cost = np.where(apart <= 1.0, apart - 0.1 * quality[groups][None], _FAR)
    rows, columns = linear_sum_assignment(cost)
    near = cost[rows, columns] < _FAR
    return rows[near], groups[columns[near]]


def _distinct(candidates: Floats, quality: Floats, apart: float) -> NDArray[np.intp]:
    """Return the best candidate of each group that lies together."""
    kept: list[int] = []
    for index in np.argsort(-quality, kind="stable"):
        if all(np.hypot(*(candidates[index] - candidates[other])) > apart for other in kept):
            kept.append(int(index))
    return np.array(kept, dtype=np.intp)
