"""Membranes of many receptors through time, compiled; only who asks for spikes loads this."""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True, nogil=True)
def fire(drive, left, resting, inhibition):  # type: ignore[no-untyped-def]
    """Tell which of k membranes fire in n steps, (n, k): V relaxes exactly towards the drive (n, k) of each step [-].

    A step leaves the share `left` of V; what a spike takes from the drive by the steps since, (m,), ends with 0.
    """
    fired, longest = np.zeros(drive.shape, dtype=np.bool_), len(inhibition) - 1
    for column in range(drive.shape[1]):
        membrane, since = 0.0, longest + resting
        for row in range(len(drive)):
            since += 1
            target = drive[row, column] - inhibition[min(since, longest)]
            membrane = target + (membrane - target) * left
            if since < resting:
                membrane = min(membrane, 0.0)
            if membrane >= 1.0:
                membrane, since, fired[row, column] = 0.0, -1, True
    return fired
