"""What a history says of rigid bodies and of supports: their motion, and the forces on them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.viscoelastic import Viscous, relaxed_force
from fingerslip.dynamics.system.bodies import body_centres, faces_of
from fingerslip.dynamics.system.scheme import Scheme, start_push, starts_damped
from fingerslip.dynamics.system.system import System
from fingerslip.materials.elastic import RayleighDamping
from fingerslip.model.model import Model

# Variables of translations and of rotations: displacement, velocity and acceleration.
_SHIFTS = ("rigid_body_displacement", "rigid_body_velocity", "rigid_body_acceleration")
_TURNS = ("rigid_body_rotation", "rigid_body_angular_velocity", "rigid_body_angular_acceleration")


class BodyRecords:
    """How a history follows from the free motion of rigid bodies, (n_times, 3, r): displacement and its rates."""

    def __init__(self, model: Model, system: System) -> None:
        self._names = list(model.bodies)
        self._faces = [faces_of(model, name) for name in model.bodies]
        # Of the body of each counterface [m].
        self.centres = body_centres(model)[1]
        self.turning = [freedom.turns and bool(freedom.faces) for freedom in system.unknowns.freedoms]

    def complete_motion(self, values: dict[str, Any], system: System) -> None:
        """Add what bodies do to the prescribed motion of the counterfaces, and fill in their own motion."""
        times, moved = values["time"], values["moved"]
        if system.motions:
            values["counterface_velocity"] += np.stack([motion.velocity(times) for motion in system.motions], axis=1)
        for column, freedom in enumerate(system.unknowns.freedoms):
            for row, name in enumerate(("displacement", "velocity")):
                for face in freedom.faces:
                    values[f"counterface_{name}"][:, face] += moved[:, row, column, None] * freedom.shift
            if freedom.body is not None:
                number = self._names.index(freedom.body)
                # The only axis of rotation in 2D is z.
                axis = freedom.axis if system.space.dim == 3 or not freedom.turns else 0
                for row, name in enumerate(_TURNS if freedom.turns else _SHIFTS):
                    values[name][:, number, axis] = moved[:, row, column]
        for number, faces in enumerate(self._faces):
            for name in ("displacement", "velocity") if faces else ():
                values[f"rigid_body_{name}"][:, number] = values[f"counterface_{name}"][:, faces[0]]

    def complete_forces(self, values: dict[str, Any]) -> None:
        """Sum up what the contacts exert on the bodies, the opposite of what acts on the deformable ones."""
        for number, faces in enumerate(self._faces):
            for name in ("force", "moment"):
                of_faces = values[f"counterface_{name}"][:, list(faces)]
                values[f"rigid_body_{name}"][:, number] = -of_faces.sum(axis=1)


def moments(arms: Floats, forces: Floats) -> Floats:
    """Return the moments of forces at the end of arms, (..., 3) in 3D and (..., 1) in 2D [N m].

    Examples
    --------
    >>> moments(np.array([[2.0, 1.0]]), np.array([[0.0, 3.0]])).tolist()
    [[6.0]]
    """
    if arms.shape[-1] == 3:
        return np.cross(arms, forces)
    about_z: Floats = arms[..., :1] * forces[..., 1:] - arms[..., 1:] * forces[..., :1]
    return about_z


class SupportRecords:
    """How the elastic forces, inertia and other forces [N] on what supports hold follow from the unknowns near it."""

    def __init__(self, system: System, scheme: Scheme, damping: RayleighDamping, viscous: Sequence[Viscous]) -> None:
        self._supports, self._scheme, self._damping = system.supports, scheme, damping
        self._viscous = viscous
        self._is_elastic = system.body is None
        self.near = self._supports.columns
        self._near_maps = self._supports.stiffness[:, self.near], self._supports.mass[:, self.near]
        self.count = self._supports.contact.shape[0]
        self._touches = self._supports.contact.nnz > 0
        self._passed: dict[int, list[Floats]] = {}
        # What a damped start takes up on what is held; see :mod:`fingerslip.dynamics.step.state`.
        self._taken_up = np.zeros(self.count)
        self._starts_damped = starts_damped(scheme, damping, system.dampers)

    def record(self, held: Floats, state: State) -> None:
        """Keep the loads and contact forces on what is held, (3, count) of a state or (k, 3, count) of several."""
        supports, others = self._supports, held[..., 2, :]
        if self._starts_damped and not state.step:
            scheme, damping, (stiffness, mass) = self._scheme, self._damping, self._near_maps
            acceleration = np.take(state.acceleration, self.near, mode="clip")
            of_stiffness = scheme.displacement_factor + scheme.velocity_factor * damping.stiffness
            damped = scheme.velocity_factor * damping.mass * (mass @ acceleration)
            self._taken_up[:] = scheme.end_weight * (of_stiffness * (stiffness @ acceleration) + damped)
        if supports.loads:
            times = np.ravel(state.time).tolist()
            others -= np.stack([supports.load(time) for time in times]).reshape(others.shape)
        if self._touches:
            forces = state.contact_forces.reshape(*others.shape[:-1], -1)
            others -= (supports.contact @ forces.T).T
        if state.body is not None:
            others += supports.rows @ state.body.nodal
        if state.history_variables:
            others -= relaxed_force(supports.viscoelastic, self._viscous, state.history_variables)

    def pass_by(self, step: int, state: State) -> None:
        """Take note of a state before that of a step: the inertia of what is held goes on from it."""
        if self._scheme.start_weight and self.count:
            acceleration = np.take(state.acceleration, self.near, mode="clip")
            inertia: Floats = self._scheme.inertia_factor * (self._near_maps[1] @ acceleration)
            self._passed.setdefault(step, []).append(inertia)

    def follow(self, held: Floats, near: Floats) -> None:
        """Compute elastic forces and inertia of steps (n, 3, count) [N] from the motion of unknowns near (3, n, k)."""
        displacement, velocity, acceleration = (field.T for field in near)
        stiffness, mass = self._near_maps
        # At large strain the elastic forces are those of the states.
        strained = displacement if self._is_elastic else 0.0
        force = stiffness @ (strained + self._damping.stiffness * velocity)
        held[:, 0] = (force + self._damping.mass * (mass @ velocity)).T
        held[:, 1] = self._scheme.inertia_factor * (mass @ acceleration).T

    def complete(self, values: dict[str, Any]) -> None:
        """Fill in the forces of the supports."""
        elastic, inertia, others = values["held"].swapaxes(0, 1)
        force = elastic + others
        forces = values["support_force"].reshape(force.shape)
        unbalance = -inertia[0] - self._taken_up
        for step in range(len(force)):
            for moved in [*self._passed.get(step, []), *([inertia[step]] if step else [])]:
                unbalance = (self._scheme.start_weight * unbalance - moved) / self._scheme.end_weight
            forces[step] = force[step] - unbalance
            if not step and self._taken_up.any():
                unbalance = unbalance + start_push(self._scheme) / self._scheme.start_weight * self._taken_up
