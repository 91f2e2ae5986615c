"""Steps at small strain, on the mesh or in a reduced basis: forward, contact, backward, finish.

Displacements u, velocities v and accelerations a obey M a + F = 0 with the mass M and the unbalanced force
F = C v + K u - f - B^T r: damping C, stiffness K, loads f, contact forces r, and B that takes relative displacements of
what may touch from u. A step from 0 to 1 finds x of ::

    M a_1 + w_1 F_1 = w_0 F_0,    u_1 = u~ + c_u x,    v_1 = v~ + c_v x,    a_1 = c_a x

with the numbers w and c of a scheme (:mod:`fingerslip.dynamics.system.scheme`), and u~ and v~ of the start. So
A x = b + w_1 B^T r, with b as if no contact force acted at the end, and A = c_a M + w_1 (c_v C + c_u K), which stays
the same. Forward substitution leaves the equations of what may touch, contact finds r there, backward substitution all
of x, and what it makes of u, v, a, slip and energies finishes the step. In 2D, in a basis and on flat counterfaces,
compiled code does the same (:mod:`fingerslip.dynamics.compact.kernel`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.dynamics.loop import BodyIntegrator, ByLength
from fingerslip.dynamics.step.anchor import Anchor, is_at_rest
from fingerslip.dynamics.step.contact_step import ContactStep, solve_step, turn, weighted_forces
from fingerslip.dynamics.step.finish import finish
from fingerslip.dynamics.step.sharing import first_alike, same_motion
from fingerslip.dynamics.step.state import State, first_state, predict
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch
from fingerslip.dynamics.system.system import System
from fingerslip.errors import EquilibriumError
from fingerslip.linear.resources import Mapper

# Passes of a step of a body that only contact holds.
_MOST_PASSES = 200


class SmallStrain(BodyIntegrator):
    """Motions that share a factorised matrix; see :class:`fingerslip.dynamics.loop.BodyIntegrator`."""

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

    def advance(self, states: Mapping[int, State], ends: Floats, length: float | None = None) -> dict[int, list[State]]:
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
        steppers, before = [self.steppers[number] for number in first], [states[number] for number in first]
        travels = [shifts[number] for number in first]
        after = advance_together(steppers, before, time, travels, watch=self._watch, mapper=self._mapper)
        pairs = zip(groups.values(), after, strict=True)
        return {number: [state] for members, state in pairs for number in members}

    def steer(self, system: System) -> None:
        """Go on with a system whose counterfaces or loads are others from now on."""
        self.steppers = [replace(self.steppers[0], system=system)]


def advance_together(
    steppers: Sequence[Stepper],
    states: Sequence[State],
    time: float,
    counterfaces: Sequence[Floats],
    *,
    watch: Stopwatch,
    mapper: Mapper = map,
) -> list[State]:
    """Take one step of several motions with one matrix to a time [s] and counterfaces (n_counterfaces, dim) [m]."""
    condensed = steppers[0].condensed
    starts, anchors = predict(steppers, states, time, counterfaces), [Anchor() for _ in steppers]
    for _ in range(_MOST_PASSES):
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
        starts = list(map(Anchor.move, anchors, steppers, starts, unknowns))
    else:
        raise EquilibriumError(time, steppers[0].system.held_by_contact)
    with watch.part("recording"):
        return finish(steppers, starts, contacts, unknowns)


def _on_joint_rows(steppers: Sequence[Stepper], values: Sequence[Floats], local: Floats) -> Floats:
    """Return values (n_c, dim) of each motion on the joint rows, shaped as the local displacements there."""
    joint = np.zeros((len(steppers), len(local)))
    for row, stepper, element in zip(joint, steppers, values, strict=True):
        row[stepper.rows] = element.ravel()
    return joint[0] if local.ndim == 1 else joint.T


def _joint_motion(steppers: Sequence[Stepper], contacts: Sequence[ContactStep], local: Floats) -> Floats | None:
    """Return what contact forces do to the local unknowns, (m,) or (m, k); None where contact does not tell it."""
    moved = [contact.moved for contact in contacts]
    told = [element for element in moved if element is not None and element.size == len(local)]
    if steppers[0].system.rotations is not None or len(told) < len(steppers):
        return None
    return _on_joint_rows(steppers, told, local) / steppers[0].scheme.displacement_factor
