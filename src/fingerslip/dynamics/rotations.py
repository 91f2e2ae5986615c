"""The check that the rotations of rigid bodies stay small."""

from __future__ import annotations

import logging

import numpy as np

from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.system.system import System
from fingerslip.errors import InputError

__all__ = ["RotationCheck"]

# Lever arms and normals that do not turn are wrong by half the square of the angle along themselves, by the angle
# across: 0.5 % and 10 % at the first, where the user is warned, 2 % and 20 % at the second, which is refused.
_WARN, _REFUSE = 0.1, 0.2

_logger = logging.getLogger("fingerslip.dynamics")


class RotationCheck:
    """Looks at the rotations of a motion's rigid bodies.

    Parameters
    ----------
    system : System
        The discrete system.
    """

    def __init__(self, system: System) -> None:
        turning = [
            (at, own) for at, own in zip(system.coordinates.rigid, system.unknowns.rigid, strict=True) if own.turns
        ]
        self._at = np.array([at for at, _ in turning], dtype=np.int64)
        self._names = [f"bodies.{own.body}.free.{own.direction}" for _, own in turning]
        self._largest = np.zeros(self._at.size)

    def look(self, state: State) -> None:
        """Check a state.

        Raises
        ------
        InputError
            Where a body has turned too far to call that small.
        """
        if not self._names:
            return
        angles = np.abs(state.displacement[self._at])
        self._largest = np.maximum(self._largest, angles)
        worst = int(angles.argmax())
        if angles[worst] > _REFUSE:
            found = f"the body has turned by {angles[worst]:.3g} rad at t = {state.time:.6g} s"
            repair = "hold it by a stiffer spring, a damper or another contact, or leave the rotation out of free"
            raise InputError(self._names[worst], found, f"rotations are small, up to {_REFUSE:g} rad", repair)

    def finish(self) -> None:
        """Warn of rotations that were not very small."""
        for name, angle in zip(self._names, self._largest, strict=True):
            if angle > _WARN:
                _logger.warning(
                    "%s: the body turned by up to %.3g rad; rotations are taken as small, so results are rough",
                    *(name, angle),
                )
