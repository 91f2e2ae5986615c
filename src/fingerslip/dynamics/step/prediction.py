"""A step before its substitution: where it starts, and where it ends without forces at its end."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.step.release import fading_forces
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.stepper import Stepper
from fingerslip.dynamics.system.scheme import Predictor

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


def predict(stepper: Stepper, before: State, time: float, counterfaces: Array) -> Prediction:
    """Carry a state to the end of a step as if no force acted there.

    Parameters
    ----------
    stepper : Stepper
        What stays the same.
    before : State
        The state at the start.
    time : float
        End of the step [s].
    counterfaces : (n_counterfaces, dim) array
        Prescribed displacement of the counterfaces at the end [m].
    """
    start = predict_ends(stepper, before, time, counterfaces)
    remembered = sum(own.force(memory) for own, memory in zip(stepper.viscous, before.memories, strict=True))
    load = start.load + remembered
    right_hand_side = _right_hand_side(stepper, before, start.free, load, start.prescribed)
    return replace(start, right_hand_side=right_hand_side)


def predict_ends(stepper: Stepper, before: State, time: float, counterfaces: Array) -> Prediction:
    """Return a prediction without its right-hand side; see :func:`predict`."""
    free = stepper.scheme.predict(before.displacement, before.velocity, before.acceleration)
    free, prescribed = _carried(stepper, free, time)
    return Prediction(
        before=before,
        time=time,
        counterfaces=counterfaces,
        load=stepper.system.load(time),
        free=free,
        moved=stepper.system.moved(free.displacement, counterfaces),
        right_hand_side=np.zeros(0),
        prescribed=prescribed,
    )


def _carried(stepper: Stepper, free: Predictor, time: float) -> tuple[Predictor, Array | None]:
    """Take the moving supports to the end of the step; return their acceleration, too.

    Their unknowns follow from the prescribed displacement, so that they move by the scheme like all others.
    """
    moving, scheme = stepper.system.unknowns.moving, stepper.scheme
    if not moving.size:
        return free, None
    displacement, velocity, acceleration = free.displacement.copy(), free.velocity.copy(), np.zeros_like(free.velocity)
    unknown = (stepper.system.prescribed(time) - displacement[moving]) / scheme.displacement_factor
    displacement[moving] += scheme.displacement_factor * unknown
    velocity[moving] += scheme.velocity_factor * unknown
    acceleration[moving] = scheme.inertia_factor * unknown
    return Predictor(displacement, velocity), acceleration


def _strained_force(stepper: Stepper, free: Predictor) -> Array:
    """Return the force of stiffness and stiffness-proportional damping, but for what is remembered, shape (n,) [N]."""
    share = stepper.damping.stiffness
    if not share:
        force: Array = stepper.stiffness @ free.displacement
    elif stepper.viscous:
        force = stepper.stiffness @ free.displacement + share * (stepper.system.stiffness @ free.velocity)
    else:
        force = stepper.stiffness @ (free.displacement + share * free.velocity)
    return force


def _right_hand_side(stepper: Stepper, before: State, free: Predictor, load: Array, prescribed: Array | None) -> Array:
    system, damping, scheme = stepper.system, stepper.damping, stepper.scheme
    force = _strained_force(stepper, free)
    if damping.mass:
        force = force + damping.mass * (system.mass @ free.velocity)
    if system.dampers is not None:
        force = force + system.dampers * free.velocity
    total: Array = scheme.end_weight * (load - force) + scheme.start_weight * before.unbalance
    if before.release is not None:
        total += system.at_candidates @ fading_forces(scheme, before.release).ravel()
    if prescribed is not None:
        total -= system.mass @ prescribed
        total[system.unknowns.moving] = 0.0
    return total
