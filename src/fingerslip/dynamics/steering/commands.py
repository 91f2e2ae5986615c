"""Commands: what changes a simulation from now on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.dynamics.system.bodies import Load, Motion, faces_of, require_components
from fingerslip.dynamics.system.system import System
from fingerslip.errors import InputError
from fingerslip.model.model import Model
from fingerslip.model.programme import CONSTANT, Ramp
from fingerslip.parameters import Force, SignedSpeed, parameters


@parameters
class Command:
    """What a counterface, a rigid body or a moving support does from now on.

    See :class:`Simulation`.

    Parameters
    ----------
    of : str
        The boundary of the contact whose counterface is meant, or the name of a rigid body or of a moving support.
    velocity : tuple of float, optional
        Its prescribed velocity from now on [m/s], one value per component; without it the motion stays what it is.
    force : tuple of float, optional
        A force on a rigid body that is free along it [N], on top of its loads, from now on; it replaces that of an
        earlier command. For a counterface that a drive moves, one value along its normal.
    """

    of: str
    velocity: tuple[SignedSpeed, ...] | None = None
    force: tuple[Force, ...] | None = None


def with_command(system: System, model: Model, command: Command, time: float) -> System:
    """Return a system that follows a command from a time [s] on."""
    owners = [*model.bodies, *(contact.boundary for contact in model.contacts)]
    if command.of in model.support_motions and command.of not in owners:
        return _with_support(system, model, command, time)
    if command.of not in owners:
        names = ", ".join([*owners, *model.support_motions]) or "none"
        fault = f"got '{command.of}'"
        raise InputError("command.of", fault, f"the bodies, contacts and moving supports are: {names}")
    faces = faces_of(model, command.of)
    if command.of not in model.bodies:
        number = owners[len(model.bodies) :].index(command.of)
        owner = model.contacts[number].rigid_body
        faces = (number,) if owner is None else faces_of(model, owner)
    if command.velocity is not None:
        system = _with_motion(system, model, faces, _components(system, command.velocity, "velocity"), time)
    if command.force is not None:
        system = _with_force(system, faces, command)
    return system


def _with_support(system: System, model: Model, command: Command, time: float) -> System:
    """Return a system in which a moving support goes on with a velocity."""
    if command.force is not None:
        raise InputError(
            "command.force", f"'{command.of}' is a support", "needs a body that is free", "write a velocity"
        )
    velocity, moving = _components(system, command.velocity or (), "velocity"), list(system.moving_supports)
    left, duration = velocity.copy(), model.end - time + model.time.step
    for number, component in enumerate(moving):
        if component.support == command.of:
            change = velocity[component.axis] * duration / component.displacement
            ramp, here = component.ramp, component.ramp.at(time)
            past = [(knot, factor) for knot, factor in zip(ramp.times, ramp.factors, strict=True) if knot < time]
            onwards = Ramp(*zip(*past, (time, here), (time + duration, here + change), strict=True))
            moving[number] = replace(component, ramp=onwards)
            left[component.axis] = 0.0
    if left.any():
        fault = f"moves '{command.of}' along {', '.join('xyz'[axis] for axis in np.flatnonzero(left))}, where it cannot"
        raise InputError(
            "command.velocity", fault, "needs components that its motion has", "give them in support_motions"
        )
    return replace(system, moving_supports=tuple(moving))


def _components(system: System, values: tuple[float, ...], name: str) -> Floats:
    require_components(f"command.{name}", values, system.space.dim)
    return np.array(values)


def _with_motion(system: System, model: Model, faces: tuple[int, ...], velocity: Floats, time: float) -> System:
    for freedom in system.unknowns.freedoms:
        if set(freedom.faces) & set(faces) and abs(float(freedom.shift @ velocity)) > 0.0:
            fault = "moves along a direction in which the body is free"
            raise InputError("command.velocity", fault, "needs prescribed directions", "write a force there")
    motions, duration = list(system.motions), model.end - time + model.time.step
    for face in faces:
        motion, past = motions[face], motions[face].knots < time
        here = motion.displacement(np.array([time]))[0]
        knots = np.concatenate([motion.knots[past], [time, time + duration]])
        motions[face] = Motion(knots, np.concatenate([motion.positions[past], [here, here + duration * velocity]]))
    return replace(system, motions=tuple(motions))


def _with_force(system: System, faces: tuple[int, ...], command: Command) -> System:
    """Return a system in which a command's force takes the place of that of an earlier one."""
    force = np.array(command.force)
    pairs = zip(system.coordinates.rigid, system.unknowns.freedoms, strict=True)
    freedoms = [(at, freedom) for at, freedom in pairs if set(freedom.faces) & set(faces) and not freedom.turns]
    if not freedoms:
        fault = f"'{command.of}' is free along no direction"
        raise InputError("command.force", fault, "needs a rigid body that is free, or a drive")
    added = np.zeros(system.mass.shape[0])
    for at, freedom in freedoms:
        is_along = freedom.body is None and force.size == 1
        added[at] = force[0] if is_along else freedom.shift @ _components(system, command.force or (), "force")
    touched = np.array([at for at, _ in freedoms])
    loads = tuple(load for load in system.commanded if not load.forces[touched].any())
    own_load = Load(added, CONSTANT)
    return replace(system, commanded=(*loads, own_load))
