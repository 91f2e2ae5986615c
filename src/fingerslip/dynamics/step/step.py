"""One time step of one motion or of several that share a matrix: states in, states out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
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
from fingerslip.linear.products import as_rows, products
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
    starts = predict(steppers, states, time, counterfaces)
    for _ in passes(steppers, time):
        with watch.part("substitution"):
            halfway = condensed.forward(_columns([start.right_hand_side for start in starts]))
        with watch.part("contact"):
            contacts = list(mapper(solve_step, steppers, starts, _own_rows(steppers, halfway.local)))
            forces = _joint_forces(steppers, contacts, halfway.local.shape)
        with watch.part("substitution"):
            moved = None if halfway.kept is None else _joint_moved(steppers, contacts, halfway.local.shape)
            unknowns = condensed.backward(halfway, forces, moved).reshape(-1, len(starts)).T
        if all(map(is_at_rest, steppers, starts, contacts, unknowns)):
            break
        starts = list(map(move_anchor, steppers, starts, unknowns))
    with watch.part("recording"):
        return finish(steppers, starts, contacts, unknowns)


def _columns(vectors: Sequence[Array]) -> Array:
    """Return vectors (n,) as columns; a single one stays a vector, which is faster than a matrix with one column."""
    return vectors[0] if len(vectors) == 1 else np.stack(vectors).T


def _own_rows(steppers: Sequence[Stepper], local: Array) -> list[Array]:
    """Return each motion's own part of the joint local displacements, (m,) or (m, k)."""
    rows = np.ascontiguousarray(local.reshape(len(local), len(steppers)).T)
    return [own[stepper.rows] for own, stepper in zip(rows, steppers, strict=True)]


def _joint_forces(steppers: Sequence[Stepper], contacts: Sequence[ContactStep], shape: tuple[int, ...]) -> Array:
    """Return what contact adds to the equations of all motions, on the joint rows, shape (m,) or (m, k) [N]."""
    forces = np.zeros((len(steppers), shape[0]))
    for own, stepper, contact in zip(forces, steppers, contacts, strict=True):
        own[stepper.rows] = weighted_forces(stepper, contact).ravel()
    return forces.T.reshape(shape)


def _joint_moved(steppers: Sequence[Stepper], contacts: Sequence[ContactStep], shape: tuple[int, ...]) -> Array | None:
    """Return what these forces do to the local unknowns, shape (m,) or (m, k); None where contact does not tell it."""
    told = [contact.moved for contact in contacts if contact.release_force is None]
    moved = [own.ravel() for own in told if own is not None and own.size == shape[0]]
    if len(moved) < len(steppers):
        return None
    joint: Array = np.stack(moved, axis=1).reshape(shape) / steppers[0].scheme.displacement_factor
    return joint


def weighted_forces(stepper: Stepper, contact: ContactStep) -> Array:
    """Return what contact adds to the equation of motion of a step, in global components, shape (n_c, dim) [N]."""
    added: Array = stepper.scheme.end_weight * contact.forces
    return added if contact.release_force is None else added + contact.release_force


@dataclass(frozen=True)
class _End:
    """The fields (n,) of a motion at the end of a step, its kinetic energy, and its strain energy at small strain."""

    unknown: Array
    displacement: Array
    velocity: Array
    acceleration: Array
    inertia: Array
    kinetic: float
    elastic: float


def finish(
    steppers: Sequence[Stepper],
    starts: Sequence[Prediction],
    contacts: Sequence[ContactStep],
    unknowns: Array,
    bodies: Sequence[BodyState] = (),
) -> list[State]:
    """Return the states of k motions at the end of a step.

    Parameters
    ----------
    steppers : sequence of Stepper
        What stays the same in each; they share matrices and scheme.
    starts : sequence of Prediction
        The step before its substitution.
    contacts : sequence of ContactStep
        Its contact.
    unknowns : (k, n) array
        Its unknowns.
    bodies : sequence of BodyState, optional
        The bodies at the end, at large strain.
    """
    ends = _ends(steppers[0], starts, np.ascontiguousarray(unknowns), is_small=not bodies)
    return list(map(_finished, steppers, starts, contacts, ends, bodies or repeat(None)))


def _ends(stepper: Stepper, starts: Sequence[Prediction], unknowns: Array, *, is_small: bool) -> list[_End]:
    """Return the ends of motions, whose matrices are read once for all of them."""
    scheme, system, count = stepper.scheme, stepper.system, len(starts)
    displacement = as_rows([start.free.displacement for start in starts]) + scheme.displacement_factor * unknowns
    velocity = as_rows([start.free.velocity for start in starts]) + scheme.velocity_factor * unknowns
    acceleration = scheme.inertia_factor * unknowns
    for number, start in enumerate(starts):
        if start.prescribed is not None:
            acceleration[number] += start.prescribed
    inertia, kinetic, elastic = np.zeros_like(acceleration), np.zeros(count), np.zeros(count)
    if scheme.inertia_factor:
        both = products(system.mass, np.concatenate([acceleration, velocity]))
        inertia, kinetic = both[:count], 0.5 * scheme.inertia_factor * np.vecdot(velocity, both[count:])
    if is_small:
        # Nothing else in the step forms this product, so the balance of energies checks the substitutions.
        elastic = 0.5 * np.vecdot(displacement, products(system.stiffness, displacement))
    each = zip(kinetic.tolist(), elastic.tolist(), strict=True)
    return [
        _End(*fields, *own)
        for *fields, own in zip(unknowns, displacement, velocity, acceleration, inertia, each, strict=True)
    ]


def _finished(stepper: Stepper, start: Prediction, contact: ContactStep, end: _End, body: BodyState | None) -> State:
    """Return the state of a motion at the end of a step, from its fields and its contact."""
    system, scheme, before = stepper.system, stepper.scheme, start.before
    unbalance = scheme.start_weight * before.unbalance - end.inertia
    if stepper.anchoring:
        unbalance += start.anchor_force(stepper, end.unknown)
    if contact.release is not None:
        unbalance += system.at_candidates @ contact.release.correction.ravel()
    memories = [
        own.after(memory, end.displacement) for own, memory in zip(stepper.viscous, before.memories, strict=True)
    ]
    moved, acting = system.moved(end.displacement, start.counterfaces), _mean_forces(before, contact)
    settled = _settled(stepper, before, contact, -float(np.vdot(acting, moved - before.moved)))
    after = State(
        time=start.time,
        step=scheme.step,
        displacement=end.displacement,
        velocity=end.velocity,
        acceleration=end.acceleration,
        inertia=end.inertia,
        load=start.load,
        unbalance=unbalance / scheme.end_weight,
        unbalance_before=before.unbalance,
        counterfaces=start.counterfaces,
        moved=moved,
        contact_forces=contact.forces,
        contact_forces_before=before.contact_forces,
        interface=settled.state,
        energies=before.energies,
        iterations=contact.solution.iterations,
        residual=contact.solution.residual,
        working_set=contact.working_set,
        release=contact.release,
        memories=tuple(memories),
        body=body,
    )
    return replace(after, energies=_energies(stepper, before, after, end, (acting, settled)))


def _mean_forces(before: State, contact: ContactStep) -> Array:
    """Return the contact forces that do work in a step, shape (n_c, dim) [N]."""
    total = before.contact_forces + contact.forces
    for release in (before.release, contact.release):
        if release is not None:
            total += release.correction
    mean: Array = 0.5 * total
    return mean


def _settled(stepper: Stepper, before: State, contact: ContactStep, work: float) -> StepOutcome:
    """Return what a step did to the interface, on which contact did work [J]."""
    return settle(
        stepper.system.candidates,
        before.interface,
        contact.solution.forces,
        contact.relative,
        friction_coefficient=contact.coefficients,
        stretch=tangent_lengths(contact.frames) if stepper.stretch is None else stepper.stretch,
        work=work,
    )


def _energies(stepper: Stepper, before: State, after: State, end: _End, contact: tuple[Array, StepOutcome]) -> Energies:
    """Complete the energy balance of a step, with the mean contact forces and what it did to the interface."""
    lost, relaxes = _elastic_loss(before, after), stepper.system.body is not None and stepper.system.body.relaxes
    change = StepChange(
        displacement=after.displacement - before.displacement,
        velocity=after.velocity - before.velocity,
        inertia=after.inertia - before.inertia,
        unbalance=(before.unbalance_before, before.unbalance, after.unbalance),
    )
    acting, settled = contact
    remembered = sum(memory.stored for memory in after.memories)
    return before.energies.after(
        kinetic=end.kinetic,
        strain=end.elastic + remembered if after.body is None else after.body.energy,
        contact=settled.stored,
        friction=settled.friction,
        damping=_damped(stepper, before, after),
        viscous=sum(memory.dissipated for memory in after.memories) + (lost if relaxes else 0.0),
        numerical=stepper.scheme.dissipation(change) + settled.numerical + (0.0 if relaxes else lost),
        work=_external_work(stepper, before, after, change.displacement, acting),
    )


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


def _external_work(stepper: Stepper, before: State, after: State, change: Array, acting: Array) -> float:
    """Return the work of loads, counterfaces and moving supports in a step, by the mean of the forces [J]."""
    work = 0.5 * float((before.load + after.load) @ change)
    travel = after.counterfaces - before.counterfaces
    if travel.any():
        work += float(np.vdot(acting, travel[stepper.system.candidates.counterface]))
    moving = stepper.system.unknowns.moving
    if moving.size:
        forces = stepper.support_force(before) + stepper.support_force(after)
        work += 0.5 * float(forces @ change[moving])
    return work
