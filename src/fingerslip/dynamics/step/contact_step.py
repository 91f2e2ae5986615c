"""The contact of one motion in one step: from its local displacements without contact forces to these forces."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.contact.candidates import Candidates, Counterfaces
from fingerslip.contact.counterfaces import in_frames
from fingerslip.contact.interface import InterfaceState, conditions, contact_problem, flat_motion, in_components
from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.forces import solve_contact
from fingerslip.contact.solve.newton import ContactSolution
from fingerslip.contact.solve.partition import Partition
from fingerslip.contact.solve.working_set import WorkingSet
from fingerslip.dynamics.step.release import Release, drop, fade, fading_forces, mark_changes
from fingerslip.dynamics.step.state import Prediction
from fingerslip.dynamics.step.stepper import Stepper
from fingerslip.dynamics.system.operators import Pose
from fingerslip.errors import ConvergenceError
from fingerslip.linear.symmetric import symmetric_product

# Relative to the largest contact force. Light nodes answer a residual force with accelerations a hundredfold as
# large, relative to the largest: at the goal these are those of the full system to 1e-9, even where slip turns in 3D.
# Where rounding keeps a step from the goal, up to the tolerance it is still far finer than what is reported.
GOAL = 1e-12
TOLERANCE = 1e-10
_MISSED_BY = TOLERANCE / GOAL
# With a compliance of single precision accelerations are only known to 1e-4 of the largest, whatever the goal.
_GOAL_SINGLE = 5e-11
# Change of where turned bodies see the candidates, over the size of the mesh, at which a step is corrected no more, and
# up to which it is accepted: each correction shrinks it by about the pressure over penalty and radius.
POSE_GOAL, _POSE_TOLERANCE, _MOST_POSES = 1e-11, 1e-8, 25


@dataclass(frozen=True)
class ContactStep:
    """The contact problem of a step, and its solution."""

    frames: Floats  # (n_c, dim, dim), frames of the candidates [-]
    coefficients: Floats  # (n_c,), friction coefficients [-]
    relative: Floats  # (n_c, dim) [m]
    solution: ContactSolution  # the forces in the frames
    working_set: WorkingSet | Partition | None  # for the next step
    release: Release | None = None  # of nodes that have left, at the end of the step
    release_force: Floats | None = None  # (n_c, dim) [N]
    release_response: Floats | None = None  # (n_c, dim), what that does to the candidates, in the frames [m]
    pose: Pose | None = None  # the candidates as bodies that turn see them, with the arms of the forces

    @cached_property
    def forces(self) -> Floats:
        """Contact forces in global components, shape (n_c, dim) [N]."""
        return np.asarray(in_components(self.frames, self.solution.forces))

    @property
    def moved(self) -> Floats | None:
        """What all forces do to the candidates, in global components, shape (n_c, dim) [m]; None if it is not known."""
        response = self.solution.response
        if response is None:
            return None
        if self.release_response is not None:
            response = response + self.release_response
        return np.asarray(in_components(self.frames, response / np.vecdot(self.frames, self.frames)))


def solve_step(
    stepper: Stepper, start: Prediction, local: Floats, *, earlier: ContactStep | None = None, goal: float | None = None
) -> ContactStep:
    """Find the contact forces of a step.

    The frames of curved counterfaces are those at the predicted motion, about which the gap is linear. Where bodies
    turn, this motion, and with it the arms of forces, is corrected until it is that at the end of the step; the
    iterations of the step do that at large strain, with a `goal`, and its passes do where only contact holds a body.
    """
    rotations = stepper.system.rotations
    if rotations is None or start.pose is None:
        return _solve_about(stepper, start, local, earlier, goal)
    unheld, missed = start.right_hand_side @ stepper.turning, np.inf
    anchor = np.zeros(len(start.right_hand_side)) if start.anchor is None else start.anchor
    angles, moved = anchor[rotations.at], stepper.system.relative @ anchor
    for _ in range(_MOST_POSES):
        about = start.about(stepper, moved, angles)
        beyond = local - moved + about.arms @ (unheld - angles)
        contact = replace(_solve_about(stepper, about, beyond, earlier, goal), pose=about.pose)
        if goal is not None or stepper.anchoring is not None:
            return contact
        forces = weighted_forces(stepper, contact).ravel()
        angles = unheld + stepper.turning[rotations.at] @ _moments(stepper, start, contact, about.arms)
        moved, earlier = local + symmetric_product(stepper.compliance.body, forces), contact
        missed = start.about(stepper, moved, angles).distance(stepper, contact.pose)
        if missed <= POSE_GOAL:
            return contact
    if missed > _POSE_TOLERANCE:
        raise ConvergenceError(start.time, -1, missed, _POSE_TOLERANCE, "try a smaller time step", "turning bodies")
    return contact


def _solve_about(
    stepper: Stepper, start: Prediction, local: Floats, earlier: ContactStep | None, goal: float | None
) -> ContactStep:
    """Find the contact forces of a step with frames, gaps and arms linear about where it is predicted to end."""
    before, scheme, system = start.before, stepper.scheme, stepper.system
    frames, relative = _free_motion(stepper, start, local.reshape(start.moved.shape))
    compliance = _compliance(stepper, start, frames)

    def solve(relative: Floats, earlier: ContactStep | None) -> ContactStep:
        """Search from an earlier solution of the step, or from the forces at its start."""
        warm: tuple[Floats, WorkingSet | Partition | None] = before.interface.forces, before.working_set
        if earlier is not None:
            warm = earlier.solution.forces, earlier.working_set
        surface, over = (system.candidates, system.counterfaces), (before.step, start.time)
        return solve_law(surface, compliance, frames, relative, before.interface, over=over, warm=warm, goal=goal)

    def changes(contact: ContactStep) -> NDArray[np.int8]:
        """Mark the candidates whose force at the start of the step must not count, shape (n_c,)."""
        motion = before.interface.forces, contact.solution.forces, before.interface.relative, contact.relative
        return np.asarray(mark_changes(*motion, system.candidates.tangential_stiffness, contact.coefficients))

    contact = solve(relative, earlier)
    if not scheme.inertia_factor:
        return contact
    marks = changes(contact)
    if not marks.any():
        return contact if before.release is None else replace(contact, release=fade(scheme, before.release))
    forces, dropped = (before.contact_forces_before, before.contact_forces), np.zeros_like(marks)
    while (marks > dropped).any():
        dropped = np.maximum(dropped, marks)
        release, release_force = drop(scheme, forces, before.release, dropped, frames)
        response = compliance.response(in_frames(frames, release_force) / scheme.end_weight)
        again = solve(relative + response, contact)
        contact = replace(again, release=release, release_force=release_force, release_response=response)
        marks = changes(contact)
    return contact


def weighted_forces(stepper: Stepper, contact: ContactStep) -> Floats:
    """Return what contact adds to the equation of motion of a step, in global components, shape (n_c, dim) [N]."""
    added: Floats = stepper.scheme.end_weight * contact.forces
    return added if contact.release_force is None else added + contact.release_force


def turn(stepper: Stepper, start: Prediction, contact: ContactStep, unknown: Floats) -> None:
    """Add to the unknown (n,) of a step what contact makes of the rotations of bodies."""
    if contact.pose is not None:
        unknown += stepper.turning @ _moments(stepper, start, contact, contact.pose.columns)


def _moments(stepper: Stepper, start: Prediction, contact: ContactStep, arms: Floats) -> Floats:
    """Return the moments (r,) of contact that the right-hand side of a step lacks, with arms (n_c * dim, r) [N m]."""
    moments: Floats = weighted_forces(stepper, contact).ravel() @ arms
    if start.before.release is not None:
        moments += fading_forces(stepper.scheme, start.before.release).ravel() @ (arms - start.arms)
    return moments


def solve_law(
    surface: tuple[Candidates, Counterfaces],
    compliance: Compliance,
    frames: Floats,
    relative: Floats,
    before: InterfaceState,
    *,
    over: tuple[float, float],
    warm: tuple[Floats, WorkingSet | Partition | None],
    goal: float | None = None,
    few: int | None = None,
) -> ContactStep:
    """Solve the contact problem for a motion `relative` (n_c, dim) [m] without contact forces.

    `over` is the length of the step before, 0 where there is none, and the end of this one [s]. The search starts from
    `warm`: forces (n_c, dim) [N], and what was kept with them.
    """
    candidates, counterfaces = surface
    coefficients = counterfaces.coefficients(conditions(candidates, before, *over), candidates.counterface)
    problem: Floats = contact_problem(relative, before.forces, before.relative, candidates.tangential_stiffness)
    wanted, accepted = (_GOAL_SINGLE if compliance.is_single else GOAL), TOLERANCE
    if goal is not None:
        wanted, accepted = goal, goal * _MISSED_BY
    first, old = warm
    origin = None if first is before.forces else before.forces
    solution, working_set = solve_contact(
        compliance, problem, coefficients, first, wanted, working_set=old, origin=origin, few=few
    )
    if not solution.residual <= accepted:
        raise unsolved(candidates, solution.worst, solution.residual, accepted, over[1])
    response = compliance.response(solution.forces) if solution.response is None else solution.response
    return ContactStep(frames, coefficients, relative + response, solution, working_set)


def unsolved(candidates: Candidates, worst: int, residual: float, accepted: float, time: float) -> ConvergenceError:
    """Return the error of contact that is not solved at a time [s]."""
    node = int(candidates.nodes[worst]) if candidates.nodes.size else -1
    advice = "try a smaller time step, softer contact penalties or less friction"
    return ConvergenceError(time, node, residual, accepted, advice)


def _free_motion(stepper: Stepper, start: Prediction, unknown: Floats) -> tuple[Floats, Floats]:
    """Return the frames, and gap and relative displacement in them at the end of the step without contact forces."""
    counterfaces, candidates, moved = stepper.system.counterfaces, stepper.system.candidates, start.moved
    free = moved + stepper.scheme.displacement_factor * unknown
    flat = stepper.compliance.frames
    if flat is not None:
        relative = flat_motion(flat, stepper.gaps, start.before.interface.relative, start.before.moved, free)
        return flat, relative
    points, points_before = candidates.positions + moved, candidates.positions + start.before.moved
    frames = seen = counterfaces.frames(points, candidates.counterface)
    before = stepper.system.pose(start.before.displacement, start.before.moved)
    if start.pose is not None and before is not None:
        points, points_before = start.pose.points, before.points
        seen = counterfaces.frames(points, candidates.counterface)
        frames = np.einsum("cij,ckj->cik", seen, start.pose.turned)
    beyond = np.einsum("cij,cj->ci", frames, free - moved)
    relative = start.before.interface.relative + np.einsum("cij,cj->ci", seen, points - points_before) + beyond
    relative[:, 0] = counterfaces.gaps(points, candidates.counterface) + beyond[:, 0]
    return frames, relative


def _compliance(stepper: Stepper, start: Prediction, frames: Floats) -> Compliance:
    """Return the compliance of a step in its frames, with that of bodies that turn, whose arms change."""
    compliance = stepper.compliance
    if stepper.compliance.frames is not None:
        return compliance
    if start.pose is None:
        return replace(compliance, frames=frames)
    columns, rotations = start.pose.columns, stepper.system.rotations
    assert rotations is not None, "a pose without rotations"
    body = compliance.body + columns @ stepper.turning[rotations.at] @ columns.T
    edition = (*compliance.edition, zlib.crc32(columns.tobytes()))
    return replace(compliance, body=body, frames=frames, edition=edition)
