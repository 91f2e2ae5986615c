"""The state of a motion, with the energy balance of the discrete motion term by term in closed form.

Over a step, with d the change and bar the mean of start and end values, the scheme's equations give exactly ::

    external work = d(kinetic) + d(strain) + d(contact penalties)
                    + friction + damping + viscous + numerical dissipation

so whatever is left over is rounding, or an error. The numerical dissipation is that of the time integration
(:meth:`fingerslip.dynamics.system.scheme.Scheme.dissipation`) and that of the contact law's implicit step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.contact.interface import InterfaceState, rest_state
from fingerslip.contact.solve.partition import Partition
from fingerslip.contact.solve.working_set import WorkingSet
from fingerslip.dynamics.finite.body import BodyState
from fingerslip.dynamics.step.release import Release, fading_forces
from fingerslip.dynamics.step.stepper import Stepper, with_empty
from fingerslip.dynamics.step.viscoelastic import HistoryVariables, variables_at_rest
from fingerslip.dynamics.system.operators import Pose
from fingerslip.dynamics.system.scheme import Scheme, start_push, starts_damped
from fingerslip.dynamics.system.system import System


@dataclass(frozen=True)
class Energies:
    """Energies at one time [J]; dissipations and work are accumulated from the start."""

    kinetic: float = 0.0  # kinetic energy
    strain: float = 0.0  # strain energy
    contact: float = 0.0  # energy of the contact penalties
    friction: float = 0.0  # energy dissipated by friction
    damping: float = 0.0  # energy dissipated by material damping
    numerical: float = 0.0  # energy dissipated by the time integration and the contact law's step
    external_work: float = 0.0  # work of loads and counterfaces
    initial: float = 0.0  # energy at the start
    viscous: float = 0.0  # energy dissipated by the Prony terms of materials

    @property
    def imbalance(self) -> float:
        """External work and initial energy less all stored and dissipated energy [J]: rounding, or an error."""
        return (
            self.external_work
            + self.initial
            - (self.kinetic + self.strain + self.contact)
            - (self.friction + self.damping + self.viscous + self.numerical)
        )


@dataclass(frozen=True)
class State:
    """The motion at one time, on the system's unknowns."""

    time: float  # [s]
    displacement: Floats  # (n,) [m]
    velocity: Floats  # (n,) [m/s]
    acceleration: Floats  # (n,) [m/s^2]
    inertia: Floats  # (n,), mass times acceleration [N]
    load: Floats  # (n,), forces of loads, those on rigid bodies included [N]
    unbalance: Floats  # (n,), unbalanced force C v + K u - f [N]
    unbalance_before: Floats  # (n,), that one step earlier [N]
    counterfaces: Floats  # (n_counterfaces, dim), prescribed displacement of the counterfaces [m]
    moved: Floats  # (n_c, dim), displacement of the candidates relative to their counterfaces [m]
    contact_forces: Floats  # (n_c, dim) [N]
    contact_forces_before: Floats  # (n_c, dim) [N]
    interface: InterfaceState  # the contact candidates in their frames
    energies: Energies  # the balance so far
    moments: Floats  # (r,) [N m]
    step: float = 0.0  # length of the last step [s]
    iterations: int = 0  # iterations of the contact solver in the last step
    residual: float = 0.0  # its relative residual [-]
    working_set: WorkingSet | Partition | None = None  # what the contact solver keeps for the next step
    release: Release | None = None  # what nodes that have left a counterface still feel
    history_variables: tuple[HistoryVariables, ...] = ()  # what viscoelastic layers remember
    body: BodyState | None = None  # the body at large strain
    carried: tuple[NDArray[Any], ...] = ()  # what compiled steps go on from

    @property
    def large_body(self) -> BodyState:
        """The body at large strain, where there is one."""
        assert self.body is not None, "a state at small strain"
        return self.body


_NONE = np.zeros(0)


def first_state(stepper: Stepper) -> State:
    """Return the state at time zero, with the acceleration that loads and damping give it; supports are at rest."""
    system, candidates = stepper.system, stepper.system.candidates
    velocity, load = system.initial_velocity, system.load(0.0)
    damped, factor = stepper.damping_force(velocity), stepper.scheme.inertia_factor
    kinetic = 0.5 * factor * float(velocity @ (system.mass @ velocity))
    acceleration, inertia = _acceleration(stepper, (load - damped) * factor)
    unbalance, moving = damped - load, system.coordinates.moving
    unbalance[moving] = -inertia[moving]
    unbalance_before = unbalance
    if starts_damped(stepper.scheme, stepper.damping, system.dampers):
        # The balance of energy closes with the forces with which damping takes up within a step what inertia lacks.
        scheme = stepper.scheme
        resisting = scheme.velocity_factor * stepper.damping_force(acceleration)
        resisting += scheme.displacement_factor * (stepper.stiffness @ acceleration)
        unbalance[moving] -= scheme.end_weight * resisting[moving]
        lacking, weight = unbalance + inertia, scheme.start_weight
        unbalance = unbalance - start_push(scheme) / weight * lacking
        unbalance_before = unbalance + lacking / weight
    none = np.zeros((len(candidates.nodes), system.space.dim))
    return State(
        time=0.0,
        displacement=np.zeros_like(velocity),
        velocity=velocity,
        acceleration=acceleration,
        inertia=inertia,
        load=load,
        unbalance=unbalance,
        unbalance_before=unbalance_before,
        counterfaces=np.zeros((len(system.motions), system.space.dim)),
        moved=none,
        contact_forces=none,
        contact_forces_before=none,
        interface=rest_state(candidates, stepper.gaps),
        energies=Energies(kinetic=kinetic, initial=kinetic),
        moments=np.zeros(0 if system.rotations is None else system.rotations.at.size),
        history_variables=tuple(map(variables_at_rest, stepper.viscous)),
        body=None if system.body is None else system.body.at_rest(stepper.scheme.step),
    )


def _acceleration(stepper: Stepper, forces: Floats) -> tuple[Floats, Floats]:
    """Return the acceleration (n,) [m/s^2] under forces (n,) [N], and the mass times it; moving supports have none."""
    system, moving = stepper.system, stepper.system.coordinates.moving
    forces_left = forces.copy()
    forces_left[moving] = 0.0
    if not forces_left.any():
        return forces_left, np.zeros_like(forces_left)
    condensed, is_damped = stepper.condensed, starts_damped(stepper.scheme, stepper.damping, system.dampers)
    if not is_damped:
        mass = with_empty(system.mass, moving)
        condensed, _ = system.coordinates.condense(mass, system.relative[:0], stepper.solver, 0)
    halfway = condensed.forward(forces_left)
    acceleration = condensed.backward(halfway, np.zeros_like(halfway.local))
    return acceleration, (system.mass @ acceleration if moving.size or is_damped else forces_left)


@dataclass(frozen=True)
class Prediction:
    """A step of one motion, ready for its substitution."""

    before: State  # the state at the start of the step
    time: float  # end of the step [s]
    counterfaces: Floats  # (n_counterfaces, dim), prescribed displacement of the counterfaces at the end [m]
    load: Floats  # (n,), forces of loads at the end, those on rigid bodies included [N]
    displacement: Floats  # (n,), that at the end with no unknown [m]
    velocity: Floats  # (n,), that at the end with no unknown [m/s]
    moved: Floats  # (n_c, dim), displacement of the candidates relative to their counterfaces there [m]
    pose: Pose | None  # the candidates there as bodies see them that turn
    right_hand_side: Floats  # (n,), right-hand side of the step without contact forces [N]
    prescribed: Floats | None = None  # (n,), acceleration of moving supports at the end, zero elsewhere [m/s^2]
    anchor: Floats | None = None  # (n,), where the springs of the stepper pull to, relative to `displacement` [m]

    @property
    def arms(self) -> Floats:
        """Displacement of the candidates relative to turning bodies per rotation, shape (n_c * dim, r) [m]."""
        return np.zeros((self.moved.size, 0)) if self.pose is None else self.pose.columns

    def about(self, stepper: Stepper, moved: Floats, angles: Floats) -> Prediction:
        """Return the step predicted to end with candidates (n_c * dim,) and rotations (r,) at these unknowns."""
        system, factor = stepper.system, stepper.scheme.displacement_factor
        displacement, reached = self.displacement.copy(), self.moved + factor * moved.reshape(self.moved.shape)
        if system.rotations is not None:
            displacement[system.rotations.at] += factor * angles
        return replace(self, moved=reached, pose=system.pose(displacement, reached))

    def distance(self, stepper: Stepper, pose: Pose | None) -> float:
        """Return how far candidates are from where turned bodies see them in a pose, over the size of the mesh [-]."""
        if self.pose is None or pose is None:
            return 0.0
        return float(np.abs(self.pose.points - pose.points).max()) / stepper.system.size

    def anchor_force(self, stepper: Stepper, unknown: Floats) -> Floats:
        """Return the force that the anchor exerts on the body at the end of the step, shape (n,) [N]."""
        return stepper.anchor_force((0.0 if self.anchor is None else self.anchor) - unknown)


def predict(
    steppers: Sequence[Stepper], states: Sequence[State], time: float, counterfaces: Sequence[Floats]
) -> list[Prediction]:
    """Carry states that share their matrices to a time [s] as if no force acted there; counterfaces as prescribed."""
    starts = list(map(predict_ends, steppers, states, repeat(time), counterfaces))
    displacement = np.stack([start.displacement for start in starts])
    velocity = np.stack([start.velocity for start in starts])
    predictions, resisting = [], steppers[0].resisting_force(displacement, velocity)
    for stepper, start, resisting_force in zip(steppers, starts, resisting, strict=True):
        scheme, system, before = stepper.scheme, stepper.system, start.before
        force = start.load - resisting_force
        for layer, variables in zip(stepper.viscous, before.history_variables, strict=True):
            force += layer.force(variables)
        side = scheme.end_weight * force + scheme.start_weight * before.unbalance
        if start.prescribed is not None:
            # The inertia of moving supports is known; their own equations are empty.
            side -= system.mass @ start.prescribed
            side[system.coordinates.moving] = 0.0
        if before.release is not None:
            side += system.push(fading_forces(scheme, before.release), start.pose)
        predictions.append(replace(start, right_hand_side=side))
    return predictions


def predict_ends(stepper: Stepper, before: State, time: float, counterfaces: Floats) -> Prediction:
    """Return the prediction of one motion without its right-hand side; see :func:`predict`."""
    system, scheme = stepper.system, stepper.scheme
    fields = before.displacement, before.velocity, before.acceleration
    displacement, velocity, prescribed = with_supports(system, scheme, fields, time)
    moved = system.moved(displacement, counterfaces)
    return Prediction(
        before=before,
        time=time,
        counterfaces=counterfaces,
        load=system.load(time),
        displacement=displacement,
        velocity=velocity,
        moved=moved,
        pose=system.pose(displacement, moved),
        right_hand_side=_NONE,
        prescribed=prescribed,
    )


def with_supports(
    system: System, scheme: Scheme, fields: Sequence[Floats], time: float
) -> tuple[Floats, Floats, Floats | None]:
    """Return the end of a step with no unknown but those of moving supports, displacement and its rates (n,)."""
    displacement, velocity = scheme.predict(*fields)
    if not system.moving_supports:
        return displacement, velocity, None
    # Moving supports move by the scheme like all others.
    unknown, moving = np.zeros_like(displacement), system.coordinates.moving
    end = np.array([component.at(time) for component in system.moving_supports])
    unknown[moving] = (end - displacement[moving]) / scheme.displacement_factor
    reached = displacement + scheme.displacement_factor * unknown
    return reached, velocity + scheme.velocity_factor * unknown, scheme.inertia_factor * unknown
