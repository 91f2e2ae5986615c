"""Local maxima of a signal, their distance and their prominence.

They are those of ``scipy.signal.find_peaks``, whose import takes longer than all events of a run.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["far_apart", "local_maxima", "prominences"]

Floats = NDArray[np.float64]
Places = NDArray[np.intp]


def local_maxima(signal: Floats) -> Places:
    """Return where a signal is larger than on both sides; of a level stretch the middle, rounded down.

    Parameters
    ----------
    signal : (n,) array
        The signal, in any unit.

    Examples
    --------
    >>> local_maxima(np.array([0.0, 2.0, 1.0, 3.0, 3.0, 3.0, 0.0, 4.0])).tolist()
    [1, 4]
    """
    if signal.size < 3:
        return np.empty(0, dtype=np.intp)
    # Where a level stretch begins, and where the next one does.
    starts = np.flatnonzero(np.concatenate([[True], signal[1:] != signal[:-1]]))
    ends = np.append(starts[1:], signal.size)
    levels = signal[starts]
    above = np.flatnonzero((levels[1:-1] > levels[:-2]) & (levels[1:-1] > levels[2:])) + 1
    middles: Places = (starts[above] + ends[above] - 1) // 2
    return middles


def far_apart(signal: Floats, maxima: Places, distance: int) -> Places:
    """Return maxima that have no larger one closer than `distance`, beginning with the largest.

    Parameters
    ----------
    signal : (n,) array
        The signal, in any unit.
    maxima : (n_maxima,) array of int
        Places of its maxima, in order.
    distance : int
        How many places kept maxima are apart at least.

    Examples
    --------
    >>> signal = np.array([0.0, 2.0, 1.0, 3.0, 0.0])
    >>> far_apart(signal, local_maxima(signal), 3).tolist()
    [3]
    """
    kept = np.ones(maxima.size, dtype=bool)
    for number in np.argsort(signal[maxima])[::-1]:
        if kept[number]:
            kept[np.abs(maxima - maxima[number]) < distance] = False
            kept[number] = True
    return maxima[kept]


def prominences(signal: Floats, maxima: Places) -> Floats:
    """Return how far a signal falls on both sides of maxima before it is larger than there, in its unit.

    Parameters
    ----------
    signal : (n,) array
        The signal, in any unit.
    maxima : (n_maxima,) array of int
        Places of its maxima.

    Returns
    -------
    (n_maxima,) array
        Each maximum less the higher one of the two lowest values beside it.

    Examples
    --------
    >>> signal = np.array([0.0, 2.0, 1.0, 3.0, 0.0])
    >>> prominences(signal, local_maxima(signal)).tolist()
    [1.0, 3.0]
    """
    return np.array([signal[place] - _valley(signal, int(place)) for place in maxima], dtype=float)


def _valley(signal: Floats, place: int) -> float:
    """Return the higher one of the lowest values on both sides of a maximum, as far as nothing is larger."""
    higher = np.flatnonzero(signal > signal[place])
    before, behind = higher[higher < place], higher[higher > place]
    first = int(before[-1]) + 1 if before.size else 0
    last = int(behind[0]) if behind.size else signal.size
    return float(max(signal[first : place + 1].min(), signal[place:last].min()))
