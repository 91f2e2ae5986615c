"""Limits of Newton's method for the contact forces, and the rule by which its line search accepts a step."""

from __future__ import annotations

import numba

__all__ = ["NEWTON_LIMIT", "SEARCH_LIMIT", "decreases_enough"]

# Iterations of Newton's method, and halvings of one of its steps, before the solver tries something else.
NEWTON_LIMIT, SEARCH_LIMIT = 60, 12
# Share of the decrease promised by the slope that a step must achieve (Armijo's rule).
_SUFFICIENT = 1e-4


@numba.njit(cache=True, nogil=True)
def decreases_enough(new_merit, merit, length):  # type: ignore[no-untyped-def]
    """Tell whether a step of relative `length` decreases the merit, the sum of squared residuals [N^2], enough."""
    return new_merit <= (1.0 - 2.0 * _SUFFICIENT * length) * merit
