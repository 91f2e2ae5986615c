"""The state of a motion, and the state at which it starts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.interface import InterfaceState, rest_state
from fingerslip.contact.solve.pieces import Piece
from fingerslip.contact.solve.working_set import WorkingSet
from fingerslip.dynamics.energy import Energies
from fingerslip.dynamics.release import Release
from fingerslip.dynamics.stepper import Stepper

__all__ = ["State", "first_state"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class State:
    """The motion at one time, on the system's unknowns.

    Parameters
    ----------
    time : float
        [s].
    displacement, velocity, acceleration : (n,) array
        [m], [m/s], [m/s^2].
    inertia : (n,) array
        Mass times acceleration [N].
    load : (n,) array
        Forces of loads and drives [N].
    unbalance, unbalance_before : (n,) array
        Unbalanced force C v + K u - f now and one step earlier [N].
    counterfaces : (n_counterfaces, dim) array
        Prescribed displacement of the counterfaces [m].
    moved : (n_c, dim) array
        Displacement of the candidates relative to their counterfaces [m].
    contact_forces, contact_forces_before : (n_c, dim) array
        Forces of the counterfaces on the candidates in global components, now and one step earlier [N].
    interface : InterfaceState
        The contact candidates in their frames.
    energies : Energies
        The balance so far.
    iterations : int
        Iterations of the contact solver in the last step.
    residual : float
        Its relative residual [-].
    working_set : WorkingSet, Piece or None
        What the contact solver keeps for the next step.
    release : Release or None
        What nodes that have left a counterface still feel; None where there are none.
    """

    time: float
    displacement: Array
    velocity: Array
    acceleration: Array
    inertia: Array
    load: Array
    unbalance: Array
    unbalance_before: Array
    counterfaces: Array
    moved: Array
    contact_forces: Array
    contact_forces_before: Array
    interface: InterfaceState
    energies: Energies
    iterations: int = 0
    residual: float = 0.0
    working_set: WorkingSet | Piece | None = None
    release: Release | None = None


def first_state(stepper: Stepper) -> State:
    """Return the state at time zero, with the acceleration that loads and damping give it."""
    system, candidates = stepper.system, stepper.system.candidates
    velocity, load = system.initial_velocity, system.load(0.0)
    damped, kinetic = stepper.damping_force(velocity), stepper.kinetic_energy(velocity)
    inertia = (load - damped) * stepper.scheme.inertia_factor
    none = np.zeros((len(candidates.nodes), system.space.dim))
    return State(
        time=0.0,
        displacement=np.zeros_like(velocity),
        velocity=velocity,
        acceleration=_acceleration(stepper, inertia),
        inertia=inertia,
        load=load,
        unbalance=damped - load,
        unbalance_before=damped - load,
        counterfaces=np.zeros((len(system.motions), system.space.dim)),
        moved=none,
        contact_forces=none,
        contact_forces_before=none,
        interface=rest_state(candidates, system.counterfaces.gaps(candidates.positions, candidates.counterface)),
        energies=Energies(kinetic=kinetic, initial=kinetic),
    )


def _acceleration(stepper: Stepper, inertia: Array) -> Array:
    """Solve M a = `inertia` (n,) [N], shape (n,) [m/s^2]."""
    if not inertia.any():
        return np.zeros_like(inertia)
    factor = stepper.system.coordinates.factorise(stepper.system.mass, stepper.solver)
    return factor.backward(factor.forward(inertia))
