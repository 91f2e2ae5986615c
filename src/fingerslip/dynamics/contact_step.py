"""The contact of one motion in one step: from its local displacements without contact forces to these forces."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.interface import conditions, contact_problem
from fingerslip.contact.solve.forces import solve_contact
from fingerslip.contact.solve.newton import ContactSolution
from fingerslip.contact.solve.pieces import Piece
from fingerslip.contact.solve.working_set import WorkingSet
from fingerslip.dynamics.prediction import Prediction
from fingerslip.dynamics.stepper import Stepper
from fingerslip.errors import ConvergenceError

__all__ = ["ContactStep", "solve_step"]

Array = NDArray[np.float64]

# Relative to the largest contact force. Light nodes answer a residual force with accelerations a hundredfold as
# large, relative to the largest: at the goal these are those of the full system to 1e-9, even where slip turns in
# space. Where rounding keeps a step from the goal, up to the tolerance it is still far finer than what is reported.
_GOAL = 1e-12
_TOLERANCE = 1e-10


@dataclass(frozen=True)
class ContactStep:
    """The contact problem of a step, and its solution.

    Parameters
    ----------
    frames : (n_c, dim, dim) array
        Frames of the candidates [-].
    coefficients : (n_c,) array
        Friction coefficients [-].
    relative : (n_c, dim) array
        Gap, and tangential displacement relative to the counterface, at the end of the step [m].
    solution : ContactSolution
        The forces in the frames.
    working_set : WorkingSet, Piece or None
        For the next step.
    """

    frames: Array
    coefficients: Array
    relative: Array
    solution: ContactSolution
    working_set: WorkingSet | Piece | None

    @cached_property
    def forces(self) -> Array:
        """Contact forces in global components, shape (n_c, dim) [N]."""
        forces: Array = np.einsum("cij,ci->cj", self.frames, self.solution.forces)
        return forces


def solve_step(stepper: Stepper, start: Prediction, local: Array) -> ContactStep:
    """Find the contact forces of a step.

    The frames of curved counterfaces are those at the predicted motion, about which the gap is linear.

    Parameters
    ----------
    stepper : Stepper
        What stays the same.
    start : Prediction
        The step before its substitution.
    local : (n_c * dim,) array
        The candidates' part of the unknown without contact forces, in the unit of the scheme's unknown.

    Raises
    ------
    ConvergenceError
        Where the contact problem was not solved.
    """
    candidates, before = stepper.system.candidates, start.before.interface
    frames, relative = _free_motion(stepper, start, local.reshape(start.moved.shape))
    constant = stepper.constant_frames is not None
    compliance = stepper.compliance if constant else replace(stepper.compliance, frames=frames)
    given = conditions(candidates, before, stepper.scheme.step, start.time)
    coefficients = stepper.system.counterfaces.coefficients(given, candidates.counterface)
    problem, old = contact_problem(candidates, before, relative), start.before.working_set
    solution, working_set = solve_contact(compliance, problem, coefficients, before.forces, _GOAL, working_set=old)
    _check_solved(stepper, start, solution)
    response = compliance.response(solution.forces) if solution.response is None else solution.response
    return ContactStep(frames, coefficients, relative + response, solution, working_set)


def _free_motion(stepper: Stepper, start: Prediction, unknown: Array) -> tuple[Array, Array]:
    """Return the frames, and gap and relative displacement in them at the end of the step without contact forces."""
    counterfaces, candidates = stepper.system.counterfaces, stepper.system.candidates
    moved, points = start.moved, candidates.positions + start.moved
    free = moved + stepper.scheme.displacement_factor * unknown
    frames = stepper.constant_frames
    if frames is None:
        frames = counterfaces.frames(points, candidates.counterface)
    beyond = np.einsum("cij,cj->ci", frames, free - moved)
    relative = start.before.interface.relative + np.einsum("cij,cj->ci", frames, free - start.before.moved)
    relative[:, 0] = counterfaces.gaps(points, candidates.counterface) + beyond[:, 0]
    return frames, relative


def _check_solved(stepper: Stepper, start: Prediction, solution: ContactSolution) -> None:
    if not solution.residual <= _TOLERANCE:
        nodes = stepper.system.candidates.nodes
        raise ConvergenceError(
            start.time,
            int(nodes[solution.worst]) if nodes.size else -1,
            solution.residual,
            _TOLERANCE,
            "try a smaller time step, softer contact penalties or less friction",
        )
