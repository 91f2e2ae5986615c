"""The end of a step: from its unknowns and its contact to the states of motions, with their balances of energy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.contact.counterfaces import tangent_lengths
from fingerslip.contact.interface import StepOutcome, settle
from fingerslip.dynamics.finite.body import BodyState
from fingerslip.dynamics.step.contact_step import ContactStep
from fingerslip.dynamics.step.state import Prediction, State
from fingerslip.dynamics.step.stepper import Stepper
from fingerslip.dynamics.step.viscoelastic import HistoryVariables, relaxed_force
from fingerslip.dynamics.system.scheme import start_push
from fingerslip.linear.symmetric import row_products


@dataclass(frozen=True)
class Strained:
    """The deformable body at the end of a step."""

    stored: float  # strain energy [J]
    viscous: float  # energy that its dashpots dissipated in the step [J]
    numerical: float = 0.0  # energy that the step lost in it [J]
    history_variables: tuple[HistoryVariables, ...] = ()  # what viscoelastic layers remember at small strain
    body: BodyState | None = None  # the body at large strain


def finish(
    steppers: Sequence[Stepper],
    starts: Sequence[Prediction],
    contacts: Sequence[ContactStep],
    unknowns: Floats,
    strained: Sequence[Strained] = (),
) -> list[State]:
    """Return the states of k motions, which share matrices and scheme, at the end of a step with unknowns (k, n).

    Without `strained` bodies they are those of small strain.
    """
    scheme, system = steppers[0].scheme, steppers[0].system
    displacement = np.stack([start.displacement for start in starts]) + scheme.displacement_factor * unknowns
    velocity = np.stack([start.velocity for start in starts]) + scheme.velocity_factor * unknowns
    acceleration = scheme.inertia_factor * unknowns
    for row, start in enumerate(starts):
        if start.prescribed is not None:
            acceleration[row] += start.prescribed
    count, kinetic, inertia = len(unknowns), np.zeros(len(unknowns)), np.zeros_like(acceleration)
    if scheme.inertia_factor:
        # The mass is read once for velocities and accelerations.
        products = row_products(system.mass, np.concatenate([velocity, acceleration]))
        kinetic, inertia = 0.5 * scheme.inertia_factor * np.vecdot(velocity, products[:count]), products[count:]
    fields = zip(unknowns, displacement, velocity, acceleration, inertia, kinetic.tolist(), strict=True)
    strained = strained or _small_strain(steppers, starts, displacement)
    return list(map(_end_state, steppers, starts, contacts, fields, strained))


# Unknown, displacement [m], velocity [m/s], acceleration [m/s^2] and mass times it [N], (n,) each; kinetic energy [J].
_Fields: TypeAlias = tuple[Floats, Floats, Floats, Floats, Floats, float]


def _small_strain(steppers: Sequence[Stepper], starts: Sequence[Prediction], displacement: Floats) -> list[Strained]:
    """Return bodies at small strain at displacements (k, n) [m]."""
    # Nothing else in the step forms this product, so the balance of energies checks the substitutions.
    elastic = 0.5 * np.vecdot(displacement, row_products(steppers[0].system.stiffness, displacement))
    bodies = []
    for stepper, start, end, stored in zip(steppers, starts, displacement, elastic.tolist(), strict=True):
        layers = zip(stepper.viscous, start.before.history_variables, strict=True)
        after = tuple(layer.after(variables, end) for layer, variables in layers)
        viscous = sum(variables.dissipated for variables in after)
        bodies.append(Strained(stored + sum(variables.stored for variables in after), viscous, 0.0, after))
    return bodies


def _end_state(stepper: Stepper, start: Prediction, contact: ContactStep, fields: _Fields, strained: Strained) -> State:
    """Return the state of a motion at the end of a step."""
    before, scheme, system = start.before, stepper.scheme, stepper.system
    unknown, displacement, velocity, acceleration, inertia, kinetic = fields
    unbalance = scheme.start_weight * before.unbalance - inertia
    if stepper.anchoring is not None:
        unbalance = unbalance + start.anchor_force(stepper, unknown)
    if contact.release is not None:
        unbalance = unbalance + system.push(contact.release.correction, contact.pose)
    unbalance = unbalance / scheme.end_weight
    change, unbalances = displacement - before.displacement, (before.unbalance_before, before.unbalance, unbalance)
    dissipated = scheme.dissipation(change, velocity - before.velocity, inertia - before.inertia, unbalances)
    moved, moments, outward, outcome = _contact_record(stepper, start, contact, displacement)
    damping = 0.0
    if stepper.damping.mass or stepper.damping.stiffness or system.dampers is not None:
        damping = float(change @ stepper.damping_force(0.5 * (before.velocity + velocity)))
    balance = before.energies
    energies = replace(
        balance,
        kinetic=kinetic,
        strain=strained.stored,
        contact=outcome.stored,
        friction=balance.friction + outcome.friction,
        damping=balance.damping + damping,
        viscous=balance.viscous + strained.viscous,
        numerical=balance.numerical + (dissipated + outcome.numerical + strained.numerical),
        external_work=balance.external_work + (0.5 * float((before.load + start.load) @ change) + outward),
    )
    after = State(
        time=start.time,
        step=scheme.step,
        displacement=displacement,
        velocity=velocity,
        acceleration=acceleration,
        inertia=inertia,
        load=start.load,
        unbalance=unbalance,
        unbalance_before=before.unbalance,
        counterfaces=start.counterfaces,
        moved=moved,
        contact_forces=contact.forces,
        contact_forces_before=before.contact_forces,
        interface=outcome.state,
        energies=energies,
        moments=moments,
        iterations=contact.solution.iterations,
        residual=contact.solution.residual,
        working_set=contact.working_set,
        release=contact.release,
        history_variables=strained.history_variables,
        body=strained.body,
    )
    moving = system.coordinates.moving
    if not moving.size:
        return after
    # The work of moving supports, by the mean of their forces.
    forces = _support_force(stepper, before) + _support_force(stepper, after)
    work = energies.external_work + 0.5 * float(forces @ change[moving])
    return replace(after, energies=replace(energies, external_work=work))


def _contact_record(
    stepper: Stepper, start: Prediction, contact: ContactStep, end: Floats
) -> tuple[Floats, Floats, float, StepOutcome]:
    """Return what contact has done in a step that ended at displacements (n,) [m].

    Motion of the candidates (n_c, dim) [m], moments on rotations (r,) [N m], work on counterfaces [J], the interface.
    """
    before, system = start.before, stepper.system
    moved, moments = system.moved(end, start.counterfaces), before.moments
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
        inward -= 0.5 * float((before.moments + moments) @ (end - before.displacement)[system.rotations.at])
    outcome = settle(
        system.candidates,
        before.interface,
        contact.solution.forces,
        contact.relative,
        friction_coefficient=contact.coefficients,
        stretch=tangent_lengths(contact.frames),
        work=inward,
    )
    return moved, moments, outward, outcome


def _support_force(stepper: Stepper, state: State) -> Floats:
    """Return the forces of the moving supports on the body, shape (k,) [N]: what their equations lack."""
    system, damping, moving = stepper.system, stepper.damping, stepper.system.coordinates.moving
    if state.body is None:
        force = system.stiffness[moving] @ (state.displacement + damping.stiffness * state.velocity)
    else:
        force = state.body.force[moving] + damping.stiffness * (system.stiffness[moving] @ state.velocity)
    unbalance = state.unbalance[moving]
    if not state.step:
        unbalance = unbalance - start_push(stepper.scheme) * (unbalance - state.unbalance_before[moving])
    force += -state.load[moving] - unbalance
    if damping.mass:
        force += damping.mass * (system.mass[moving] @ state.velocity)
    if stepper.viscous:
        rows = [layer.layers.apply_map(lambda matrix: matrix[moving]) for layer in stepper.viscous]
        force -= relaxed_force(rows, stepper.viscous, state.history_variables)
    return np.asarray(force - (system.relative[:, moving].T @ state.contact_forces.ravel()))
