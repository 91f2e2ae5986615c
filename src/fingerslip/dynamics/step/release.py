"""Contact forces that a step must not count: those of nodes that leave, and friction that turns.

A step counts the forces at its start and at its end. The contact force at the start would push a node that is off the
counterface at the end, and friction at the start would drive a slip that turns round in the step: both make energy.
Such a step is solved again without these forces, so that contact takes energy out or leaves it.

With contact forces r and the weights of the scheme, the force of contact in the equation of motion is ::

    q_1 = w_1 r_1 - w_0 r_0 + e_1,    impulse over the step: h [(1 - m) q_0 + m q_1]

where the correction e is zero until forces are dropped. At a node that leaves, e_1 cancels r_0 and makes the impulse
vanish; that leaves z_1 = s q_0 with s = -(1 - m)/m. This remainder fades as z_1 = s z_0, with which it gives no impulse
in any later step. Where friction turns, the same is done with the tangential parts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.dynamics.system.scheme import Scheme

Marks = NDArray[np.int8]

#: Marks of candidates: their friction turns; they leave the counterface, which drops all that turning drops.
TURNS, LEAVES = 1, 2

# Both relative: to the largest force that was dropped, far below what contact is solved to; and to the friction limit.
_FADED, _ROUNDING = 1e-16, 1e-9


@dataclass(frozen=True)
class Release:
    """What dropped contact forces leave in the equation of motion, in global components."""

    fading: Floats  # (n_c, dim), remainder z [N]
    cancelled: (
        Floats  # (n_c, dim), forces at the start of the last step, weighted, that were dropped in it, w_0 r_0 [N]
    )
    largest: float  # the largest force that was dropped so far [N]

    @property
    def correction(self) -> Floats:
        """Correction e of the contact force in the equation of motion, shape (n_c, dim) [N]."""
        return self.fading + self.cancelled


@numba.njit(cache=True, nogil=True)
def mark_changes(forces_before, forces, relative_before, relative, stiffness, friction):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Mark the candidates (n_c,) whose force at the start of a step must not count.

    Arrays: forces (n_c, dim) [N]; relative (n_c, dim) [m]; stiffness (n_c,) [N/m]; friction (n_c,), coefficients [-].

    Examples
    --------
    The first node leaves. The second slips forwards, and friction pulled it forwards more than it resists now:

    >>> start, end = np.array([[1.0, 0.0], [1.0, 0.5]]), np.array([[0.0, 0.0], [0.5, -0.25]])
    >>> relative = np.zeros((2, 2)), np.array([[0.1, 0.0], [0.0, 3.0]])
    >>> mark_changes(start, end, *relative, np.ones(2), np.full(2, 0.5)).tolist()
    [2, 1]
    """
    count, dim = forces.shape
    marks = np.zeros(count, dtype=np.int8)
    for i in range(count):
        if forces_before[i, 0] <= 0.0:
            continue
        if forces[i, 0] <= 0.0:
            marks[i] = LEAVES
            continue
        work = tangential = 0.0
        for k in range(1, dim):
            change = (forces[i, k] - forces_before[i, k]) / stiffness[i]
            work += (relative[i, k] - relative_before[i, k] + change) * (forces[i, k] + forces_before[i, k])
            tangential += forces[i, k] ** 2
        limit = friction[i] * forces[i, 0]
        if np.sqrt(tangential) >= limit * (1.0 - _ROUNDING) and work > _ROUNDING * limit**2 / stiffness[i]:
            marks[i] = TURNS
    return marks


def fading_forces(scheme: Scheme, release: Release) -> Floats:
    """Return what a release at the start of a step leaves at its end, shape (n_c, dim) [N]."""
    return remainder(scheme) * release.fading


def fade(scheme: Scheme, release: Release) -> Release | None:
    """Return a release after a step in which no force was dropped; None where nothing is left of it."""
    fading = fading_forces(scheme, release)
    if np.abs(fading).max(initial=0.0) <= _FADED * release.largest:
        return None
    return Release(fading, np.zeros_like(fading), release.largest)


def drop(
    scheme: Scheme, forces: tuple[Floats, Floats], release: Release | None, marks: Marks, frames: Floats
) -> tuple[Release, Floats]:
    """Drop forces (n_c, dim) [N] at the start of the step before and of this one; also return what replaces them."""
    nothing = np.zeros_like(forces[1])
    weights = scheme.start_weight, scheme.end_weight, remainder(scheme)
    before = nothing if release is None else release.cancelled
    added, cancelled = dropped_forces(marks, forces[1], forces[0], before, frames, weights)
    fading = added if release is None else added + fading_forces(scheme, release)
    largest = max(0.0 if release is None else release.largest, float(np.abs(added).max(initial=0.0)))
    return Release(fading, cancelled, largest), added + cancelled


@numba.njit(cache=True, nogil=True)
def dropped_forces(marks, forces, earlier, cancelled_before, frames, weights):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Return what dropped forces leave in the equation of motion, and what of them is cancelled, (n_c, dim) each [N].

    They are made of forces at the start of the step and of that before, and of what was cancelled in that; weights are
    w_0, w_1 and s.
    """
    start_weight, end_weight, left = weights
    added, cancelled = np.zeros_like(forces), np.zeros_like(forces)
    for i in np.flatnonzero(marks):
        of_added = of_cancelled = 0.0
        for k in range(forces.shape[1]):
            pushing = end_weight * forces[i, k] - start_weight * earlier[i, k] + cancelled_before[i, k]
            added[i, k], cancelled[i, k] = left * pushing, start_weight * forces[i, k]
            of_added += added[i, k] * frames[i, 0, k]
            of_cancelled += cancelled[i, k] * frames[i, 0, k]
        if marks[i] == TURNS:
            for k in range(forces.shape[1]):
                added[i, k] -= of_added * frames[i, 0, k]
                cancelled[i, k] -= of_cancelled * frames[i, 0, k]
    return added, cancelled


def remainder(scheme: Scheme) -> float:
    """Return s = -(1 - m)/m, with which a force gives no impulse over a step [-]."""
    return -(1.0 - scheme.end_share) / scheme.end_share
