"""The end of a step: from its unknowns and its contact to the states of motions, with their balances of energy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import repeat

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.frames import tangent_lengths
from fingerslip.contact.interface import StepOutcome, settle
from fingerslip.dynamics.finite.body import BodyState
from fingerslip.dynamics.step.contact_step import ContactStep
from fingerslip.dynamics.step.prediction import Prediction
from fingerslip.dynamics.step.state import Energies, State
from fingerslip.dynamics.step.stepper import Stepper
from fingerslip.dynamics.step.viscoelastic import HistoryVariables
from fingerslip.dynamics.system.scheme import StepChange
from fingerslip.linear.symmetric import as_rows, row_products

__all__ = ["finish"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _End:
    """A motion at the end of a step."""

    displacement: Array  # (n,) [m]
    velocity: Array  # (n,) [m/s]
    acceleration: Array  # (n,) [m/s^2]
    inertia: Array  # (n,), mass times acceleration [N]
    change: StepChange  # what the step has changed
    kinetic: float  # kinetic energy [J]
    elastic: float  # what the elastic stiffness stores at small strain, else 0 [J]


def finish(
    steppers: Sequence[Stepper],
    starts: Sequence[Prediction],
    contacts: Sequence[ContactStep],
    unknowns: Array,
    bodies: Sequence[BodyState] = (),
) -> list[State]:
    """Return the states of k motions, which share matrices and scheme, at the end of a step.

    Arrays: unknowns (k, n).
    """
    added = list(map(_extra_forces, steppers, starts, contacts, unknowns))
    ends = _ends(steppers[0], starts, unknowns, added, is_small=not bodies)
    return list(map(_end_state, steppers, starts, contacts, ends, bodies or repeat(None)))


def _ends(
    stepper: Stepper,
    starts: Sequence[Prediction],
    unknowns: Array,
    added: Sequence[Array | None],
    *,
    is_small: bool,
) -> list[_End]:
    """Return the fields at the end of a step; `added` are further forces in the equation of motion, (n,) [N]."""
    scheme, (mass, elastic, _) = stepper.scheme, stepper.compiled
    displacement = as_rows([start.free.displacement for start in starts]) + scheme.displacement_factor * unknowns
    velocity = as_rows([start.free.velocity for start in starts]) + scheme.velocity_factor * unknowns
    acceleration = scheme.inertia_factor * unknowns
    for row, start in enumerate(starts):
        if start.prescribed is not None:
            acceleration[row] += start.prescribed
    count, kinetic, stored = len(unknowns), np.zeros(len(unknowns)), np.zeros(len(unknowns))
    inertia = np.zeros_like(acceleration)
    if scheme.inertia_factor:
        # The mass is read once for velocities and accelerations.
        products = row_products(mass, np.concatenate([velocity, acceleration]))
        kinetic, inertia = 0.5 * scheme.inertia_factor * np.vecdot(velocity, products[:count]), products[count:]
    if is_small:
        # Nothing else in the step forms this product, so the balance of energies checks the substitutions.
        stored = 0.5 * np.vecdot(displacement, row_products(elastic, displacement))
    ends = []
    for row, start in enumerate(starts):
        before, forces = start.before, added[row]
        unbalance = scheme.start_weight * before.unbalance - inertia[row]
        unbalance = (unbalance if forces is None else unbalance + forces) / scheme.end_weight
        change = StepChange(
            displacement[row] - before.displacement,
            velocity[row] - before.velocity,
            inertia[row] - before.inertia,
            (before.unbalance_before, before.unbalance, unbalance),
        )
        fields = displacement[row], velocity[row], acceleration[row], inertia[row]
        ends.append(_End(*fields, change, float(kinetic[row]), float(stored[row])))
    return ends


def _extra_forces(stepper: Stepper, start: Prediction, contact: ContactStep, unknown: Array) -> Array | None:
    """Return the forces of an anchor and of nodes that have left in the equation of motion, (n,) [N]; None if none."""
    anchor = start.anchor_force(stepper, unknown) if stepper.anchoring is not None else None
    if contact.release is None:
        return anchor
    left = stepper.system.push(contact.release.correction, contact.pose)
    return left if anchor is None else anchor + left


@dataclass(frozen=True)
class _Contact:
    """What contact has done in a step: motion (n_c, dim) [m], work on interface and bodies [J], the interface after.

    `moments` (r,) are those on rotations [N m].
    """

    moved: Array
    moments: Array
    external_work: float
    outcome: StepOutcome


def _end_state(stepper: Stepper, start: Prediction, contact: ContactStep, end: _End, body: BodyState | None) -> State:
    """Return the state of a motion at the end of a step, from its fields and its contact."""
    before, settled = start.before, _contact_record(stepper, start, contact, end)
    layers = zip(stepper.viscous, before.history_variables, strict=True)
    history_variables = tuple(layer.after(variables, end.displacement) for layer, variables in layers)
    after = State(
        time=start.time,
        step=stepper.scheme.step,
        displacement=end.displacement,
        velocity=end.velocity,
        acceleration=end.acceleration,
        inertia=end.inertia,
        load=start.load,
        unbalance=end.change.unbalance[-1],
        unbalance_before=before.unbalance,
        counterfaces=start.counterfaces,
        moved=settled.moved,
        contact_forces=contact.forces,
        contact_forces_before=before.contact_forces,
        interface=settled.outcome.state,
        energies=_energies(stepper, start, end, settled, (history_variables, body)),
        moments=settled.moments,
        iterations=contact.solution.iterations,
        residual=contact.solution.residual,
        working_set=contact.working_set,
        release=contact.release,
        history_variables=history_variables,
        body=body,
    )
    return _with_supports(stepper, before, after, end.change.displacement)


def _contact_record(stepper: Stepper, start: Prediction, contact: ContactStep, end: _End) -> _Contact:
    """Return what contact has done in a step."""
    before, system = start.before, stepper.system
    moved, moments = system.moved(end.displacement, start.counterfaces), before.moments
    # Both works are those of the mean forces of the step.
    mean = 0.5 * (before.contact_forces + contact.forces)
    for release in (before.release, contact.release):
        if release is not None:
            mean = mean + 0.5 * release.correction
    inward = -float(np.vdot(mean, moved - before.moved))
    travel = (start.counterfaces - before.counterfaces)[system.candidates.counterface]
    outward = float(np.vdot(mean, travel))
    if system.rotations is not None and contact.pose is not None:
        acting = contact.forces if contact.release is None else contact.forces + contact.release.correction
        moments = acting.ravel() @ contact.pose.columns
        inward -= 0.5 * float((before.moments + moments) @ end.change.displacement[system.rotations.at])
    outcome = settle(
        system.candidates,
        before.interface,
        contact.solution.forces,
        contact.relative,
        friction_coefficient=contact.coefficients,
        stretch=tangent_lengths(contact.frames) if stepper.stretch is None else stepper.stretch,
        work=inward,
    )
    return _Contact(moved, moments, outward, outcome)


def _energies(
    stepper: Stepper,
    start: Prediction,
    end: _End,
    contact: _Contact,
    material: tuple[Sequence[HistoryVariables], BodyState | None],
) -> Energies:
    """Complete the energy balance of a step, but for the work of moving supports."""
    before, change, (history_variables, body) = start.before, end.change, material
    lost, relaxes = _elastic_loss(before, body, change.displacement), _relaxes(stepper)
    settled = contact.outcome
    return before.energies.after(
        kinetic=end.kinetic,
        strain=end.elastic + sum(variables.stored for variables in history_variables) if body is None else body.energy,
        contact=settled.stored,
        friction=settled.friction,
        damping=_damping_energy(stepper, before, end),
        viscous=sum(variables.dissipated for variables in history_variables) + (lost if relaxes else 0.0),
        numerical=stepper.scheme.dissipation(change) + settled.numerical + (0.0 if relaxes else lost),
        work=0.5 * float((before.load + start.load) @ change.displacement) + contact.external_work,
    )


def _relaxes(stepper: Stepper) -> bool:
    return stepper.system.body is not None and stepper.system.body.relaxes


def _elastic_loss(before: State, body: BodyState | None, change: Array) -> float:
    """Return the work of the mean force of the body less the change of strain energy [J]: none at small strain.

    In a body that relaxes it is what dashpots take, and else an error of the step.
    """
    if before.body is None or body is None:
        return 0.0
    return 0.5 * float((before.body.force + body.force) @ change) - (body.energy - before.body.energy)


def _damping_energy(stepper: Stepper, before: State, end: _End) -> float:
    """Return the energy that material damping and the dampers of rigid bodies dissipate in a step [J]."""
    if not (stepper.damping.mass or stepper.damping.stiffness or stepper.system.dampers is not None):
        return 0.0
    return float(end.change.displacement @ stepper.damping_force(0.5 * (before.velocity + end.velocity)))


def _with_supports(stepper: Stepper, before: State, after: State, change: Array) -> State:
    """Return a state whose balance has the work of moving supports in the step, by the mean of their forces."""
    moving = stepper.system.unknowns.moving
    if not moving.size:
        return after
    forces = stepper.support_force(before) + stepper.support_force(after)
    work = after.energies.external_work + 0.5 * float(forces @ change[moving])
    return replace(after, energies=replace(after.energies, external_work=work))
