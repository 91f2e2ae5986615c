"""A step before its substitution: where it starts, and where it ends without forces at its end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.step.free_ends import free_ends, right_hand_sides
from fingerslip.dynamics.step.release import fading_forces
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.stepper import Stepper
from fingerslip.dynamics.system.operators import Pose
from fingerslip.dynamics.system.scheme import Predictor
from fingerslip.linear.symmetric import as_rows

__all__ = ["Prediction", "predict", "predict_ends"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

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
    stepper, loads = steppers[0], [stepper.system.load(time) for stepper in steppers]
    moving = _moving(stepper, time)
    ends = free_ends(stepper.prediction, stepper.factors, *moving, *_starts(states))
    unbalance = as_rows([state.unbalance for state in states])
    remembered = as_rows(list(map(_with_history_forces, steppers, states, loads)))
    right = right_hand_sides(stepper.factors, stepper.resistance, moving[0], ends, unbalance, remembered)
    inputs = ((time, *arguments) for arguments in zip(counterfaces, loads, strict=True))
    predictions = list(map(_prediction, steppers, states, inputs, ends, right))
    for arguments, start in zip(steppers, predictions, strict=True):
        if start.before.release is not None:
            fading = fading_forces(stepper.scheme, start.before.release)
            start.right_hand_side[:] += arguments.system.push(fading, start.pose)
    return predictions


def predict_ends(stepper: Stepper, before: State, time: float, counterfaces: Array) -> Prediction:
    """Return the prediction of one motion without its right-hand side; see :func:`predict`."""
    ends = free_ends(stepper.prediction, stepper.factors, *_moving(stepper, time), *_starts([before]))
    return _prediction(stepper, before, (time, counterfaces, stepper.system.load(time)), ends[0], _NONE)


def _moving(stepper: Stepper, time: float) -> tuple[Indices, Array]:
    """Return the unknowns of moving supports, (m,), and their displacement at the end of a step, (m,) [m]."""
    moving = stepper.system.unknowns.moving
    return moving, stepper.system.support_values(time) if moving.size else _NONE


def _starts(states: Sequence[State]) -> tuple[Array, Array, Array]:
    """Return displacement, velocity and acceleration of k states, (k, n) each."""
    return (
        as_rows([state.displacement for state in states]),
        as_rows([state.velocity for state in states]),
        as_rows([state.acceleration for state in states]),
    )


def _prediction(
    stepper: Stepper, before: State, inputs: tuple[float, Array, Array], ends: Array, right_hand_side: Array
) -> Prediction:
    """Return the prediction of a motion, from its fields at the end of the step without unknown, (2 or 3, n).

    What is given is the time, the displacement of the counterfaces and the loads there.
    """
    time, counterfaces, load = inputs
    displacement, velocity, *prescribed = ends
    moved = stepper.system.moved(displacement, counterfaces)
    return Prediction(
        before=before,
        time=time,
        counterfaces=counterfaces,
        load=load,
        free=Predictor(displacement, velocity),
        moved=moved,
        pose=stepper.system.pose(displacement, moved),
        right_hand_side=right_hand_side,
        prescribed=prescribed[0] if prescribed else None,
    )


def _with_history_forces(stepper: Stepper, state: State, load: Array) -> Array:
    """Return a load (n,) with the forces of what materials remember [N]."""
    remembered = [layer.force(memory) for layer, memory in zip(stepper.viscous, state.memories, strict=True)]
    return np.sum([load, *remembered], axis=0) if remembered else load
