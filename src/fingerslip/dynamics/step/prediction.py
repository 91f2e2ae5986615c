"""A step before its substitution: where it starts, and where it ends without forces at its end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import repeat

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.step.release import fading_forces
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.stepper import Stepper
from fingerslip.dynamics.system.operators import Pose
from fingerslip.dynamics.system.scheme import Predictor
from fingerslip.linear.symmetric import as_rows

__all__ = ["Prediction", "predict", "predict_ends"]

Array = NDArray[np.float64]

_NONE = np.zeros(0)


@dataclass(frozen=True)
class Prediction:
    """A step of one motion, ready for its substitution."""

    before: State  # the state at the start of the step
    time: float  # end of the step [s]
    counterfaces: Array  # (n_counterfaces, dim), prescribed displacement of the counterfaces at the end [m]
    load: Array  # (n,), forces of loads at the end, those on rigid bodies included [N]
    free: Predictor  # the end of the step with no unknown
    moved: Array  # (n_c, dim), displacement of the candidates relative to their counterfaces there [m]
    pose: Pose | None  # the candidates there as bodies see them that turn
    right_hand_side: Array  # (n,), right-hand side of the step without contact forces [N]
    prescribed: Array | None = None  # (n,), acceleration of moving supports at the end, zero elsewhere [m/s^2]
    anchor: Array | None = None  # (n,), where the springs of the stepper pull to, relative to `free` [m]

    @property
    def arms(self) -> Array:
        """Displacement of the candidates relative to turning bodies per rotation, shape (n_c * dim, r) [m]."""
        return np.zeros((self.moved.size, 0)) if self.pose is None else self.pose.columns

    def about(self, stepper: Stepper, moved: Array, angles: Array) -> Prediction:
        """Return the step predicted to end with candidates (n_c * dim,) and rotations (r,) at these unknowns."""
        system, factor = stepper.system, stepper.scheme.displacement_factor
        displacement, reached = self.free.displacement.copy(), self.moved + factor * moved.reshape(self.moved.shape)
        if system.rotations is not None:
            displacement[system.rotations.at] += factor * angles
        return replace(self, moved=reached, pose=system.pose(displacement, reached))

    def distance(self, stepper: Stepper, pose: Pose | None) -> float:
        """Return how far candidates are from where turned bodies see them in a pose, over the size of the mesh [-]."""
        if self.pose is None or pose is None:
            return 0.0
        size = float(np.ptp(stepper.system.space.positions, axis=0).max())
        return float(np.abs(self.pose.points - pose.points).max()) / size

    def with_anchor(self, stepper: Stepper, anchor: Array) -> Prediction:
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
    """Carry the states of k motions, which share their matrices, to the end of a step as if no force acted there.

    Arrays: time [s]; counterfaces (n_counterfaces, dim), their prescribed displacement at the end [m].
    """
    starts = list(map(predict_ends, steppers, states, repeat(time), counterfaces))
    displacement = as_rows([start.free.displacement for start in starts])
    velocity = as_rows([start.free.velocity for start in starts])
    resisting = steppers[0].resisting_force(displacement, velocity)
    sides = map(_right_hand_side, steppers, starts, resisting)
    return [replace(start, right_hand_side=side) for start, side in zip(starts, sides, strict=True)]


def _right_hand_side(stepper: Stepper, start: Prediction, resisting: Array) -> Array:
    """Return the right-hand side (n,) of a step from what resists its free end, (n,) [N]."""
    scheme, system, before = stepper.scheme, stepper.system, start.before
    force = start.load - resisting
    for layer, variables in zip(stepper.viscous, before.history_variables, strict=True):
        force += layer.force(variables)
    side: Array = scheme.end_weight * force + scheme.start_weight * before.unbalance
    if start.prescribed is not None:
        # The inertia of moving supports is known; their own equations are empty.
        side -= system.mass @ start.prescribed
        side[system.unknowns.moving] = 0.0
    if before.release is not None:
        side += system.push(fading_forces(scheme, before.release), start.pose)
    return side


def predict_ends(stepper: Stepper, before: State, time: float, counterfaces: Array) -> Prediction:
    """Return the prediction of one motion without its right-hand side; see :func:`predict`."""
    system, scheme = stepper.system, stepper.scheme
    free, moving = scheme.predict(before.displacement, before.velocity, before.acceleration), system.unknowns.moving
    prescribed = None
    if moving.size:
        # Moving supports move by the scheme like all others.
        unknown = np.zeros_like(free.displacement)
        unknown[moving] = (system.support_values(time) - free.displacement[moving]) / scheme.displacement_factor
        displacement = free.displacement + scheme.displacement_factor * unknown
        free = Predictor(displacement, free.velocity + scheme.velocity_factor * unknown)
        prescribed = scheme.inertia_factor * unknown
    moved = system.moved(free.displacement, counterfaces)
    return Prediction(
        before=before,
        time=time,
        counterfaces=counterfaces,
        load=system.load(time),
        free=free,
        moved=moved,
        pose=system.pose(free.displacement, moved),
        right_hand_side=_NONE,
        prescribed=prescribed,
    )
