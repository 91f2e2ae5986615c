"""Steps at small strain, on the mesh or in a reduced basis: forward, contact, backward, finish.

Bodies without inertia, deformable and rigid, that only contact holds have a singular stiffness: rigid motions cost
nothing until contact resists. Soft springs hold the body to an anchor, and a step is solved again with the anchor where
the body went, until the springs pull no more. What is left is equilibrium of loads and contact alone: a proximal point
iteration (Rockafellar 1976). Each pass shrinks the error by about the ratio of the springs' stiffness to what else
resists the motion, which is little where a body rolls, so that passes are mixed (:class:`Mixing`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.dynamics.loop import BodyIntegrator, ByLength
from fingerslip.dynamics.step.contact_step import POSE_GOAL, ContactStep, solve_step, turn, weighted_forces
from fingerslip.dynamics.step.finish import finish
from fingerslip.dynamics.step.sharing import first_alike, same_motion
from fingerslip.dynamics.step.state import Prediction, State, first_state, predict
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch
from fingerslip.dynamics.system.system import System
from fingerslip.errors import EquilibriumError
from fingerslip.linear.resources import Mapper

# Iterations that are combined: more do not shrink the residual faster, as contact changes meanwhile.
_KEPT = 5
# Singular values of the changes of residuals below this part of the largest, or of the residual, are rounding.
_RESIDUAL_ROUNDING = 1e-8
# Passes of a step, and what a mixed one leaves of the springs' force at most.
_MOST_PASSES, _SHRINKS = 200, 0.9
# Force of the springs over all forces of contact and loads; rounding of positions, which moves the force of a contact
# by as much times its stiffness.
_TOLERANCE, _ROUNDING = 1e-10, 1e-16


class Mixing:
    """Mixing of iterates: Anderson's acceleration of an iteration on factors that are not quite the tangent's.

    An iteration leads from an iterate with a residual to an end. Of the last few of them, the combination with the
    least residual, in the sense of least squares, is also made of the ends: that is where the next iterate goes
    (Anderson 1965; Walker & Ni 2011). For a linear problem this is the generalised minimal residual method.
    """

    def __init__(self) -> None:
        self._residuals: list[Floats] = []
        self._ends: list[Floats] = []

    def next(self, end: Floats, residual: Floats) -> Floats:
        """Return where the next iterate goes, from where the last leads (n,), and the residual (n,) of its iterate."""
        self._residuals = [*self._residuals[1 - _KEPT :], residual]
        self._ends = [*self._ends[1 - _KEPT :], end]
        if len(self._ends) == 1:
            return end
        changes = np.stack([residual - earlier for earlier in self._residuals[:-1]], axis=1)
        largest = max(float(np.linalg.norm(changes)), 1e-300)
        rounding = _RESIDUAL_ROUNDING * max(1.0, float(np.linalg.norm(residual)) / largest)
        weights = np.linalg.lstsq(changes, residual, rcond=rounding)[0]
        mixed = end.copy()
        for weight, earlier in zip(weights, self._ends[:-1], strict=True):
            mixed -= weight * (end - earlier)
        return mixed


class _Lead:
    """Where the anchor of a motion goes from pass to pass of a step."""

    def __init__(self) -> None:
        self._mixing, self._mixes = Mixing(), False
        self._end, self._pull = np.zeros(0), np.inf

    def move(self, stepper: Stepper, start: Prediction, unknown: Floats) -> Prediction:
        """Return the step with the anchor where this pass, which went by `unknown` (n,) [m], and those before lead."""
        beyond = self._next(unknown, start.anchor_force(stepper, unknown)) - unknown
        # No farther at once than the body is large: where nothing holds it, mixing would lead to where all is rounding.
        far = float(np.abs(stepper.system.relative @ beyond).max(initial=0.0)) / stepper.system.size
        return start.with_anchor(stepper, unknown + beyond / max(far, 1.0))

    def _next(self, end: Floats, pull: Floats) -> Floats:
        """Return where the anchor goes (n,) [m] after a pass that ended at `end` (n,) [m] with spring forces (n,) [N].

        Where contact has changed, mixing can lead astray: then the last pass before it goes on by itself.
        """
        size = float(np.linalg.norm(pull))
        if self._mixes and size > _SHRINKS * self._pull:
            self._mixing, self._mixes = Mixing(), False
            return self._end
        led = self._mixing.next(end, pull)
        self._mixes, self._end, self._pull = not np.array_equal(led, end), end, size
        return led


def _is_at_rest(stepper: Stepper, start: Prediction, contact: ContactStep, unknown: Floats) -> bool:
    """Tell whether springs to the anchor pull no more, and turned bodies see candidates where they are (n,) [m]."""
    if stepper.anchoring is None:
        return True
    system = stepper.system
    if system.rotations is not None:
        end = start.about(stepper, system.relative @ unknown, unknown[system.rotations.at])
        if end.distance(stepper, contact.pose) > POSE_GOAL:
            return False
    pull = float(np.abs(start.anchor_force(stepper, unknown)).sum())
    acting = float(np.abs(contact.forces).sum() + np.abs(start.load).sum())
    rounding = _ROUNDING * system.size * float(system.candidates.normal_stiffness.sum())
    return pull <= max(_TOLERANCE * acting, rounding)


class Mesh(BodyIntegrator):
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

    def advance(
        self, states: Mapping[int, State], ends: Floats, length: float | None = None
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
        steppers, before = [self.steppers[number] for number in first], [states[number] for number in first]
        travels = [shifts[number] for number in first]
        after = advance(steppers, before, time, travels, watch=self._watch, mapper=self._mapper)
        pairs = zip(groups.values(), after, strict=True)
        return {number: (state, [state]) for members, state in pairs for number in members}

    def steer(self, system: System) -> None:
        """Go on with a system whose counterfaces or loads are others from now on."""
        self.steppers = [replace(self.steppers[0], system=system)]


def advance(
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
    starts, leads = predict(steppers, states, time, counterfaces), [_Lead() for _ in steppers]
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
        if all(map(_is_at_rest, steppers, starts, contacts, unknowns)):
            break
        starts = list(map(_Lead.move, leads, steppers, starts, unknowns))
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
