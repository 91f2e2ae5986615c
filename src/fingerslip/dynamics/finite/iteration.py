"""Newton's method in a step at large strain: the bulk linearised about the last iterate, contact solved on its own.

With the elastic force R(u), the step from 0 to 1 finds the unknown x of ::

    M a_1 + w_1 (R(u_1) + C v_1 - f_1 - B^T r_1) = w_0 F_0,    u_1 = u~ + c_u x,    v_1 = v~ + c_v x,    a_1 = c_a x

An iteration solves for the change of x with the effective matrix A of some tangent, condensed onto the contact nodes:
the forces r obey the law of contact at the new displacement, whatever the iterate, far better than the iterate itself
obeys its equation. So the only residual is that of the equation of motion, and of curved counterfaces, whose gap is
linear about the iterate. It shrinks from one iteration to the next the more, the nearer the tangent is; iterates are
mixed so that it shrinks faster (:class:`fingerslip.dynamics.step.anchor.Mixing`).
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.dynamics.finite.body import BodyState, Local
from fingerslip.dynamics.finite.factors import Factors
from fingerslip.dynamics.step.anchor import Mixing
from fingerslip.dynamics.step.condensation import Halfway
from fingerslip.dynamics.step.contact_step import TOLERANCE, ContactStep, solve_step, turn, weighted_forces
from fingerslip.dynamics.step.finish import Strained, finish
from fingerslip.dynamics.step.release import fading_forces
from fingerslip.dynamics.step.state import Prediction, State, predict_ends
from fingerslip.dynamics.step.stepper import Stepper
from fingerslip.errors import ConvergenceError, FingerslipError

# Residual over the forces of the step. On the shipped fingertip it leaves 1e-7 of the displacement and 6e-5 of the
# largest acceleration, and slip times to 1e-8 s: the step and the mesh cost a thousand times as much.
_TOLERANCE = 1e-6
_MOST, _HALVINGS, _RENEWALS = 60, 8, 15
# How many slow iterations in a row ask for new factors, and how many once there were some in the step.
_PATIENCE, _LITTLE = 3, 1
# Work of the forces at the end of an iteration over that at its beginning, above which it went far too short a way.
# On the ridged section at 5 mm 0.5 does as well; where no iterate goes on, a step of 200 ms is not solved.
_DOWNHILL = 0.9
# What contact may miss its law by, relative to the largest force: in the iteration that should be the last, in others
# over the error of the iterate, and at most. On the shipped fingertip in 3D this takes as many iterations as 1e-12
# does, and moves accelerations by less than the tolerance does.
_AT_END, _OF_ERROR, _COARSEST = 1e-8, 1e-2, 1e-5
# Contraction that is expected before any is known.
_USUAL = 0.1
_PROBLEM = "motion at large strain"


@dataclass(frozen=True)
class _Iterate:
    """An iterate, evaluated."""

    unknown: Floats  # (n,)
    local: Local  # coordinates of the displacement
    end: Prediction  # the step predicted to end here, with the residual without contact forces as its right-hand side
    body: BodyState
    size: float  # the scale of the forces [N]


@dataclass(frozen=True)
class _Linearised:
    """The step linearised about an iterate, and solved."""

    halfway: Halfway  # its substitution up to the forces of contact
    contact: ContactStep
    force: Floats  # (n_c, dim), that of contact as the equation of motion counts it [N]
    residual: Floats  # (n,), that of the iterate with these forces [N]
    error: float  # its norm over the size [-]
    contraction: float  # that over the error of the iteration before [-]


def advance_finite(factors: Factors, before: State, time: float) -> tuple[State, int]:
    """Take one step at large strain to a time [s]; also return how many iterations it took."""
    begun = replace(before, body=factors.system.require_body().begun(before.large_body, factors.scheme.step))
    counterfaces = factors.system.displacements(time)
    # Nothing here may hold the factors, as others may take their place.
    start = predict_ends(factors.at(before.large_body, before.velocity), begun, time, counterfaces)
    iterate, contact, iterations = _solve(factors, start)
    factors.used(iterations)
    stepper = factors.current
    with factors.watch.part("recording"):
        # The energies are those of the mean force. In a body that relaxes, the work that it does not store is what
        # dashpots take, and else an error of the step.
        body, start_body = stepper.system.require_body(), before.large_body
        after = body.ended(iterate.body)
        change = after.displacement - start_body.displacement
        lost = 0.5 * float((start_body.force + after.force) @ change) - (after.energy - start_body.energy)
        viscous, numerical = (lost, 0.0) if body.relaxes else (0.0, lost)
        strained = Strained(after.energy, viscous, numerical, body=replace(after, change=change))
        return finish([stepper], [start], [contact], iterate.unknown[None], [strained])[0], iterations


def _solve(factors: Factors, start: Prediction) -> tuple[_Iterate, ContactStep, int]:
    """Iterate to the solution of a step; also return its contact and how many iterations it took."""
    iterate, mixing, contact = _first(factors, start), Mixing(), None
    last, contraction, slow, renewals, is_stuck = np.inf, _USUAL, 0, 0, False
    for iteration in range(1, _MOST + 1):
        solved = _linearise(factors, iterate, contact, (last, contraction))
        contact, contraction = solved.contact, solved.contraction
        # Where nothing is left to correct, the iterate is the end, as exactly as contact is ever solved.
        if solved.error <= TOLERANCE and _error(factors.current, iterate, solved) <= TOLERANCE:
            return iterate, contact, iteration
        slow = slow + 1 if _iterations_left(solved.error, last) > factors.cost_in_step else 0
        if slow >= (_LITTLE if renewals else _PATIENCE):
            if renewals == _RENEWALS:
                break
            # Nothing may hold the old factors while new ones are made: in 3D both would not fit into memory.
            mixing, contact = Mixing(), None
            factors.renew(iterate.body, rough=not renewals)
            since = factors.scheme.displacement_factor * iterate.unknown
            local = factors.inclusions.local(since, start.displacement, factors.rotations)
            iterate = replace(iterate, local=local)
            renewals, slow, last = renewals + 1, 0, np.inf
            continue
        end = _end(factors, iterate, solved)
        mixed = mixing.next(end, solved.residual)
        # Only at the end of an iteration does contact obey its law; a mixed iterate cannot be the last.
        is_end = contraction * solved.error <= _TOLERANCE
        before, last = iterate, solved.error
        try:
            iterate, reached = _towards(factors, start, before, end if is_end else mixed)
        except ConvergenceError:
            if is_stuck:
                raise
            # Cells let it go nowhere: with other factors it may.
            is_stuck, slow = True, _PATIENCE
            continue
        is_stuck = False
        if is_end and reached and _error(factors.current, iterate, solved) <= _TOLERANCE:
            return iterate, contact, iteration
        if factors.is_positive:
            further = _downhill(factors, start, (before, iterate), solved.force)
            mixing, iterate = mixing if further is iterate else Mixing(), further
    raise _failure(factors.current, start, iterate, solved)


def _iterations_left(error: float, last: float) -> float:
    """Return how many iterations are left if errors go on to shrink as in the last one; zero after the first."""
    if error <= _TOLERANCE:
        return 0.0
    return float(np.log(error / _TOLERANCE) / np.log(last / error)) if error < last else np.inf


def _first(factors: Factors, start: Prediction) -> _Iterate:
    """Return the first iterate: the body goes on as in the last step, without one with the velocity at the start."""
    scheme, before, body, turned = factors.scheme, start.before, factors.inclusions, factors.rotations
    predictor = start.displacement
    # Velocity and acceleration at the start say less of a step: they turn with every node that touches.
    change = before.large_body.change
    change = scheme.step * before.velocity if change is None else scheme.step / before.step * change
    onwards = body.moved(body.local(before.displacement - predictor, predictor, turned), change, turned)
    best, least = None, np.inf
    for since in (body.since(onwards, predictor, turned), np.zeros_like(predictor)):
        try:
            iterate = _at(factors, start, since, before.large_body)
        except FingerslipError as error:
            # A traceback holds the factors, and itself: in 3D they would fill the memory.
            too_far = error.with_traceback(None)
            continue
        if scheme.inertia_factor:
            return iterate
        # A static change goes on as before only where this is nearer to equilibrium: not where a body turns far.
        left = float(np.linalg.norm(iterate.end.right_hand_side))
        if best is None or left < least:
            best, least = iterate, left
    if best is None:
        raise ConvergenceError(start.time, -1, np.inf, _TOLERANCE, f"{too_far}; try a smaller time step", _PROBLEM)
    return best


def _linearise(
    factors: Factors,
    iterate: _Iterate,
    earlier: ContactStep | None,
    errors: tuple[float, float],
) -> _Linearised:
    """Solve the step linearised about an iterate.

    Contact is searched from that of an earlier iteration. It is as exact as the iterate needs, whose error is expected
    from the error of the iteration before and the contraction, until contact tells it.
    """
    (last, contraction), watch, stepper = errors, factors.watch, factors.current
    with watch.part("substitution"):
        forces = factors.inclusions.forces(iterate.end.right_hand_side, iterate.local, factors.rotations)
        halfway = stepper.condensed.forward(forces)
    local, goal = halfway.local[stepper.rows], _goal(contraction * last, contraction)
    for _ in range(2):
        with watch.part("contact"):
            contact = solve_step(stepper, iterate.end, local, earlier=earlier, goal=goal)
        force = weighted_forces(stepper, contact)
        residual, size = _with_contact(stepper, iterate, force)
        error = float(np.linalg.norm(residual)) / size
        contraction = min(error / last, 1.0) if np.isfinite(last) else _USUAL
        earlier, goal = contact, _goal(error, contraction)
        if contact.solution.residual <= goal:
            break
    return _Linearised(halfway, contact, force, residual, error, contraction)


def _end(factors: Factors, iterate: _Iterate, solved: _Linearised) -> Floats:
    """Return the coordinates (m,) where the step linearised about an iterate ends."""
    stepper, inclusions = factors.current, factors.inclusions
    with factors.watch.part("substitution"):
        forces = np.zeros_like(solved.halfway.local)
        forces[stepper.rows] = solved.force.ravel()
        change = stepper.condensed.backward(solved.halfway, forces)
        turn(stepper, iterate.end, solved.contact, change)
        motion = inclusions.motion(change, iterate.local, factors.rotations)
        return inclusions.moved(iterate.local, stepper.scheme.displacement_factor * motion, factors.rotations)


def _goal(error: float, contraction: float) -> float:
    """Return by how much contact may miss its law, relative to the largest force, for an iterate with an error."""
    if contraction * error <= _TOLERANCE:
        return _AT_END
    return min(max(_OF_ERROR * error, _AT_END), _COARSEST)


def _with_contact(stepper: Stepper, iterate: _Iterate, force: Floats) -> tuple[Floats, float]:
    """Return the residual (n,) of an iterate with contact forces (n_c, dim), and the scale of all forces [N]."""
    system = stepper.system
    pushed = system.push(force, iterate.end.pose)
    residual = iterate.end.right_hand_side + pushed
    residual[system.unknowns.moving] = 0.0
    return residual, max(iterate.size, float(np.linalg.norm(pushed)))


def _towards(factors: Factors, start: Prediction, iterate: _Iterate, aim: Floats) -> tuple[_Iterate, bool]:
    """Return the iterate at some coordinates (m,), or as near as cells let it go, and whether it was reached."""
    here = iterate.local.flat()
    for halved in range(_HALVINGS):
        try:
            there = aim if not halved else here + 0.5**halved * (aim - here)
            since = factors.inclusions.since(there, start.displacement, factors.rotations)
            return _at(factors, start, since, iterate.body), not halved
        except FingerslipError as error:
            too_far = error.with_traceback(None)
    raise _failure(factors.current, start, iterate, None, too_far)


def _downhill(factors: Factors, start: Prediction, way: tuple[_Iterate, _Iterate], force: Floats) -> _Iterate:
    """Return where an iterate comes to that goes on, in doubled steps, while forces do nearly as much work as before.

    A tangent that was made definite is too stiff where a body gives way: an iterate may go a thousandth of the way.
    """
    before, iterate = way
    here, step = before.local.flat(), iterate.end.displacement - before.end.displacement
    direction = iterate.local.flat() - here

    def work(end: _Iterate) -> float:
        return float(_with_contact(factors.current, end, force)[0] @ step)

    least, latest = _DOWNHILL * work(before), work(iterate)
    with contextlib.suppress(FingerslipError):
        while 0.0 < least < latest:
            direction = 2.0 * direction
            since = factors.inclusions.since(here + direction, start.displacement, factors.rotations)
            further = _at(factors, start, since, iterate.body)
            latest = work(further)
            if not latest > 0.0:  # nor where it is no number
                break
            iterate = further
    return iterate


def _at(factors: Factors, start: Prediction, since: Floats, near: BodyState) -> _Iterate:
    """Evaluate the equation of motion without contact forces at a displacement since the predictor (n,) [m]."""
    stepper = factors.current
    system, scheme = stepper.system, stepper.scheme
    since = since.copy()
    since[system.unknowns.moving] = 0.0
    unknown, displacement = since / scheme.displacement_factor, start.displacement + since
    velocity = start.velocity + scheme.velocity_factor * unknown
    with factors.watch.part("bulk"):
        body = system.require_body().at(displacement, near)
    inertia = np.zeros_like(unknown)
    if scheme.inertia_factor:
        acceleration = scheme.inertia_factor * unknown
        inertia = system.mass @ (acceleration if start.prescribed is None else acceleration + start.prescribed)
    elastic = scheme.end_weight * body.force
    residual = scheme.end_weight * (start.load - stepper.damping_force(velocity)) - elastic - inertia
    residual += scheme.start_weight * start.before.unbalance
    moved = system.moved(displacement, start.counterfaces)
    pose = system.pose(displacement, moved)
    if start.before.release is not None:
        residual += system.push(fading_forces(scheme, start.before.release), pose)
    residual[system.unknowns.moving] = 0.0
    size = max(float(np.linalg.norm(part)) for part in (elastic, inertia, start.load))
    size = max(size, system.rounding / _TOLERANCE)
    local = factors.inclusions.local(since, start.displacement, factors.rotations)
    end = replace(start, displacement=displacement, velocity=velocity, moved=moved, pose=pose, right_hand_side=residual)
    return _Iterate(unknown, local, end, body, size)


def _error(stepper: Stepper, iterate: _Iterate, solved: _Linearised) -> float:
    """Return the error of an iterate with the contact forces that led to it, relative to the forces.

    On curved counterfaces it also counts by how much forces would change with the gaps as they are.
    """
    residual, size = _with_contact(stepper, iterate, solved.force)
    error, contact = float(np.linalg.norm(residual)) / size, solved.contact
    pressing = contact.solution.forces[:, 0]
    if stepper.compliance.frames is not None or not pressing.any():
        return error
    candidates, counterfaces = stepper.system.candidates, stepper.system.counterfaces
    end = iterate.end
    points = candidates.positions + end.moved if end.pose is None else end.pose.points
    gaps = counterfaces.gaps(points, candidates.counterface)
    missed = candidates.normal_stiffness * np.abs(gaps - contact.relative[:, 0])
    return max(error, float(missed[pressing > 0.0].max() / pressing.max()))


def _failure(
    stepper: Stepper,
    start: Prediction,
    iterate: _Iterate,
    solved: _Linearised | None,
    too_far: FingerslipError | None = None,
) -> ConvergenceError:
    """Return the error of a step that was not solved."""
    system = stepper.system
    residual = iterate.end.right_hand_side if solved is None else solved.residual
    dofs = np.append(system.unknowns.free, -1)
    worst = dofs[min(int(np.argmax(np.abs(residual))), dofs.size - 1)]
    advice = "try a smaller time step, a finer or more regular mesh, or softer contact penalties"
    if too_far is not None:
        advice = f"{too_far}; {advice}"
    error = np.inf if solved is None else _error(stepper, iterate, solved)
    node = int(worst) // system.space.dim
    # Unknowns behind those of the nodes are those of rigid bodies.
    positions = system.space.positions
    position = tuple(map(float, positions[node])) if 0 <= node < len(positions) else ()
    return ConvergenceError(start.time, node, error, _TOLERANCE, advice, _PROBLEM, position)
