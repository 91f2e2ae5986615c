"""Bodies without inertia, deformable and rigid, that only contact holds.

Their stiffness is singular: rigid motions cost nothing until contact resists. Soft springs, in proportion to the mass,
hold the body to an anchor, and a step is solved again with the anchor where the body went, until the springs pull no
more. What is left is equilibrium of loads and contact alone. Each pass shrinks the error by about the ratio of the
springs' stiffness to that of the contact: a proximal point iteration (Rockafellar 1976).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.step.contact_step import POSE_GOAL, ContactStep
from fingerslip.dynamics.step.prediction import Prediction
from fingerslip.dynamics.step.stepper import Stepper
from fingerslip.errors import EquilibriumError

__all__ = ["is_at_rest", "move_anchor", "passes"]

Array = NDArray[np.float64]

_MOST_PASSES = 200
# Force of the springs over all forces of contact and loads.
_TOLERANCE = 1e-10
# Displacement of a pass over the size of the body, below which rounding hides it.
_ROUNDING = 1e-13


def passes(steppers: Sequence[Stepper], time: float) -> Iterator[int]:
    """Count the passes of a step: one where supports or inertia hold the body.

    Raises
    ------
    EquilibriumError
        Where the most passes were not enough: contact alone does not hold a body.
    """
    yield from range(_MOST_PASSES if steppers[0].anchoring else 1)
    if steppers[0].anchoring:
        raise EquilibriumError(time, steppers[0].system.held_by_contact)


def is_at_rest(stepper: Stepper, start: Prediction, contact: ContactStep, unknown: Array) -> bool:
    """Tell whether the springs to the anchor pull no more, and turned bodies see candidates where they are.

    Parameters
    ----------
    stepper : Stepper
        What stays the same.
    start : Prediction
        The step before its substitution.
    contact : ContactStep
        Its contact.
    unknown : (n,) array
        Change of displacement in the step [m].
    """
    if not stepper.anchoring:
        return True
    rotations = stepper.system.rotations
    if rotations is not None:
        end = start.about(stepper, stepper.system.relative @ unknown, unknown[rotations.at])
        if end.distance(stepper, contact.pose) > POSE_GOAL:
            return False
    pull = float(np.abs(start.anchor_force(stepper, unknown)).sum())
    acting = float(np.abs(contact.forces).sum() + np.abs(start.load).sum())
    moved = unknown if start.anchor is None else unknown - start.anchor
    size = float(np.ptp(stepper.system.space.positions, axis=0).max())
    return pull <= _TOLERANCE * acting or float(np.abs(moved).max()) <= _ROUNDING * size


def move_anchor(stepper: Stepper, start: Prediction, unknown: Array) -> Prediction:
    """Return the step with the anchor where the body went, `unknown` (n,) [m]."""
    return start.anchored(stepper, unknown) if stepper.anchoring else start
