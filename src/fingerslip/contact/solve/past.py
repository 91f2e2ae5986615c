"""What the last steps tell of the next one: a first guess of its contact forces, and the body's response to that.

The response is linear. Where the compliance stays as it is, that to forces extrapolated from two steps follows from
those of these steps, but for nodes that would open: only these have to be multiplied by the compliance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.solve.compliance import Compliance

__all__ = ["Past", "first_guess", "next_past"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Past:
    """Contact forces of all n_c candidates that were found last."""

    forces: Array  # (n_c, dim), those found last, and those one step before [N]
    before: Array  # (n_c, dim), those found last, and those one step before [N]
    response: Array | None = None  # (n_c, dim), displacement of the body under them, without the penalties [m]
    response_before: Array | None = None  # (n_c, dim), displacement of the body under them, without the penalties [m]
    frames: Array | None = None  # (n_c, dim, dim), frames of the candidates

    def has_frames_of(self, compliance: Compliance) -> bool:
        """Tell whether a compliance is in the same frames."""
        if self.frames is None or compliance.frames is None:
            return self.frames is compliance.frames
        return self.frames is compliance.frames or np.array_equal(self.frames, compliance.frames)

    def under_other_compliance(self) -> Past:
        """Return the forces without responses, which another compliance makes others."""
        return replace(self, response=None, response_before=None)


def first_guess(
    compliance: Compliance, past: Past | None, start: Array, origin: Array | None
) -> tuple[Array, Array | None]:
    """Return forces (n_c, dim) [N] to begin a step with, and the body's response to them [m] where it is known.

    Arrays: start (n_c, dim) [N]; origin (n_c, dim) [N].
    """
    if past is None:
        return start, None
    response = past.response if np.array_equal(start, past.forces) else None
    if origin is not None:
        return start, response
    guess = 2.0 * start - past.before
    opens = (start[:, 0] <= 0.0) | (guess[:, 0] <= 0.0)
    lost = np.where(opens[:, None], guess, 0.0)
    guess[opens] = 0.0
    if response is None or past.response_before is None:
        return guess, None
    of_guess = 2.0 * response - past.response_before
    return guess, of_guess - compliance.response(lost) if lost.any() else of_guess


def next_past(past: Past | None, forces: Array, response: Array | None, start: Array, origin: Array | None) -> Past:
    """Return what a step leaves for the next one; `forces` were found, the others as in :func:`first_guess`."""
    if origin is not None:
        is_same = past is not None and np.array_equal(origin, past.before)
        return Past(forces, origin, response, past.response_before if past is not None and is_same else None)
    is_same = past is not None and np.array_equal(start, past.forces)
    return Past(forces, start, response, past.response if past is not None and is_same else None)
