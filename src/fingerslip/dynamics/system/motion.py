"""The prescribed motion of counterfaces, from the phases of a programme."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.counterfaces import Counterface
from fingerslip.contact.frames import sliding_direction
from fingerslip.errors import InputError
from fingerslip.model.programme import Hold, Lift, Phase, Press, Slide, phase_duration

__all__ = ["Motion", "counterface_motion", "largest_approach", "phase_table"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """Piecewise linear motion of a counterface."""

    knots: Array  # (n_phases + 1,), times at which the velocity changes [s]
    positions: Array  # (n_phases + 1, dim), displacement at the knots [m]

    def displacement(self, times: Array) -> Array:
        """Return the displacement [m] at `times` (n,) [s], shape (n, dim); constant after the last knot."""
        return np.column_stack([np.interp(times, self.knots, part) for part in self.positions.T])

    def velocity(self, times: Array) -> Array:
        """Return the velocity [m/s] at `times` (n,) [s], shape (n, dim); at a knot that of the phase before."""
        if self.knots.size < 2:
            return np.zeros((len(times), self.positions.shape[1]))
        durations = np.diff(self.knots)
        slopes = np.diff(self.positions, axis=0) / durations[:, None]
        # Multiples of the step meet the knots up to rounding only.
        phase = np.searchsorted(self.knots + 1e-9 * durations.min(), times, side="left") - 1
        rates = np.vstack([slopes, np.zeros(self.positions.shape[1])])
        return rates[np.clip(phase, 0, len(slopes))]


def phase_table(programme: Sequence[Phase]) -> tuple[list[str], Array]:
    """Return the kinds of the phases and the times between them, shape (n_phases + 1,) [s]."""
    kinds = [type(phase).__name__.lower() for phase in programme]
    return kinds, np.concatenate([[0.0], np.cumsum([phase_duration(phase) for phase in programme])])


def counterface_motion(programme: Sequence[Phase], counterface: Counterface, where: str = "programme") -> Motion:
    """Return the motion of one counterface."""
    travels = [_travel(phase, counterface, f"{where}.{number}") for number, phase in enumerate(programme)]
    dim = counterface.dim
    positions = np.concatenate([np.zeros((1, dim)), np.cumsum(np.reshape(travels, (-1, dim)), axis=0)])
    return Motion(phase_table(programme)[1], positions)


def _travel(phase: Phase, counterface: Counterface, where: str) -> Array:
    normal = counterface.unit_normal
    match phase:
        case Press():
            return phase.depth * normal
        case Lift():
            return -phase.distance * normal
        case Hold():
            return np.zeros_like(normal)
        case Slide():
            along = _direction(phase, counterface.unit_normal, f"{where}.slide.direction")
            return phase.distance * along + phase.press * normal


def _direction(phase: Slide, normal: Array, where: str) -> Array:
    if phase.direction is None:
        return sliding_direction(normal)
    if len(phase.direction) != normal.size:
        raise InputError(where, f"got {len(phase.direction)} components", f"needs {normal.size}")
    # Only where it points to counts: components of any size must not overflow.
    direction = np.asarray(phase.direction, dtype=float) / (np.abs(phase.direction).max() or 1.0)
    along: Array = direction - (direction @ normal) * normal
    if np.linalg.norm(along) <= 1e-6 * np.linalg.norm(direction) or not direction.any():
        raise InputError(where, f"got {list(phase.direction)}", "needs a direction along the counterface")
    return along / np.linalg.norm(along)


def largest_approach(motion: Motion, counterface: Counterface) -> float:
    """Return the largest travel of a counterface along its unit normal [m]."""
    return float(np.max(motion.positions @ counterface.unit_normal, initial=0.0))
