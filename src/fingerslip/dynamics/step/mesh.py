"""Steps at small strain, on the mesh or in a reduced basis: forward, contact, backward, finish."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.integrator import ByLength
from fingerslip.dynamics.step.anchor import Lead, is_at_rest, move_anchor, passes
from fingerslip.dynamics.step.contact_step import ContactStep, solve_step, turn, weighted_forces
from fingerslip.dynamics.step.finish import finish
from fingerslip.dynamics.step.prediction import first_state, predict
from fingerslip.dynamics.step.sharing import first_alike, same_motion
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch
from fingerslip.dynamics.system.system import System
from fingerslip.linear.resources import Mapper, one_by_one

__all__ = ["Mesh", "advance"]

Array = NDArray[np.float64]


class Mesh:
    """Motions that share a factorised matrix; see :class:`fingerslip.dynamics.integrator.BodyIntegrator`."""

    def __init__(
        self, make: Callable[[float], Sequence[Stepper]], step: float, watch: Stopwatch, mapper: Mapper = one_by_one
    ) -> None:
        self._by_length, self._watch, self._mapper = ByLength(make), watch, mapper
        self.steppers = self._by_length.at(step)
        self._alike = first_alike([stepper.system for stepper in self.steppers], same_motion)

    @property
    def attributes(self) -> Mapping[str, object]:
        """What histories say of the matrices."""
        return {"basis": "full", "factorisations": self._by_length.count}

    def start(self) -> dict[int, State]:
        """Return the states at time zero."""
        states = {kind: first_state(self.steppers[kind]) for kind in set(self._alike)}
        return {number: states[kind] for number, kind in enumerate(self._alike)}

    def advance(
        self, states: Mapping[int, State], ends: Array, length: float | None = None
    ) -> dict[int, tuple[State, list[State]]]:
        """Take the next step of some motions; those that are still the same are computed once."""
        if length is not None:
            self.steppers = self._by_length.at(length)
            states = {number: _for_length(state, self.steppers[number]) for number, state in states.items()}
        time = float(ends[0])
        shifts = {number: self.steppers[number].system.displacements(time) for number in states}
        groups: dict[tuple[int, int, bytes], list[int]] = {}
        for number, state in states.items():
            groups.setdefault((self._alike[number], id(state), shifts[number].tobytes()), []).append(number)
        first = [members[0] for members in groups.values()]
        after = advance(
            [self.steppers[number] for number in first],
            [states[number] for number in first],
            time,
            [shifts[number] for number in first],
            watch=self._watch,
            mapper=self._mapper,
        )
        pairs = zip(groups.values(), after, strict=True)
        return {number: (state, [state]) for members, state in pairs for number in members}

    def steer(self, system: System) -> None:
        """Go on with a system whose counterfaces or loads are others from now on."""
        self.steppers = [self.steppers[0].with_system(system)]

    def saved_state(self) -> None:
        """Return nothing: factors are those of the model."""

    def restore(self, saved: None) -> None:
        """Do nothing."""


def _for_length(state: State, stepper: Stepper) -> State:
    """Return a state from which a step may start: what the contact keeps belongs to the step that found it."""
    return state if state.step == stepper.scheme.step else replace(state, working_set=None)


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
