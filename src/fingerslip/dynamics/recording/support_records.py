"""What a history says of supports: the forces that they bear; see :mod:`fingerslip.dynamics.system.supports`."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.step.memory import relaxed_force, viscous_steps
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.system.scheme import Scheme, start_push
from fingerslip.dynamics.system.system import System
from fingerslip.materials.elastic import RayleighDamping

__all__ = ["SupportRecords"]

Array = NDArray[np.float64]


class SupportRecords:
    """The forces on what supports hold, step by step, from the motion of the unknowns `near` (k,) it."""

    def __init__(self, system: System, scheme: Scheme, damping: RayleighDamping, n_times: int) -> None:
        self._supports, self._scheme, self._damping = system.supports, scheme, damping
        self._viscous = viscous_steps(system.relaxing, scheme.step)
        self._is_elastic = system.body is None
        self.near = self._supports.columns
        self._near_maps = self._supports.stiffness[:, self.near], self._supports.mass[:, self.near]
        self._held = np.zeros((3, n_times, self._supports.contact.shape[0]))
        self._touches = self._supports.contact.nnz > 0
        self._passed: dict[int, list[Array]] = {}
        # What a damped start takes up on what is held; see :mod:`fingerslip.dynamics.step.state`.
        self._taken_up = np.zeros(self._held.shape[2])

    @property
    def kept(self) -> dict[str, Array]:
        """The arrays in which records are kept."""
        return {"held": self._held}

    def part(self, steps: slice) -> SupportRecords:
        """Return the records of some steps."""
        records = copy.copy(self)
        vars(records).update(_held=self._held[:, steps])
        return records

    def record(self, step: int | slice, state: State) -> None:
        """Keep the loads and contact forces on what is held, of a state or of several, time first in their arrays."""
        supports, others = self._supports, self._held[2, step]
        if not np.ndim(state.time) and not state.step and state.unbalance is not state.unbalance_before:
            self._take_up(np.take(state.acceleration, self.near, mode="clip"))
        if supports.loads:
            times = np.ravel(state.time).tolist()
            others -= np.stack([supports.load(time) for time in times]).reshape(others.shape)
        if self._touches:
            forces = state.contact_forces.reshape(*others.shape[:-1], -1)
            others -= (supports.contact @ forces.T).T
        if state.body is not None:
            others += supports.rows @ state.body.nodal
        if state.memories:
            others -= relaxed_force(supports.relaxing, self._viscous, state.memories)

    def _take_up(self, acceleration: Array) -> None:
        scheme, (stiffness, mass) = self._scheme, self._near_maps
        of_stiffness = scheme.displacement_factor + scheme.velocity_factor * self._damping.stiffness
        damped = scheme.velocity_factor * self._damping.mass * (mass @ acceleration)
        self._taken_up[:] = scheme.end_weight * (of_stiffness * (stiffness @ acceleration) + damped)

    def pass_by(self, step: int, state: State) -> None:
        """Take note of a state before that of a step: the inertia of what is held goes on from it."""
        if self._scheme.start_weight and self._held.shape[2]:
            acceleration = np.take(state.acceleration, self.near, mode="clip")
            inertia: Array = self._scheme.inertia_factor * (self._near_maps[1] @ acceleration)
            self._passed.setdefault(step, []).append(inertia)

    def follow(self, steps: slice, near: Array) -> None:
        """Compute elastic forces and inertia of steps.

        Parameters
        ----------
        steps : slice
            The steps.
        near : (3, n, k) array
            Displacement [m], velocity [m/s] and acceleration [m/s^2] of the unknowns `near` in them.
        """
        displacement, velocity, acceleration = (field.T for field in near)
        stiffness, mass = self._near_maps
        # At large strain the elastic forces are those of the states.
        strained = displacement if self._is_elastic else 0.0
        force = stiffness @ (strained + self._damping.stiffness * velocity)
        self._held[0, steps] = (force + self._damping.mass * (mass @ velocity)).T
        self._held[1, steps] = self._scheme.inertia_factor * (mass @ acceleration).T

    def complete(self, values: dict[str, Any]) -> None:
        """Fill in the forces of the supports."""
        elastic, inertia, others = self._held
        force = elastic + others
        forces = values["support_force"].reshape(force.shape)
        unbalance = -inertia[0] - self._taken_up
        for step in range(len(force)):
            for moved in [*self._passed.get(step, []), *([inertia[step]] if step else [])]:
                unbalance = (self._scheme.start_weight * unbalance - moved) / self._scheme.end_weight
            forces[step] = force[step] - unbalance
            if not step and self._taken_up.any():
                unbalance = unbalance + start_push(self._scheme) / self._scheme.start_weight * self._taken_up
