"""A plate that is free along some axes, in steps without inertia: loads, springs, dampers and contact hold it.

Along each free axis e the displacement q of the plate at the end of a step of length h follows from its load F, the
coefficient c of its damper, the stiffness s of its spring and the contact forces f on the body::

    (c / h + s) q_1 = F_1 + (c / h) q_0 - e . sum f

so that the plate adds the same compliance, y = 1 / (c / h + s), to all its contact nodes, along e.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.system.motion import Motion
from fingerslip.errors import InputError
from fingerslip.model.programme import Ramp
from fingerslip.model.rigid_bodies import DIRECTIONS, Direction, RigidBody

__all__ = ["PRESCRIBED", "FreePlate", "free_plate"]

Floats = NDArray[np.float64]

_REPAIR = "simulate the model step by step"
# Share of the largest displacement that a programme may prescribe along a free axis by rounding.
_ZERO = 1e-9


@dataclass(frozen=True)
class FreePlate:
    """The free axes of a plate, for steps of one length."""

    axes: Floats  # (k, 3), unit vectors [-]
    compliance: Floats  # (k,), y, what a force on the plate moves it by in a step [m/N]
    drag: Floats  # (k,), c / h [N/m]
    loads: tuple[tuple[tuple[float, Ramp], ...], ...]  # forces along each axis [N] with their factors

    def unheld(self, time: float, before: Floats) -> Floats:
        """Return the displacements (k,) at the end of a step [m] if there were no contact.

        Arrays: time [s]; before (k,) [m].
        """
        force = [sum(value * ramp.at(time) for value, ramp in load) for load in self.loads]
        displacement: Floats = self.compliance * (np.array(force) + self.drag * before)
        return displacement

    def held(self, unheld: Floats, force: Floats) -> Floats:
        """Return the displacements (k,) [m] with a contact force (3,) on the body [N]."""
        displacement: Floats = unheld - self.compliance * (self.axes @ force)
        return displacement

    def shift(self, displacements: Floats) -> Floats:
        """Return the displacement of the plate (3,) [m] for those along its axes (k,)."""
        result: Floats = displacements @ self.axes
        return result

    def added(self, compliance: Floats) -> Floats:
        """Return the compliance of contact nodes (n_c * 3, n_c * 3) with that of the plate [m/N]."""
        along = np.tile(self.axes, len(compliance) // 3)
        return compliance + along.T @ (self.compliance[:, None] * along)


#: A plate that is free along no axis.
PRESCRIBED = FreePlate(np.zeros((0, 3)), np.zeros(0), np.zeros(0), ())


def free_plate(plate: RigidBody, motion: Motion, step: float) -> FreePlate:
    """Return the free axes of a plate.

    Units: step [s].
    """
    for number, direction in enumerate(plate.free):
        _check(f"bodies.free.{number}", plate, direction, motion)
    drag = np.array([plate.damping(direction) / step for direction in plate.free])
    stiffness = np.array([plate.stiffness(direction) for direction in plate.free])
    return FreePlate(
        np.eye(3)[[DIRECTIONS.index(direction) for direction in plate.free]].reshape(-1, 3),
        1.0 / (drag + stiffness),
        drag,
        tuple(tuple((getattr(load, direction), load.ramp) for load in plate.loads) for direction in plate.free),
    )


def _check(where: str, plate: RigidBody, direction: Direction, motion: Motion) -> None:
    if direction not in DIRECTIONS[:3]:
        raise InputError(where, f"is {direction}", "needs x, y or z, as the plate does not turn", _REPAIR)
    along = np.abs(motion.positions[:, DIRECTIONS.index(direction)]).max()
    if along > _ZERO * np.abs(motion.positions).max():
        raise InputError(where, f"is {direction}, along which the programme moves the plate", "needs an axis across it")
    if plate.velocity(direction):
        raise InputError(where, f"is {direction}, with a velocity at the start", "needs a plate at rest")
    if not (plate.stiffness(direction) or plate.damping(direction)):
        fault = f"is {direction}, along which contact alone holds the plate"
        raise InputError(where, fault, "needs a spring or a damper", _REPAIR)
