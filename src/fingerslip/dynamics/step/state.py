"""The state of a motion, and the state at which it starts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.interface import InterfaceState, rest_state
from fingerslip.contact.solve.partition import Partition
from fingerslip.contact.solve.working_set import WorkingSet
from fingerslip.dynamics.finite.body import BodyState
from fingerslip.dynamics.step.energy import Energies
from fingerslip.dynamics.step.release import Release
from fingerslip.dynamics.step.stepper import Stepper, with_known
from fingerslip.dynamics.step.viscoelastic import HistoryVariables, variables_at_rest
from fingerslip.dynamics.system.scheme import Scheme, start_push

__all__ = ["State", "first_state"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class State:
    """The motion at one time, on the system's unknowns."""

    time: float  # [s]
    displacement: Array  # (n,), [m], [m/s], [m/s^2]
    velocity: Array  # (n,), [m], [m/s], [m/s^2]
    acceleration: Array  # (n,), [m], [m/s], [m/s^2]
    inertia: Array  # (n,), mass times acceleration [N]
    load: Array  # (n,), forces of loads, those on rigid bodies included [N]
    unbalance: Array  # (n,), unbalanced force C v + K u - f now and one step earlier [N]
    unbalance_before: Array  # (n,), unbalanced force C v + K u - f now and one step earlier [N]
    counterfaces: Array  # (n_counterfaces, dim), prescribed displacement of the counterfaces [m]
    moved: Array  # (n_c, dim), displacement of the candidates relative to their counterfaces [m]
    contact_forces: Array  # (n_c, dim) [N]
    contact_forces_before: Array  # (n_c, dim) [N]
    interface: InterfaceState  # the contact candidates in their frames
    energies: Energies  # the balance so far
    moments: Array  # (r,) [N m]
    step: float = 0.0  # length of the last step [s]
    iterations: int = 0  # iterations of the contact solver in the last step
    residual: float = 0.0  # its relative residual [-]
    working_set: WorkingSet | Partition | None = None  # what the contact solver keeps for the next step
    release: Release | None = None  # what nodes that have left a counterface still feel
    history_variables: tuple[HistoryVariables, ...] = ()  # what viscoelastic layers remember
    body: BodyState | None = None  # the body at large strain

    @property
    def large_body(self) -> BodyState:
        """The body at large strain, where there is one."""
        if self.body is None:
            raise ValueError("a state at small strain")
        return self.body


def first_state(stepper: Stepper) -> State:
    """Return the state at time zero, with the acceleration that loads and damping give it; supports are at rest."""
    system, candidates = stepper.system, stepper.system.candidates
    velocity, load = system.initial_velocity, system.load(0.0)
    damped, kinetic = stepper.damping_force(velocity), stepper.kinetic_energy(velocity)
    acceleration, inertia = _acceleration(stepper, (load - damped) * stepper.scheme.inertia_factor)
    unbalance, moving = damped - load, system.unknowns.moving
    unbalance[moving] = -inertia[moving]
    unbalances = unbalance, unbalance
    if stepper.starts_damped:
        unbalance[moving] -= stepper.resisting(acceleration)[moving]
        unbalances = _unbalances(stepper.scheme, unbalance, inertia)
    none = np.zeros((len(candidates.nodes), system.space.dim))
    return State(
        time=0.0,
        displacement=np.zeros_like(velocity),
        velocity=velocity,
        acceleration=acceleration,
        inertia=inertia,
        load=load,
        unbalance=unbalances[0],
        unbalance_before=unbalances[1],
        counterfaces=np.zeros((len(system.motions), system.space.dim)),
        moved=none,
        contact_forces=none,
        contact_forces_before=none,
        interface=rest_state(candidates, system.counterfaces.gaps(candidates.positions, candidates.counterface)),
        energies=Energies(kinetic=kinetic, initial=kinetic),
        moments=np.zeros(0 if system.rotations is None else system.rotations.at.size),
        history_variables=tuple(map(variables_at_rest, stepper.viscous)),
        body=None if system.body is None else system.body.at_rest(stepper.scheme.step),
    )


def _acceleration(stepper: Stepper, forces: Array) -> tuple[Array, Array]:
    """Return the acceleration (n,) [m/s^2] under forces (n,) [N], and the mass times it; moving supports have none."""
    system, moving = stepper.system, stepper.system.unknowns.moving
    forces_left = forces.copy()
    forces_left[moving] = 0.0
    if not forces_left.any():
        return forces_left, np.zeros_like(forces_left)
    if stepper.starts_damped:
        halfway = stepper.condensed.forward(forces_left)
        acceleration = stepper.condensed.backward(halfway, np.zeros_like(halfway.local))
        return acceleration, system.mass @ acceleration
    factor = system.coordinates.factorise(with_known(system.mass, moving), stepper.solver)
    acceleration = factor.backward(factor.forward(forces_left))
    return acceleration, (system.mass @ acceleration if moving.size else forces_left)


def _unbalances(scheme: Scheme, unbalance: Array, inertia: Array) -> tuple[Array, Array]:
    """Return the unbalanced forces (n,) [N] at the start and one step earlier, with which the balance of energy closes.

    What the inertia lacks is what damping takes up within a step.
    """
    lacking = unbalance + inertia
    now = unbalance - start_push(scheme) / scheme.start_weight * lacking
    return now, now + lacking / scheme.start_weight
