"""Steps of bodies that only contact holds: the anchor to which springs hold them, and the mixing of iterates.

Bodies without inertia, deformable and rigid, that only contact holds have a singular stiffness: rigid motions cost
nothing until contact resists. Soft springs hold the body to an anchor, and a step is solved again with the anchor where
the body went, until the springs pull no more. What is left is equilibrium of loads and contact alone: a proximal point
iteration (Rockafellar 1976). Each pass shrinks the error by about the ratio of the springs' stiffness to what else
resists the motion, which is little where a body rolls, so that passes are mixed (:class:`Mixing`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.dynamics.step.contact_step import POSE_GOAL, ContactStep
from fingerslip.dynamics.step.state import Prediction
from fingerslip.dynamics.step.stepper import Stepper

# Iterations that are combined: more do not shrink the residual faster, as contact changes meanwhile.
_KEPT = 5
# Singular values of the changes of residuals below this part of the largest, or of the residual, are rounding.
_RESIDUAL_ROUNDING = 1e-8
# What a mixed pass leaves of the springs' force at most.
_SHRINKS = 0.9
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


class Anchor:
    """The anchor of a motion, from pass to pass of a step."""

    def __init__(self) -> None:
        self._mixing, self._mixes = Mixing(), False
        self._end, self._pull = np.zeros(0), np.inf

    def move(self, stepper: Stepper, start: Prediction, unknown: Floats) -> Prediction:
        """Return the step with the anchor where this pass, which went by `unknown` (n,) [m], and those before lead."""
        beyond = self._next(unknown, start.anchor_force(stepper, unknown)) - unknown
        # No farther at once than the body is large: where nothing holds it, mixing would lead to where all is rounding.
        far = float(np.abs(stepper.system.relative @ beyond).max(initial=0.0)) / stepper.system.size
        anchor = unknown + beyond / max(far, 1.0)
        moved = anchor if start.anchor is None else anchor - start.anchor
        return replace(start, anchor=anchor, right_hand_side=start.right_hand_side + stepper.anchor_force(moved))

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


def is_at_rest(stepper: Stepper, start: Prediction, contact: ContactStep, unknown: Floats) -> bool:
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
