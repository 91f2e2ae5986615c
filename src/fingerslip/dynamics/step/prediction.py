"""A step before its substitution: where it starts, and where it ends without forces at its end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.step.release import fading_forces
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.stepper import Stepper
from fingerslip.dynamics.system.scheme import Predictor
from fingerslip.linear.products import as_rows, products

__all__ = ["Prediction", "predict", "predict_ends"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Prediction:
    """A step of one motion, ready for its substitution.

    Parameters
    ----------
    before : State
        The state at the start of the step.
    time : float
        End of the step [s].
    counterfaces : (n_counterfaces, dim) array
        Prescribed displacement of the counterfaces at the end [m].
    load : (n,) array
        Forces of loads at the end, those on rigid bodies included [N].
    free : Predictor
        The end of the step with no unknown.
    moved : (n_c, dim) array
        Displacement of the candidates relative to their counterfaces there [m].
    right_hand_side : (n,) array
        Right-hand side of the step without contact forces [N].
    prescribed : (n,) array, optional
        Acceleration of moving supports at the end, zero elsewhere [m/s^2]; without it none moves.
    anchor : (n,) array, optional
        Where the springs of the stepper pull to, relative to `free` [m]; without it to `free`.
    """

    before: State
    time: float
    counterfaces: Array
    load: Array
    free: Predictor
    moved: Array
    right_hand_side: Array
    prescribed: Array | None = None
    anchor: Array | None = None

    def anchored(self, stepper: Stepper, anchor: Array) -> Prediction:
        """Return the step with the anchor (n,) [m] of a body that only contact holds, relative to `free`."""
        moved = anchor if self.anchor is None else anchor - self.anchor
        right_hand_side = self.right_hand_side + stepper.anchor_force(moved)
        return replace(self, anchor=anchor, right_hand_side=right_hand_side)

    def anchor_force(self, stepper: Stepper, unknown: Array) -> Array:
        """Return the force that the anchor exerts on the body at the end of the step, shape (n,) [N]."""
        return stepper.anchor_force((0.0 if self.anchor is None else self.anchor) - unknown)


def predict(
    steppers: Sequence[Stepper], states: Sequence[State], time: float, counterfaces: Sequence[Array]
) -> list[Prediction]:
    """Carry the states of k motions to the end of a step as if no force acted there.

    Parameters
    ----------
    steppers : sequence of Stepper
        What stays the same in each; they share matrices and scheme.
    states : sequence of State
        The states at the start.
    time : float
        End of the step [s].
    counterfaces : sequence of (n_counterfaces, dim) array
        Prescribed displacement of the counterfaces at the end [m].
    """
    free, prescribed = _free_ends(steppers[0], states, time)
    loads = [stepper.system.load(time) for stepper in steppers]
    right = _right_hand_sides(steppers, states, free, as_rows(list(map(_with_remembered, steppers, states, loads))))
    if prescribed is not None:
        right -= products(steppers[0].system.mass, prescribed)
        right[:, steppers[0].system.unknowns.moving] = 0.0
    return _predictions(steppers, states, time, counterfaces, (free, prescribed, loads, right))


def predict_ends(stepper: Stepper, before: State, time: float, counterfaces: Array) -> Prediction:
    """Return the prediction of one motion without its right-hand side; see :func:`predict`."""
    free, prescribed = _free_ends(stepper, [before], time)
    found = free, prescribed, [stepper.system.load(time)], np.zeros((1, 0))
    return _predictions([stepper], [before], time, [counterfaces], found)[0]


def _free_ends(stepper: Stepper, states: Sequence[State], time: float) -> tuple[Predictor, Array | None]:
    """Return the ends of motions with no unknown, (k, n), and there the acceleration of moving supports."""
    names = "displacement", "velocity", "acceleration"
    free = stepper.scheme.predict(*(as_rows([getattr(state, name) for state in states]) for name in names))
    return _carried(stepper, free, time)


def _carried(stepper: Stepper, free: Predictor, time: float) -> tuple[Predictor, Array | None]:
    """Take the moving supports to the end of the step; return their acceleration, too.

    Their unknowns follow from the prescribed displacement, so that they move by the scheme like all others.
    """
    moving, scheme = stepper.system.unknowns.moving, stepper.scheme
    if not moving.size:
        return free, None
    displacement, velocity, acceleration = free.displacement.copy(), free.velocity.copy(), np.zeros_like(free.velocity)
    unknown = (stepper.system.prescribed(time) - displacement[:, moving]) / scheme.displacement_factor
    displacement[:, moving] += scheme.displacement_factor * unknown
    velocity[:, moving] += scheme.velocity_factor * unknown
    acceleration[:, moving] = scheme.inertia_factor * unknown
    return Predictor(displacement, velocity), acceleration


def _predictions(
    steppers: Sequence[Stepper],
    states: Sequence[State],
    time: float,
    counterfaces: Sequence[Array],
    found: tuple[Predictor, Array | None, Sequence[Array], Array],
) -> list[Prediction]:
    """Return the predictions of motions, each with its rows of what was found for all."""
    free, prescribed, loads, right_hand_sides = found
    return [
        Prediction(
            before=state,
            time=time,
            counterfaces=counterfaces[number],
            load=loads[number],
            free=Predictor(free.displacement[number], free.velocity[number]),
            moved=stepper.system.moved(free.displacement[number], counterfaces[number]),
            right_hand_side=right_hand_sides[number],
            prescribed=None if prescribed is None else prescribed[number],
        )
        for number, (stepper, state) in enumerate(zip(steppers, states, strict=True))
    ]


def _with_remembered(stepper: Stepper, state: State, load: Array) -> Array:
    """Return a load (n,) with the forces of what materials remember [N]."""
    remembered = [own.force(memory) for own, memory in zip(stepper.viscous, state.memories, strict=True)]
    return np.sum([load, *remembered], axis=0) if remembered else load


def _strained_forces(stepper: Stepper, free: Predictor) -> Array:
    """Return the forces of stiffness and stiffness-proportional damping, but for what is remembered, (k, n) [N]."""
    share = stepper.damping.stiffness
    if not share:
        return products(stepper.stiffness, free.displacement)
    if not stepper.viscous:
        return products(stepper.stiffness, free.displacement + share * free.velocity)
    damped = share * products(stepper.system.stiffness, free.velocity)
    return products(stepper.stiffness, free.displacement) + damped


def _right_hand_sides(steppers: Sequence[Stepper], states: Sequence[State], free: Predictor, loads: Array) -> Array:
    """Return the right-hand sides of motions where no supports move, shape (k, n) [N]."""
    system, damping, scheme = steppers[0].system, steppers[0].damping, steppers[0].scheme
    forces = _strained_forces(steppers[0], free)
    if damping.mass:
        forces += damping.mass * products(system.mass, free.velocity)
    if system.dampers is not None:
        forces += system.dampers * free.velocity
    unbalance = as_rows([state.unbalance for state in states])
    total: Array = scheme.end_weight * (loads - forces) + scheme.start_weight * unbalance
    for number, state in enumerate(states):
        if state.release is not None:
            fading = fading_forces(scheme, state.release)
            total[number] += steppers[number].system.at_candidates @ fading.ravel()
    return total
