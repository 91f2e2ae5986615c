"""The contact forces of one step, for any number of candidates; compiled steps in 2D call the partitions themselves.

Few candidates are solved all together, in 2D by partitions (:mod:`fingerslip.contact.solve.partition`), in 3D
by compiled code (:mod:`fingerslip.contact.solve.newton`). Of many, most stay
open: the touching nodes and the nearest open ones form the *working set* on which Newton's method runs
(:mod:`fingerslip.contact.solve.krylov`). Its forces are then checked on all candidates. Nodes outside the working set
that would be penetrated join it, until there are none.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fingerslip.arrays import Flags, Floats, Integers
from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.krylov import newton_krylov
from fingerslip.contact.solve.newton import ContactSolution, solve_friction
from fingerslip.contact.solve.partition import Partition, first_partition, solve_in_partitions
from fingerslip.contact.solve.projection import project, step_lengths
from fingerslip.contact.solve.working_set import WorkingSet, first_guess, gather, next_warm_start

# Unknowns up to which compiled code on all candidates is faster.
_FEW = 900
_ROUNDS = 25
# The working set holds this share of open nodes beside the touching ones, so that it lasts for some steps.
_SPARE_SHARE, _SPARE_NODES = 0.1, 20
_TOO_MANY = 1.5
# Tolerance on the working set, so that the last projection and the other nodes keep the residual below that of all.
_FINER = 0.1
# Relative residual of the first Newton direction, from the last step's forces and from nearly solved ones, from where
# one direction should do; it is as exact as its goal needs, but for a finest that single precision reaches.
_ROUGH, _FINE, _FINEST = 0.1, 1e-4, 1e-5


def solve_contact(
    compliance: Compliance,
    free: Floats,
    friction_coefficient: Floats,
    start: Floats,
    tolerance: float,
    *,
    working_set: WorkingSet | Partition | None = None,
    origin: Floats | None = None,
    few: int | None = None,
) -> tuple[ContactSolution, WorkingSet | Partition | None]:
    """Find the contact forces of one step; those of few unknowns all together.

    Arrays: free (n_c, dim) [m]; friction_coefficient (n_c,) [-]; start (n_c, dim) [N]; tolerance [-]; origin (n_c,
    dim) [N].
    """
    if free.size > (_FEW if few is None else few):
        old = working_set if isinstance(working_set, WorkingSet) else None
        scale = step_lengths(compliance.diagonal)
        # The force that would undo the worst free penetration alone sets the scale of rounding.
        least = 1e-12 * float(np.max(scale * np.abs(free)))
        problem = _Problem(compliance, np.ascontiguousarray(free), friction_coefficient, scale, least)
        warm_start = None if old is None else old.warm_start_under(compliance)
        check = problem.check(*first_guess(compliance, warm_start, start, origin))
        solution, used = _solve_on_working_set(problem, check, tolerance, old)
        left = next_warm_start(warm_start, solution.forces, solution.response, start, origin)
        return solution, replace(used, warm_start=replace(left, frames=compliance.frames))
    matrix = compliance.matrix
    # An inverse is worth its updates where the compliance stays: frames that turn change it in every step.
    if isinstance(working_set, Partition) and working_set.compliance is matrix:
        return solve_in_partitions(working_set, compliance.penalty, free, friction_coefficient, start, tolerance)
    solution = solve_friction(matrix, free, friction_coefficient, start, tolerance)
    has_partition = free.size and free.shape[1] == 2
    return solution, first_partition(matrix, compliance.penalty) if has_partition else None


@dataclass(frozen=True)
class _Check:
    """Forces and their residual on all candidates."""

    forces: Floats
    response: Floats
    trial: Floats
    residual: Floats
    least: float

    @property
    def relative_residual(self) -> float:
        """Largest residual over the largest force."""
        size = max(float(np.abs(self.forces).max()), self.least)
        return float(np.abs(self.residual).max()) / size if size > 0.0 else 0.0

    @property
    def touching(self) -> Flags:
        """Which nodes have a force or would get one."""
        return np.asarray((self.forces[:, 0] > 0.0) | (self.trial[:, 0] > 0.0))


@dataclass(frozen=True)
class _Problem:
    """The contact problem on all candidates, with the step lengths of its projection."""

    compliance: Compliance
    free: Floats
    friction: Floats
    scale: Floats
    least: float

    def check(self, forces: Floats, response: Floats | None = None) -> _Check:
        response = self.compliance.response(forces) if response is None else response
        trial = forces - self.scale * (response + self.compliance.penalty * forces + self.free)
        return _Check(forces, response, trial, forces - project(trial, self.friction), self.least)


def _solve_on_working_set(
    problem: _Problem, check: _Check, tolerance: float, old: WorkingSet | None
) -> tuple[ContactSolution, WorkingSet]:
    working_set = _chosen(problem, check, None) if old is None else old.in_step(problem.compliance, problem.scale)
    iterations, solved = 0, True
    for round_number in range(_ROUNDS):
        if not np.isin(np.flatnonzero(check.touching), working_set.nodes).all():
            working_set = _chosen(problem, check, working_set)
        elif not solved:
            # The compiled solver has sweeps where Newton's method stalls.
            nodes = working_set.nodes
            block, free, friction = problem.compliance.block(nodes), problem.free[nodes], problem.friction[nodes]
            robust = solve_friction(block, free, friction, check.forces[nodes], _FINER * tolerance)
            check = problem.check(_scatter(robust.forces, nodes, check.forces))
            iterations += robust.iterations
        before = check.relative_residual
        # From nearly solved forces, as exact as a direction has to be to be the last one.
        wanted = 0.3 * _FINER * tolerance / max(before, tolerance)
        roughest = _ROUGH if round_number == 0 else min(_FINE, max(wanted, _FINEST))
        # Newton's method on the working set; the other nodes have no force.
        nodes = working_set.nodes
        local = problem.friction[nodes], check.forces[nodes], check.trial[nodes]
        goal, least = _FINER * tolerance, problem.least
        forces, solved, used = newton_krylov(working_set, *local, goal=goal, least=least, rough=roughest)
        check = problem.check(_scatter(forces, nodes, check.forces))
        iterations += used
        if check.relative_residual <= tolerance:
            break
        # Newton's method may only claim success where the residual of all candidates has decreased.
        solved = solved and check.relative_residual < 0.5 * before
    if working_set.nodes.size > _TOO_MANY * _working_set_size(check):
        working_set = _chosen(problem, check, working_set)
    worst = int(np.argmax(np.abs(check.residual).max(axis=1)))
    solution = ContactSolution(check.forces, check.relative_residual, iterations, worst, check.response)
    return solution, working_set


def _scatter(element: Floats, nodes: Integers, like: Floats) -> Floats:
    forces = np.zeros_like(like)
    forces[nodes] = element
    return forces


def _working_set_size(check: _Check) -> int:
    """Return how many nodes a working set should have."""
    touching = int(np.count_nonzero(check.touching))
    return min(len(check.forces), touching + int(_SPARE_SHARE * touching) + _SPARE_NODES)


def _chosen(problem: _Problem, check: _Check, old: WorkingSet | None) -> WorkingSet:
    """Choose the touching nodes and the nearest open ones."""
    order = np.argsort(-check.trial[:, 0] / problem.scale[:, 0] - np.where(check.touching, np.inf, 0.0))
    return gather(problem.compliance, problem.scale, order[: _working_set_size(check)], old)
