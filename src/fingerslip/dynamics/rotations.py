"""The check that bodies which are free about several axes turn little."""

from __future__ import annotations

import logging
from collections import Counter

import numpy as np

from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.system.system import System
from fingerslip.errors import InputError

__all__ = ["RotationCheck"]

# About one axis any angle is exact. Angles about several axes are added as if they were small: turned by one, the axis
# of another is wrong by the angle, 10 % at the first, where the user is warned, 20 % at the second, which is refused.
_WARN, _REFUSE = 0.1, 0.2

_logger = logging.getLogger("fingerslip.dynamics")


class RotationCheck:
    """Looks at the rotations of those of a motion's rigid bodies that are free about several axes."""

    def __init__(self, system: System) -> None:
        rigid = [
            freedom for freedom in zip(system.coordinates.rigid, system.unknowns.rigid, strict=True) if freedom[1].turns
        ]
        axes = Counter(freedom.body for _, freedom in rigid)
        turning = [(at, freedom) for at, freedom in rigid if axes[freedom.body] > 1]
        self._at = np.array([at for at, _ in turning], dtype=np.int64)
        self._names = [f"bodies.{freedom.body}.free.{freedom.direction}" for _, freedom in turning]
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
        angles = np.abs(np.atleast_2d(state.displacement)[:, self._at]).max(axis=0)
        self._largest = np.maximum(self._largest, angles)
        worst = int(angles.argmax())
        if angles[worst] > _REFUSE:
            fault = f"the body has turned by {angles[worst]:.3g} rad at t = {np.max(state.time):.6g} s"
            repair = "hold it by a stiffer spring, a damper or another contact, or leave the rotation out of free"
            allowed = f"rotations about several axes are small, up to {_REFUSE:g} rad"
            raise InputError(self._names[worst], fault, allowed, repair)

    def finish(self) -> None:
        """Warn of rotations that were not very small."""
        for name, angle in zip(self._names, self._largest, strict=True):
            if angle > _WARN:
                _logger.warning(
                    "%s: the body turned by up to %.3g rad, taken as small about several axes: results are rough",
                    *(name, angle),
                )
