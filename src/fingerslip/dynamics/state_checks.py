"""Checks of every state: that no node beside the candidates touches, and that bodies turn little."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.contact.candidates import check_outsiders
from fingerslip.contact.counterfaces import Counterface
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.system.operators import Outsiders, Rotations
from fingerslip.dynamics.system.system import System
from fingerslip.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Steps:
    """What checks look at: k states of a motion."""

    time: Array  # (k,) [s]
    motion: tuple[Array, Array, Array]  # (k, n), displacement [m], velocity and acceleration
    counterfaces: Array  # (k, n_counterfaces, dim), their prescribed displacement [m]

    @staticmethod
    def of(state: State) -> Steps:
        """Return what of a state, or of several, time first in their arrays, is looked at; nothing else is kept."""
        fields = state.displacement, state.velocity, state.acceleration
        displacement, velocity, acceleration = (field.reshape(-1, field.shape[-1]) for field in fields)
        travel = state.counterfaces.reshape(len(displacement), *state.counterfaces.shape[-2:])
        return Steps(np.ravel(state.time), (displacement, velocity, acceleration), travel)

    @staticmethod
    def join(parts: Sequence[Steps]) -> Steps:
        """Return several of them as one."""
        if len(parts) == 1:
            return parts[0]
        displacement, velocity, acceleration = map(np.concatenate, zip(*(part.motion for part in parts), strict=True))
        times, travel = (np.concatenate([getattr(part, name) for part in parts]) for name in ("time", "counterfaces"))
        return Steps(times, (displacement, velocity, acceleration), travel)


class Check(Protocol):
    """Looks at every state of a motion, the first included."""

    def look(self, steps: Steps) -> None:
        """Look at states."""

    def finish(self) -> None:
        """Say what is to be said of all of them."""
        return


class OutsideCheck(Check):
    """Refuses slip outside the candidates."""

    def __init__(self, system: System) -> None:
        numbered = enumerate(zip(system.outsiders, system.counterfaces.shapes, strict=True))
        self._beside = [_Beside(*contact, number, system.rotations) for number, contact in numbered]

    def look(self, steps: Steps) -> None:
        """Check states; refuse slip outside."""
        for number, beside in enumerate(self._beside):
            outsiders, gaps = beside.outsiders, beside.gaps(steps.motion[0], steps.counterfaces[:, number])
            for time, row in zip(steps.time.tolist(), gaps, strict=True):
                check_outsiders(
                    *(row, outsiders.nodes, outsiders.positions, time),
                    shape=beside.shape,
                    number=number,
                    searched=outsiders.searched,
                )


class _Beside:
    """The k nodes beside the candidates of a counterface; gaps to what is flat need but one displacement of each."""

    def __init__(self, outsiders: Outsiders, shape: Counterface, number: int, rotations: Rotations | None) -> None:
        self.outsiders, self.shape, self._number = outsiders, shape, number
        self._rotations = rotations if rotations is not None and rotations.axes[:, number].any() else None
        # The unknowns that they depend on, and the map from these to their displacement, or to that along the normal.
        moved: Any = outsiders.relative
        self._columns = np.unique(moved.indices) if sparse.issparse(moved) else np.arange(moved.shape[1])
        self._moved = moved[:, self._columns]
        if self._rotations is None and shape.is_flat:
            along = sparse.kron(sparse.identity(len(outsiders.nodes)), shape.unit_normal[None], format="csr")
            self._moved = along @ self._moved

    def gaps(self, fields: Array, travel: Array) -> Array:
        """Return the gaps (n, k) [m] for displacements of all unknowns (n, m) and of the counterface (n, dim) [m]."""
        positions, moved = self.outsiders.positions, (self._moved @ fields[:, self._columns].T).T
        if self.shape.is_flat and self._rotations is None:
            return np.asarray(self.shape.gap(positions) + moved - (travel @ self.shape.unit_normal)[:, None])
        points = positions + moved.reshape(len(fields), *positions.shape) - travel[:, None]
        if self._rotations is not None:
            counterface = np.full(len(positions), self._number)
            turned = self._rotations.matrices(fields[:, self._rotations.at])[:, counterface]
            points = self._rotations.seen(turned, points, counterface)
        return self.shape.gap(points.reshape(-1, positions.shape[1])).reshape(len(fields), -1)


# About one axis any angle is exact. Angles about several axes are added as if they were small: turned by one, the axis
# of another is wrong by the angle, 10 % at the first, where the user is warned, 20 % at the second, which is refused.
_WARN, _REFUSE = 0.1, 0.2

_logger = logging.getLogger("fingerslip.dynamics")


class RotationCheck(Check):
    """Looks at the rotations of those of a motion's rigid bodies that are free about several axes."""

    def __init__(self, system: System) -> None:
        pairs = zip(system.coordinates.rigid, system.unknowns.rigid, strict=True)
        rigid = [(at, freedom) for at, freedom in pairs if freedom.turns]
        axes = Counter(freedom.body for _, freedom in rigid)
        turning = [(at, freedom) for at, freedom in rigid if axes[freedom.body] > 1]
        self._at = np.array([at for at, _ in turning], dtype=np.int64)
        self._names = [f"bodies.{freedom.body}.free.{freedom.direction}" for _, freedom in turning]
        self._largest = np.zeros(self._at.size)

    def look(self, steps: Steps) -> None:
        """Check states; refuse a body that has turned too far to call that small."""
        if not self._names:
            return
        angles = np.abs(steps.motion[0][:, self._at])
        self._largest = np.maximum(self._largest, angles.max(axis=0))
        beyond = np.flatnonzero(angles.max(axis=1) > _REFUSE)
        if beyond.size:
            first, worst = beyond[0], int(angles[beyond[0]].argmax())
            fault = f"the body has turned by {angles[first, worst]:.3g} rad at t = {steps.time[first]:.6g} s"
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
