"""The frictional contact problem of one step for any number of candidates.

A few candidates are solved all together by compiled code (:mod:`fingerslip.contact.solve.newton`). Of many, most stay
open: only the nodes that touch, and the nearest open ones beside them, form the *work set* of Newton's method
(:mod:`fingerslip.contact.solve.krylov`). What was found is then checked on all candidates; nodes that were left out and
would be penetrated join the work set, until none is left.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.krylov import Start, WorkSet, newton_krylov
from fingerslip.contact.solve.newton import ContactSolution, solve_friction
from fingerslip.contact.solve.projection import project, step_lengths

__all__ = ["solve_contact"]

Array = NDArray[np.float64]

# Unknowns up to which compiled code on all candidates is the quicker.
_FEW = 900
_ROUNDS = 25
# The work set holds this share of open nodes beside the touching ones, so that it lasts for some steps.
_SPARE_SHARE, _SPARE_NODES = 0.1, 20
_TOO_MANY = 1.5
# On the work set, so that the last projection and the other nodes keep the residual below the tolerance.
_FINER = 0.1
# Relative residual of the first Newton direction, from the last step's forces and from nearly solved ones.
_ROUGH, _FINE = 0.1, 1e-4


@dataclass(frozen=True)
class _Check:
    """Forces with what they mean for all candidates."""

    forces: Array
    response: Array
    trial: Array
    residual: Array
    least: float

    @property
    def relative_residual(self) -> float:
        """Largest residual over the largest force."""
        size = max(float(np.abs(self.forces).max()), self.least)
        return float(np.abs(self.residual).max()) / size if size > 0.0 else 0.0

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Which nodes have a force or would get one."""
        touching: NDArray[np.bool_] = (self.forces[:, 0] > 0.0) | (self.trial[:, 0] > 0.0)
        return touching


def solve_contact(
    compliance: Compliance,
    free: Array,
    friction_coefficient: Array,
    start: Array,
    tolerance: float,
    *,
    work: WorkSet | None = None,
) -> tuple[ContactSolution, WorkSet | None]:
    """Find the contact forces of one step.

    Parameters
    ----------
    compliance : Compliance
        W of n_c nodes.
    free : (n_c, dim) array
        q, the gap and slip without contact forces [m].
    friction_coefficient : (n_c,) array
        [-].
    start : (n_c, dim) array
        First guess of the forces, best those of the last step [N].
    tolerance : float
        Relative residual at which to stop, over all nodes [-].
    work : WorkSet, optional
        The work set of the last step.

    Returns
    -------
    solution : ContactSolution
        Whatever was reached: the caller compares its residual with the tolerance.
    work : WorkSet or None
        For the next step; None where all candidates were solved together.
    """
    if free.size <= _FEW:
        return solve_friction(compliance.matrix, free, friction_coefficient, start, tolerance), None
    return _solve_on_work_set(_problem(compliance, free, friction_coefficient), start, tolerance, work)


@dataclass(frozen=True)
class _Problem:
    compliance: Compliance
    free: Array
    friction: Array
    scale: Array
    least: float

    def check(self, forces: Array) -> _Check:
        response = self.compliance.response(forces)
        trial = forces - self.scale * (response + self.compliance.penalty * forces + self.free)
        return _Check(forces, response, trial, forces - project(trial, self.friction), self.least)


def _problem(compliance: Compliance, free: Array, friction: Array) -> _Problem:
    scale = step_lengths(compliance.diagonal)
    # The force that would undo the worst free penetration alone sets the scale of rounding.
    return _Problem(
        compliance, np.ascontiguousarray(free), friction, scale, 1e-12 * float(np.max(scale * np.abs(free)))
    )


def _solve_on_work_set(
    problem: _Problem, start: Array, tolerance: float, work: WorkSet | None
) -> tuple[ContactSolution, WorkSet]:
    found = problem.check(start if work is None else _carried_on(work.before, start))
    if work is None:
        work = _work_set(problem, found, None)
    elif problem.compliance.frames is not None:
        # The frames have turned since the last step.
        work = _gathered(problem, work.nodes, work)
    iterations, solved = 0, True
    for round_number in range(_ROUNDS):
        if not np.isin(np.flatnonzero(found.touching), work.nodes).all():
            work = _work_set(problem, found, work)
        elif not solved:
            found, used = _solve_robustly(problem, work, found, tolerance)
            iterations += used
        roughest = _ROUGH if round_number == 0 else _FINE
        before = found.relative_residual
        found, work, solved, used = _solve_there(problem, work, found, tolerance, roughest)
        iterations += used
        if found.relative_residual <= tolerance:
            break
        # Rounding aside, what Newton's method says must be true.
        solved = solved and found.relative_residual < 0.5 * before
    if work.nodes.size > _TOO_MANY * _wanted(found):
        work = _work_set(problem, found, work)
    worst = int(np.argmax(np.abs(found.residual).max(axis=1)))
    work = replace(work, before=start)
    return ContactSolution(found.forces, found.relative_residual, iterations, worst, found.response), work


def _carried_on(before: Array | None, last: Array) -> Array:
    """Return the forces as they would be if they went on as in the last step; open nodes stay open."""
    if before is None:
        return last
    guess = 2.0 * last - before
    guess[(last[:, 0] <= 0.0) | (guess[:, 0] <= 0.0)] = 0.0
    return guess


def _solve_there(
    problem: _Problem, work: WorkSet, found: _Check, tolerance: float, roughest: float
) -> tuple[_Check, WorkSet, bool, int]:
    """Go on with Newton's method on the work set; the other nodes have no force."""
    nodes = work.nodes
    start = Start(found.forces[nodes], found.trial[nodes], _FINER * tolerance, problem.least, roughest)
    own, work, solved, iterations = newton_krylov(work, problem.friction[nodes], start)
    return problem.check(_scattered(own, nodes, found.forces)), work, solved, iterations


def _solve_robustly(problem: _Problem, work: WorkSet, found: _Check, tolerance: float) -> tuple[_Check, int]:
    """Solve on the work set with the compiled solver, which has sweeps where Newton's method stalls."""
    nodes = work.nodes
    block, free, friction = problem.compliance.block(nodes), problem.free[nodes], problem.friction[nodes]
    own = solve_friction(block, free, friction, found.forces[nodes], _FINER * tolerance)
    return problem.check(_scattered(own.forces, nodes, found.forces)), own.iterations


def _scattered(own: Array, nodes: NDArray[np.int64], like: Array) -> Array:
    forces = np.zeros_like(like)
    forces[nodes] = own
    return forces


def _wanted(found: _Check) -> int:
    """Return how many nodes a work set should have."""
    touching = int(np.count_nonzero(found.touching))
    return min(len(found.forces), touching + int(_SPARE_SHARE * touching) + _SPARE_NODES)


def _work_set(problem: _Problem, found: _Check, old: WorkSet | None) -> WorkSet:
    """Take the touching nodes and the nearest open ones."""
    order = np.argsort(-found.trial[:, 0] / problem.scale[:, 0] - np.where(found.touching, np.inf, 0.0))
    return _gathered(problem, np.sort(order[: _wanted(found)]), old)


def _gathered(problem: _Problem, nodes: NDArray[np.int64], old: WorkSet | None) -> WorkSet:
    """Make a work set; the factor of an old one goes on to serve."""
    scale = problem.scale[nodes]
    scaled = (scale.reshape(-1, 1) * problem.compliance.block(nodes)).astype(np.float32)
    if old is None or old.factor is None:
        return WorkSet(nodes, scale, scaled)
    return WorkSet(nodes, scale, scaled, old.factor.moved_to(nodes, scale.shape[1]), old.lost, old.before)
