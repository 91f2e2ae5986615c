"""What a history says of rigid bodies: their motion, and the forces and moments of contact on them."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.system.bodies import RigidFreedom, body_centres, faces_of
from fingerslip.dynamics.system.system import System
from fingerslip.model.model import Model

__all__ = ["BodyRecords", "moments"]

Array = NDArray[np.float64]

# Variables of translations and of rotations: displacement, velocity and acceleration.
_SHIFTS = ("rigid_body_displacement", "rigid_body_velocity", "rigid_body_acceleration")
_TURNS = ("rigid_body_rotation", "rigid_body_angular_velocity", "rigid_body_angular_acceleration")


class BodyRecords:
    """The free motion of rigid bodies, kept step by step.

    Arrays: times (n_times,) [s].
    """

    def __init__(self, model: Model, system: System, times: Array) -> None:
        self._system, self._times, self._at = system, times, system.coordinates.rigid
        self._names = list(model.bodies)
        self._faces = [faces_of(model, name) for name in model.bodies]
        self.moved = np.zeros((3, times.size, self._at.size))
        self._centres = body_centres(model)[1]

    def part(self, steps: slice) -> BodyRecords:
        """Return the records of some steps."""
        records = copy.copy(self)
        vars(records).update(_times=self._times[steps], moved=self.moved[:, steps])
        return records

    def steer(self, system: System) -> None:
        """Go on with a system whose counterfaces move otherwise from now on."""
        self._system = system

    def record(self, step: int | slice, state: State) -> None:
        """Keep displacement, velocity and acceleration of a step, or of several."""
        if self._at.size:
            for moved, field in zip(self.moved, (state.displacement, state.velocity, state.acceleration), strict=True):
                moved[step] = field[..., self._at]

    def complete_motion(self, values: dict[str, Any]) -> None:
        """Add what bodies do to the prescribed motion of the counterfaces, and fill in their own motion."""
        motions = self._system.motions
        if motions:
            values["counterface_velocity"] += np.stack([motion.velocity(self._times) for motion in motions], axis=1)
        for column, freedom in enumerate(self._system.unknowns.rigid):
            for name, values_of_body in zip(("displacement", "velocity"), self.moved[:2, :, column], strict=True):
                for face in freedom.faces:
                    values[f"counterface_{name}"][:, face] += values_of_body[:, None] * freedom.shift
            self._add_to_body(values, freedom, self.moved[:, :, column])
        for number, faces in enumerate(self._faces):
            for name in ("displacement", "velocity") if faces else ():
                values[f"rigid_body_{name}"][:, number] = values[f"counterface_{name}"][:, faces[0]]

    def _add_to_body(self, values: dict[str, Any], freedom: RigidFreedom, moved: Array) -> None:
        """Put the motion (3, n_times) in a free direction where it belongs."""
        if freedom.body is None:
            return
        number = self._names.index(freedom.body)
        # The only axis of rotation in 2D is z.
        axis = freedom.axis if self._system.space.dim == 3 or not freedom.turns else 0
        for name, component in zip(_TURNS if freedom.turns else _SHIFTS, moved, strict=True):
            values[name][:, number, axis] = component

    def rotations(self, steps: slice) -> Array:
        """Return the angles of bodies with counterfaces in some steps, (n_steps, r) [rad]."""
        return self.moved[0, steps][
            :, [freedom.turns and bool(freedom.faces) for freedom in self._system.unknowns.rigid]
        ]

    def arms(self, moved: Array) -> Array:
        """Return the lever arms of the candidates about the centres of their bodies, (n_steps, n_c, dim) [m].

        Arrays: moved (n_steps, n_c, dim) [m].
        """
        candidates = self._system.candidates
        result: Array = candidates.positions - self._centres[candidates.counterface] + moved
        return result

    def complete_forces(self, values: dict[str, Any]) -> None:
        """Sum up what the contacts exert on the bodies, the opposite of what acts on the deformable ones."""
        for number, faces in enumerate(self._faces):
            for name in ("force", "moment"):
                of_faces = values[f"counterface_{name}"][:, list(faces)]
                values[f"rigid_body_{name}"][:, number] = -of_faces.sum(axis=1)


def moments(arms: Array, forces: Array) -> Array:
    """Return the moments of forces at the end of arms, (..., 3) in 3D and (..., 1) in 2D [N m].

    Examples
    --------
    >>> moments(np.array([[2.0, 1.0]]), np.array([[0.0, 3.0]])).tolist()
    [[6.0]]
    """
    if arms.shape[-1] == 3:
        return np.cross(arms, forces)
    about_z: Array = arms[..., :1] * forces[..., 1:] - arms[..., 1:] * forces[..., :1]
    return about_z
