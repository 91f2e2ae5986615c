"""Checks of every state: that no node beside the candidates touches, and that bodies turn little."""

from __future__ import annotations

import logging
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.contact.candidates import check_outsiders
from fingerslip.contact.counterfaces import Counterface
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.system.operators import Outsiders, Rotations
from fingerslip.dynamics.system.system import System
from fingerslip.errors import InputError

__all__ = ["OutsideCheck", "RotationCheck"]

Array = NDArray[np.float64]


class OutsideCheck:
    """Looks at every state of a motion, at several at once: each look costs, whatever it looks at."""

    def __init__(self, system: System) -> None:
        numbered = enumerate(zip(system.outsiders, system.counterfaces.shapes, strict=True))
        self._beside = [_beside(*contact, number, system.rotations) for number, contact in numbered]
        # Only what the check reads is kept of states.
        self._waiting: list[tuple[Array, Array, list[Array]]] = []
        self._at_once = system.coordinates.checks_at_once

    def look(self, state: State) -> None:
        """Check a state, or several, time first in their arrays, now or with some that follow; refuse slip outside."""
        displacements = np.atleast_2d(state.displacement)
        travels = state.counterfaces.reshape(len(displacements), *state.counterfaces.shape[-2:])
        moved = [displacements[:, neighbours.columns] for neighbours in self._beside]
        self._waiting.append((np.atleast_1d(state.time), travels, moved))
        if sum(len(times) for times, *_ in self._waiting) >= self._at_once:
            self.finish()

    def finish(self) -> None:
        """Check the states that wait; errors as of :meth:`look`."""
        waiting, self._waiting = self._waiting, []
        if not waiting:
            return
        times = np.concatenate([times for times, *_ in waiting]).tolist()
        travels = np.concatenate([travels for _, travels, _ in waiting])
        for number, beside in enumerate(self._beside):
            fields = np.concatenate([moved[number] for *_, moved in waiting])
            for time, gaps in zip(times, beside.gaps(fields, travels[:, number]), strict=True):
                outsiders = beside.outsiders
                check_outsiders(
                    *(gaps, outsiders.nodes, outsiders.positions, time),
                    shape=beside.shape,
                    number=number,
                    searched=outsiders.searched,
                )


@dataclass(frozen=True)
class _Beside:
    """Nodes beside the candidates of a counterface."""

    outsiders: Outsiders  # the k nodes
    shape: Counterface  # the counterface
    columns: NDArray[np.integer]  # (m,), the unknowns that their displacement depends on
    moved: Array | sparse.csr_matrix  # map from these to their displacement, or to that along the normal
    number: int  # which of the counterfaces it is
    rotations: Rotations | None  # the rotations of rigid bodies, whose unknowns are the last columns

    def gaps(self, fields: Array, travel: Array) -> Array:
        """Return the gaps, shape (n, k) [m], for unknowns (n, m) and displacements (n, dim) of the counterface [m]."""
        positions, moved = self.outsiders.positions, (self.moved @ fields[:, : self.moved.shape[1]].T).T
        if self.shape.is_flat and self.rotations is None:
            result: Array = self.shape.gap(positions) + moved - (travel @ self.shape.unit_normal)[:, None]
            return result
        points = positions + moved.reshape(len(fields), *positions.shape) - travel[:, None]
        if self.rotations is not None:
            counterface = np.full(len(positions), self.number)
            turned = self.rotations.matrices(fields[:, self.moved.shape[1] :])[:, counterface]
            points = self.rotations.seen(turned, points, counterface)
        return self.shape.gap(points.reshape(-1, positions.shape[1])).reshape(len(fields), -1)


def _beside(outsiders: Outsiders, shape: Counterface, number: int, rotations: Rotations | None) -> _Beside:
    """Return what a check reads of the nodes beside candidates; gaps to what is flat need but one displacement each."""
    moved: Any = outsiders.relative
    columns = np.unique(moved.indices) if sparse.issparse(moved) else np.arange(moved.shape[1])
    moved = moved[:, columns]
    if rotations is not None and rotations.axes[:, number].any():
        return _Beside(outsiders, shape, np.append(columns, rotations.at), moved, number, rotations)
    if shape.is_flat:
        along = sparse.kron(sparse.identity(len(outsiders.nodes)), shape.unit_normal[None], format="csr")
        moved = along @ moved
    return _Beside(outsiders, shape, columns, moved, number, None)


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
        """Check a state; refuse a body that has turned too far to call that small."""
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
