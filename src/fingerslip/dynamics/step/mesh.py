"""Steps at small strain, on the mesh or in a reduced basis: forward, contact, backward, finish."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.integrator import BodyIntegrator, ByLength
from fingerslip.dynamics.step.anchor import Lead, is_at_rest, move_anchor, passes
from fingerslip.dynamics.step.contact_step import ContactStep, solve_step, turn, weighted_forces
from fingerslip.dynamics.step.finish import finish
from fingerslip.dynamics.step.prediction import first_state, predict
from fingerslip.dynamics.step.sharing import first_alike, same_motion
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch
from fingerslip.dynamics.system.system import System
from fingerslip.linear.resources import Mapper

Array = NDArray[np.float64]


class Mesh(BodyIntegrator):
    """Motions that share a factorised matrix; see :class:`fingerslip.dynamics.integrator.BodyIntegrator`."""

    steppers: Sequence[Stepper] = ()

    def __init__(
        self, make: Callable[[float], Sequence[Stepper]], step: float, watch: Stopwatch, mapper: Mapper = map
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
            # What the contact keeps belongs to the length of the step that found it.
            states = {
                number: state if state.step == length else replace(state, working_set=None)
                for number, state in states.items()
            }
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
        self.steppers = [replace(self.steppers[0], system=system)]


def advance(
    steppers: Sequence[Stepper],
    states: Sequence[State],
    time: float,
    counterfaces: Sequence[Array],
    *,
    watch: Stopwatch,
    mapper: Mapper = map,
) -> list[State]:
    """Take one step of several motions with one factorised matrix.

    Arrays: time [s]; counterfaces (n_counterfaces, dim) [m].
    """
    condensed = steppers[0].condensed
    starts, leads = predict(steppers, states, time, counterfaces), [Lead() for _ in steppers]
    for _ in passes(steppers, time):
        with watch.part("substitution"):
            sides = [start.right_hand_side for start in starts]
            # A single vector is faster than a matrix with one column.
            halfway = condensed.forward(sides[0] if len(sides) == 1 else np.stack(sides).T)
        with watch.part("contact"):
            local = halfway.local.T.reshape(len(steppers), -1)
            rows = [row[stepper.rows] for row, stepper in zip(local, steppers, strict=True)]
            contacts = list(mapper(solve_step, steppers, starts, rows))
            forces = _on_joint_rows(steppers, list(map(weighted_forces, steppers, contacts)), halfway.local)
        with watch.part("substitution"):
            moved = None if halfway.kept is None else _joint_motion(steppers, contacts, halfway.local)
            unknowns = condensed.backward(halfway, forces, moved).reshape(-1, len(starts)).T
            for arguments in zip(steppers, starts, contacts, unknowns, strict=True):
                turn(*arguments)
        if all(map(is_at_rest, steppers, starts, contacts, unknowns)):
            break
        starts = list(map(move_anchor, steppers, starts, unknowns, leads))
    with watch.part("recording"):
        return finish(steppers, starts, contacts, unknowns)


def _on_joint_rows(steppers: Sequence[Stepper], values: Sequence[Array], local: Array) -> Array:
    """Return values (n_c, dim) of each motion on the joint rows, shaped as the local displacements there."""
    joint = np.zeros((len(steppers), len(local)))
    for row, stepper, element in zip(joint, steppers, values, strict=True):
        row[stepper.rows] = element.ravel()
    return joint[0] if local.ndim == 1 else joint.T


def _joint_motion(steppers: Sequence[Stepper], contacts: Sequence[ContactStep], local: Array) -> Array | None:
    """Return what contact forces do to the local unknowns, (m,) or (m, k); None where contact does not tell it."""
    moved = [contact.moved for contact in contacts]
    told = [element for element in moved if element is not None and element.size == len(local)]
    if steppers[0].system.rotations is not None or len(told) < len(steppers):
        return None
    return _on_joint_rows(steppers, told, local) / steppers[0].scheme.displacement_factor
