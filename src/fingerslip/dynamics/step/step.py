"""One time step of one motion or of several that share a matrix: states in, states out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.step.anchor import Lead, is_at_rest, move_anchor, passes
from fingerslip.dynamics.step.contact_step import ContactStep, solve_step, turn, weighted_forces
from fingerslip.dynamics.step.finish import finish
from fingerslip.dynamics.step.prediction import predict
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch
from fingerslip.linear.threads import Mapper, one_by_one

__all__ = ["advance"]

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

    Arrays: time [s]; counterfaces (n_counterfaces, dim) [m].
    """
    condensed = steppers[0].condensed
    starts, leads = predict(steppers, states, time, counterfaces), [Lead() for _ in steppers]
    for _ in passes(steppers, time):
        with watch.part("substitution"):
            halfway = condensed.forward(_columns([start.right_hand_side for start in starts]))
        with watch.part("contact"):
            contacts = list(mapper(solve_step, steppers, starts, _own_rows(steppers, halfway.local)))
            forces = _joint_forces(steppers, contacts, halfway.local.shape)
        with watch.part("substitution"):
            moved = None if halfway.kept is None else _joint_motion(steppers, contacts, halfway.local.shape)
            unknowns = condensed.backward(halfway, forces, moved).reshape(-1, len(starts)).T
            for arguments in zip(steppers, starts, contacts, unknowns, strict=True):
                turn(*arguments)
        if all(map(is_at_rest, steppers, starts, contacts, unknowns)):
            break
        starts = list(map(move_anchor, steppers, starts, unknowns, leads))
    with watch.part("recording"):
        return finish(steppers, starts, contacts, unknowns)


def _columns(vectors: Sequence[Array]) -> Array:
    """Return vectors (n,) as columns; a single one stays a vector, which is faster than a matrix with one column."""
    return vectors[0] if len(vectors) == 1 else np.stack(vectors).T


def _own_rows(steppers: Sequence[Stepper], local: Array) -> list[Array]:
    """Return each motion's own part of the joint local displacements, (m,) or (m, k)."""
    rows = local[None] if local.ndim == 1 else np.ascontiguousarray(local.T)
    return [
        row if stepper.has_all(row.size) else row[stepper.rows] for row, stepper in zip(rows, steppers, strict=True)
    ]


def _joint_forces(steppers: Sequence[Stepper], contacts: Sequence[ContactStep], shape: tuple[int, ...]) -> Array:
    """Return what contact adds to the equations of all motions, on the joint rows, shape (m,) or (m, k) [N]."""
    forces = [_on_joint_rows(*arguments, shape[0]) for arguments in zip(steppers, contacts, strict=True)]
    return forces[0] if len(shape) == 1 else np.stack(forces).T


def _on_joint_rows(stepper: Stepper, contact: ContactStep, size: int) -> Array:
    """Return what contact adds to the equation of a motion, on the joint rows, shape (m,) [N]."""
    element = weighted_forces(stepper, contact).ravel()
    if stepper.has_all(size):
        return element
    forces = np.zeros(size)
    forces[stepper.rows] = element
    return forces


def _joint_motion(steppers: Sequence[Stepper], contacts: Sequence[ContactStep], shape: tuple[int, ...]) -> Array | None:
    """Return what these forces do to the local unknowns, shape (m,) or (m, k); None where contact does not tell it."""
    if steppers[0].system.rotations is not None:
        return None
    displacements = [contact.moved for contact in contacts]
    moved = [
        displacement.ravel()
        for displacement in displacements
        if displacement is not None and displacement.size == shape[0]
    ]
    if len(moved) < len(steppers):
        return None
    joint: Array = np.stack(moved, axis=1).reshape(shape) / steppers[0].scheme.displacement_factor
    return joint
