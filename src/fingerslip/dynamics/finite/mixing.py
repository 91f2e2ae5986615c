"""Mixing of iterates: Anderson's acceleration of an iteration on factors that are not quite the tangent's.

An iteration leads from an iterate with a residual to an end. Of the last few of them, the combination with the least
residual, in the sense of least squares, is also made of the ends: that is where the next iterate goes (Anderson 1965;
Walker & Ni 2011). For a linear problem this is the generalised minimal residual method.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Mixing"]

Array = NDArray[np.float64]

# Iterations that are combined: more do not shrink the residual faster, as contact changes meanwhile.
_KEPT = 5
# Singular values of the changes of residuals below this part of the largest, or of the residual, are rounding.
_ROUNDING = 1e-8


class Mixing:
    """The last iterations of a step."""

    def __init__(self) -> None:
        self._residuals: list[Array] = []
        self._ends: list[Array] = []

    def next(self, end: Array, residual: Array) -> Array:
        """Return where the next iterate goes, shape (n,).

        Parameters
        ----------
        end : (n,) array
            Where the last iteration leads.
        residual : (n,) array
            Residual of its iterate [N].
        """
        self._residuals = [*self._residuals[1 - _KEPT :], residual]
        self._ends = [*self._ends[1 - _KEPT :], end]
        if len(self._ends) == 1:
            return end
        changes = np.stack([residual - earlier for earlier in self._residuals[:-1]], axis=1)
        largest = max(float(np.linalg.norm(changes)), 1e-300)
        rounding = _ROUNDING * max(1.0, float(np.linalg.norm(residual)) / largest)
        weights = np.linalg.lstsq(changes, residual, rcond=rounding)[0]
        mixed = end.copy()
        for weight, earlier in zip(weights, self._ends[:-1], strict=True):
            mixed -= weight * (end - earlier)
        return mixed
