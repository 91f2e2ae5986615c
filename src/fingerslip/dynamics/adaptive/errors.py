"""Estimates of the error of a step, and how much of it is allowed.

Of implicit dynamics the displacement of a step of length h is that of a Newmark step, which takes the acceleration for
weighted mean values where it is linear. What this leaves out, to its leading term, is (Zienkiewicz & Xie 1991) ::

    e = (beta - 1/6) h^2 (a_1 - a_0)

A quasi-static step is one of implicit Euler. It is taken once whole and once in two halves; what the halves leave is
about the difference of both (step doubling, Hairer, Norsett & Wanner 1993, section II.4), and the halves are kept.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.system.scheme import HHT

__all__ = ["Errors"]

Array = NDArray[np.float64]


class Errors:
    """Errors of the steps of one motion, over those that are allowed.

    Arrays: mass (n, n) [kg].
    """

    def __init__(self, mass: sparse.csr_matrix, tolerance: float) -> None:
        self._mass, self._tolerance, self._largest = mass, tolerance, 0.0

    def of_step(self, before: State, after: State, scheme: HHT) -> float:
        """Return the error of a step of implicit dynamics, over the allowed one."""
        error = (scheme.beta - 1.0 / 6.0) * after.step**2 * (after.acceleration - before.acceleration)
        return self._share(error, after, 1.0)

    def of_halves(self, whole: State, halves: State, share: float) -> float:
        """Return the error of two halves of a quasi-static step, over the allowed one."""
        return self._share(whole.displacement - halves.displacement, halves, share)

    def accept(self, after: State) -> None:
        """Take note of the displacement at the end of a step that is kept."""
        self._largest = max(self._largest, self._size(after.displacement))

    def _share(self, error: Array, after: State, share: float) -> float:
        allowed = self._tolerance * share * max(self._largest, self._size(after.displacement))
        size = self._size(error)
        return size / allowed if allowed else float(size > 0.0)

    def _size(self, field: Array) -> float:
        """Return the norm of a field (n,) [kg^(1/2) m]."""
        return float(np.sqrt(field @ (self._mass @ field)))
