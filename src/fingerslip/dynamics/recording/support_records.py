"""What a history says of supports: the forces on them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.viscoelastic import Viscous, relaxed_force
from fingerslip.dynamics.system.scheme import Scheme, start_push, starts_damped
from fingerslip.dynamics.system.system import System
from fingerslip.materials.elastic import RayleighDamping


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
