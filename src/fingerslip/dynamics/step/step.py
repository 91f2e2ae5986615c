"""One time step of one motion or of several that share a matrix: states in, states out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import repeat

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.frames import tangent_lengths
from fingerslip.contact.interface import StepOutcome, settle
from fingerslip.dynamics.finite.body import BodyState
from fingerslip.dynamics.step.anchor import is_at_rest, move_anchor, passes
from fingerslip.dynamics.step.contact_step import ContactStep, solve_step
from fingerslip.dynamics.step.energy import Energies
from fingerslip.dynamics.step.prediction import Prediction, predict
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch
from fingerslip.dynamics.system.scheme import StepChange
from fingerslip.linear.products import two_products
from fingerslip.linear.threads import Mapper, one_by_one

__all__ = ["advance", "finish", "weighted_forces"]

Array = NDArray[np.float64]


def advance(
    steppers: Sequence[Stepper],
    states: Sequence[State],
    time: float,
    counterfaces: Sequence[Array],
    *,
    watch: Stopwatch,
    mapper: Mapper = one_by_one,
) -> list[State]:
    """Take one step of several motions with one factorised matrix.

    Parameters
    ----------
    steppers : sequence of Stepper
        What stays the same in each motion; made together by :func:`fingerslip.dynamics.step.stepper.build_steppers`.
    states : sequence of State
        Their states at the start of the step.
    time : float
        Time at its end [s].
    counterfaces : sequence of (n_counterfaces, dim) array
        Prescribed displacement of their counterfaces at its end [m].
    watch : Stopwatch
        Takes the times of substitution, contact and energies.
    mapper : callable, optional
        Solves the contacts of the motions, side by side where it uses several threads.

    Raises
    ------
    ConvergenceError
        Where the contact problem was not solved, or contact alone does not hold a body without inertia.
    """
    condensed = steppers[0].condensed
    starts = list(map(predict, steppers, states, repeat(time), counterfaces))
    for _ in passes(steppers, time):
        with watch.part("substitution"):
            halfway = condensed.forward(_columns([start.right_hand_side for start in starts]))
        with watch.part("contact"):
            contacts = list(mapper(solve_step, steppers, starts, _own_rows(steppers, halfway.local)))
            forces = _joint_forces(steppers, contacts, halfway.local.shape)
        with watch.part("substitution"):
            unknowns = condensed.backward(halfway, forces).reshape(-1, len(starts)).T
        if all(map(is_at_rest, steppers, starts, contacts, unknowns)):
            break
        starts = list(map(move_anchor, steppers, starts, unknowns))
    with watch.part("recording"):
        return list(map(finish, steppers, starts, contacts, unknowns))


def _columns(vectors: Sequence[Array]) -> Array:
    """Return vectors (n,) as columns; a single one stays a vector, which is faster than a matrix with one column."""
    return vectors[0] if len(vectors) == 1 else np.stack(vectors).T


def _own_rows(steppers: Sequence[Stepper], local: Array) -> list[Array]:
    """Return each motion's own part of the joint local displacements, (m,) or (m, k)."""
    columns = local.reshape(len(local), len(steppers))
    return [columns[stepper.rows, number] for number, stepper in enumerate(steppers)]


def _joint_forces(steppers: Sequence[Stepper], contacts: Sequence[ContactStep], shape: tuple[int, ...]) -> Array:
    """Return what contact adds to the equations of all motions, on the joint rows, shape (m,) or (m, k) [N]."""
    forces = np.zeros((shape[0], len(steppers)))
    for number, (stepper, contact) in enumerate(zip(steppers, contacts, strict=True)):
        forces[stepper.rows, number] = weighted_forces(stepper, contact).ravel()
    return forces.reshape(shape)


def weighted_forces(stepper: Stepper, contact: ContactStep) -> Array:
    """Return what contact adds to the equation of motion of a step, in global components, shape (n_c, dim) [N]."""
    added: Array = stepper.scheme.end_weight * contact.forces
    return added if contact.release_force is None else added + contact.release_force


def finish(
    stepper: Stepper, start: Prediction, contact: ContactStep, unknown: Array, body: BodyState | None = None
) -> State:
    """Return the state at the end of a step.

    Parameters
    ----------
    stepper : Stepper
        What stays the same.
    start : Prediction
        The step before its substitution.
    contact : ContactStep
        Its contact.
    unknown : (n,) array
        Its unknown.
    body : BodyState, optional
        The body at the end, at large strain.
    """
    system, scheme, before, unknown = stepper.system, stepper.scheme, start.before, np.ascontiguousarray(unknown)
    displacement = start.free.displacement + scheme.displacement_factor * unknown
    velocity = start.free.velocity + scheme.velocity_factor * unknown
    acceleration = scheme.inertia_factor * unknown
    if start.prescribed is not None:
        acceleration += start.prescribed
    inertia, momentum = _mass_times(stepper, acceleration, velocity)
    unbalance = scheme.start_weight * before.unbalance - inertia
    if stepper.anchoring:
        unbalance += start.anchor_force(stepper, unknown)
    if contact.release is not None:
        unbalance += system.at_candidates @ contact.release.correction.ravel()
    after = replace(
        before,
        time=start.time,
        step=scheme.step,
        displacement=displacement,
        velocity=velocity,
        acceleration=acceleration,
        inertia=inertia,
        load=start.load,
        unbalance=unbalance / scheme.end_weight,
        unbalance_before=before.unbalance,
        counterfaces=start.counterfaces,
        moved=system.moved(displacement, start.counterfaces),
        contact_forces=contact.forces,
        contact_forces_before=before.contact_forces,
        iterations=contact.solution.iterations,
        residual=contact.solution.residual,
        working_set=contact.working_set,
        release=contact.release,
        memories=tuple(
            own.after(memory, displacement) for own, memory in zip(stepper.viscous, before.memories, strict=True)
        ),
        body=body,
    )
    return _settled(stepper, before, after, momentum, contact)


def _mass_times(stepper: Stepper, acceleration: Array, velocity: Array) -> tuple[Array, Array]:
    """Return the mass times acceleration [N] and times velocity [N s], both (n,); none where nothing has inertia."""
    if not stepper.scheme.inertia_factor:
        return np.zeros_like(acceleration), np.zeros_like(velocity)
    return two_products(stepper.system.mass, acceleration, velocity)


def _settled(stepper: Stepper, before: State, after: State, momentum: Array, contact: ContactStep) -> State:
    """Complete a step with what it did to the interface and to the energies."""
    acting = _mean_forces(before, after)
    settled = settle(
        stepper.system.candidates,
        before.interface,
        contact.solution.forces,
        contact.relative,
        friction_coefficient=contact.coefficients,
        stretch=tangent_lengths(contact.frames) if stepper.stretch is None else stepper.stretch,
        work=-float(np.sum(acting * (after.moved - before.moved))),
    )
    return replace(after, interface=settled.state, energies=_energies(stepper, before, after, momentum, settled))


def _mean_forces(before: State, after: State) -> Array:
    """Return the contact forces that do work in a step, shape (n_c, dim) [N]."""
    total = before.contact_forces + after.contact_forces
    for state in (before, after):
        if state.release is not None:
            total += state.release.correction
    mean: Array = 0.5 * total
    return mean


def _energies(stepper: Stepper, before: State, after: State, momentum: Array, settled: StepOutcome) -> Energies:
    """Complete the energy balance of a step."""
    lost, relaxes = _elastic_loss(before, after), stepper.system.body is not None and stepper.system.body.relaxes
    change = StepChange(
        displacement=after.displacement - before.displacement,
        velocity=after.velocity - before.velocity,
        inertia=after.inertia - before.inertia,
        unbalance=(before.unbalance_before, before.unbalance, after.unbalance),
    )
    return before.energies.after(
        kinetic=0.5 * stepper.scheme.inertia_factor * float(after.velocity @ momentum),
        strain=_strain_energy(stepper, after),
        contact=settled.stored,
        friction=settled.friction,
        damping=_damped(stepper, before, after),
        viscous=sum(memory.dissipated for memory in after.memories) + (lost if relaxes else 0.0),
        numerical=stepper.scheme.dissipation(change) + settled.numerical + (0.0 if relaxes else lost),
        work=_external_work(stepper, before, after),
    )


def _strain_energy(stepper: Stepper, state: State) -> float:
    """Return the strain energy at the end of a step [J].

    Nothing else in the step forms this product with the stiffness, so the balance of energies checks the substitutions.
    """
    if state.body is not None:
        return state.body.energy
    elastic = 0.5 * float(state.displacement @ (stepper.system.stiffness @ state.displacement))
    return elastic + sum(memory.stored for memory in state.memories)


def _elastic_loss(before: State, after: State) -> float:
    """Return the work of the mean force of the body less the change of strain energy [J]: none at small strain.

    In a body that relaxes it is what dashpots take, and else an error of the step.
    """
    if before.body is None or after.body is None:
        return 0.0
    work = 0.5 * float((before.body.force + after.body.force) @ (after.displacement - before.displacement))
    return work - (after.body.energy - before.body.energy)


def _damped(stepper: Stepper, before: State, after: State) -> float:
    """Return the energy that material damping and the dampers of rigid bodies dissipate in a step [J]."""
    if not (stepper.damping.mass or stepper.damping.stiffness or stepper.system.dampers is not None):
        return 0.0
    force = stepper.damping_force(0.5 * (before.velocity + after.velocity))
    return float((after.displacement - before.displacement) @ force)


def _external_work(stepper: Stepper, before: State, after: State) -> float:
    """Return the work of loads, counterfaces and moving supports in a step, by the mean of the forces [J]."""
    work = 0.5 * float((before.load + after.load) @ (after.displacement - before.displacement))
    if after.counterfaces.size:
        travel = (after.counterfaces - before.counterfaces)[stepper.system.candidates.counterface]
        work += float(np.sum(_mean_forces(before, after) * travel))
    moving = stepper.system.unknowns.moving
    if moving.size:
        forces = stepper.support_force(before) + stepper.support_force(after)
        work += 0.5 * float(forces @ (after.displacement - before.displacement)[moving])
    return work
