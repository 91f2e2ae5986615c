"""Newton's method for hundreds of touching nodes: directions by GMRES in compiled code, and a line search.

The directions (:mod:`fingerslip.contact.solve.gmres`) are of single precision, and so is what they are taken to do to
the trial forces. Where that is no longer exact enough for what is left of the residual, what all directions since have
done is computed again, in double precision: with the compliance among the nodes, if its entries are of single precision
themselves, so that nothing is rounded; otherwise by the caller, with that of all candidates, who then calls again.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace
from functools import cached_property

import numba
import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.solve.gmres import Preconditioner, ScaledCompliance, Space, new_space, solve, write_motion
from fingerslip.contact.solve.preconditioner import LocalInverse, renew_rows
from fingerslip.contact.solve.projection import NEWTON_LIMIT, SEARCH_LIMIT, decreases_enough, derivative, project
from fingerslip.contact.solve.working_set import WorkingSet

__all__ = ["Start", "newton_krylov"]

Array = NDArray[np.float64]
Single = NDArray[np.float32]

_KRYLOV_LIMIT = 60
_ROUGHEST, _FINEST = 0.1, 1e-5
# Share of the directions since the last product in double precision, below which the residual is not known.
_KNOWN = 1e-5
# Residual of the last direction over what is wanted: what norms and nonlinearity add.
_SAFETY = 0.3


@dataclass(frozen=True)
class Start:
    """Where Newton's method begins and when it ends."""

    forces: Array  # (k, dim), first guess of the contact forces [N]
    trial: Array  # (k, dim), trial forces z = r - rho y of that guess [N]
    goal: float  # residual at which to stop, relative to the largest force [-]
    least: float = 0.0  # lower bound of the largest force in that ratio [N]
    roughest: float = _ROUGHEST  # relative residual of the first direction [-]


def newton_krylov(working_set: WorkingSet, friction: Array, start: Start) -> tuple[Array, WorkingSet, bool, int]:
    """Iterate until the residual is small enough, single precision allows no more, or the line search stalls.

    Arrays: friction (k,) [-]; returns forces (k, dim) [N].
    """
    nodes, inverse = _Nodes.of(working_set, friction), working_set.inverse.copy()
    forces, solved, iterations = _iterate(nodes, inverse, start)
    return forces, replace(working_set, inverse=inverse), solved, iterations


@dataclass(frozen=True)
class _Nodes:
    """What stays the same for k nodes."""

    working_set: WorkingSet  # compliance and coarse space
    friction: Array  # (k,), friction coefficients [-]
    exact: ScaledCompliance  # rho W in double precision
    rough: ScaledCompliance  # rho W in single precision
    space: Space  # memory of GMRES

    @classmethod
    def of(cls, working_set: WorkingSet, friction: Array) -> _Nodes:
        """Return what stays the same in a working set."""
        exact, rough = (ScaledCompliance.of(working_set, precision) for precision in (np.float64, np.float32))
        space = new_space(working_set.scale.size, _KRYLOV_LIMIT)
        return cls(working_set, np.ascontiguousarray(friction), exact, rough, space)


@dataclass(frozen=True)
class _Iterate:
    """Forces on the way to the solution, all of shape (k, dim) [N]."""

    forces: Array  # the contact forces
    trial: Array  # the trial forces z = r - rho y
    residual: Array  # the forces less the projection of the trial forces
    owed: Array  # directions since the last product in double precision
    assumed: Array  # what they are taken to do by single precision

    @property
    def on_cone(self) -> Array:
        """The forces with sliding nodes exactly on the cone, and no force on open ones."""
        return self.forces - self.residual

    @cached_property
    def merit(self) -> float:
        """Sum of the squared residuals [N^2]."""
        return float(np.vdot(self.residual, self.residual))

    @cached_property
    def is_known(self) -> bool:
        """Whether the residual is larger than what single precision leaves open."""
        owed = _largest(self.owed)
        return owed == 0.0 or _largest(self.residual) > _KNOWN * owed


def _iterate(nodes: _Nodes, inverse: LocalInverse, start: Start) -> tuple[Array, bool, int]:
    """Return forces, whether they solve the problem, and iterations; the rows of the inverse are renewed."""
    iterate, exactness = _at(nodes, start.forces, start.trial), start.roughest
    is_exact = nodes.working_set.is_exact
    for iteration in range(NEWTON_LIMIT):
        enough = start.goal * max(_largest(iterate.forces), start.least)
        if not iterate.is_known:
            if not is_exact:
                return iterate.on_cone, True, iteration
            iterate = _in_double_precision(nodes, iterate)
            exactness = _direction_tolerance(enough, iterate)
        if _largest(iterate.residual) <= enough:
            return iterate.on_cone, True, iteration
        after = _step_along(nodes, inverse, iterate, exactness)
        if not after.merit < iterate.merit:
            # The line search may have stalled because the residual is not what it seemed.
            if not (is_exact and iterate.owed.any()):
                return iterate.on_cone, False, iteration + 1
            iterate = _in_double_precision(nodes, iterate)
            continue
        # As exact as the last iteration was successful (Eisenstat & Walker 1996), but not more than the goal needs.
        exactness = min(max(0.9 * after.merit / iterate.merit, _direction_tolerance(enough, after)), _ROUGHEST)
        iterate = after
    return iterate.on_cone, False, NEWTON_LIMIT


def _largest(values: Array) -> float:
    return float(np.abs(values).max())


def _direction_tolerance(enough: float, iterate: _Iterate) -> float:
    """Return how exact a direction has to be to be the last one, or the last before nothing is known any more."""
    wanted = max(enough, _KNOWN * _largest(iterate.owed)) / (_largest(iterate.residual) or 1.0)
    return min(max(_SAFETY * wanted, _FINEST), _ROUGHEST)


def _at(nodes: _Nodes, forces: Array, trial: Array) -> _Iterate:
    """Return an iterate at which nothing is owed."""
    nothing = np.zeros_like(forces)
    return _Iterate(forces, trial, forces - project(trial, nodes.friction), nothing, nothing)


def _in_double_precision(nodes: _Nodes, iterate: _Iterate) -> _Iterate:
    """Return the iterate with what its directions did in double precision."""
    moved = np.empty(iterate.owed.size)
    write_motion(nodes.exact, iterate.owed.ravel(), moved)
    return _at(nodes, iterate.forces, iterate.trial - (moved.reshape(iterate.owed.shape) - iterate.assumed))


def _step_along(nodes: _Nodes, inverse: LocalInverse, iterate: _Iterate, exactness: float) -> _Iterate:
    """Return the end of a step along a new direction, halved until the merit decreases enough, or too often."""
    direction, moved = _direction(nodes, inverse, iterate.trial, iterate.residual, exactness)
    length, after = 1.0, iterate
    for _ in range(SEARCH_LIMIT):
        step, response = length * direction, length * moved
        forces, trial = iterate.forces + step, iterate.trial + (step - response)
        residual = forces - project(trial, nodes.friction)
        after = _Iterate(forces, trial, residual, iterate.owed + step, iterate.assumed + response)
        if decreases_enough(after.merit, iterate.merit, length):
            break
        length *= 0.5
    return after


def _direction(
    nodes: _Nodes, inverse: LocalInverse, trial: Array, residual: Array, exactness: float
) -> tuple[Array, Array]:
    """Solve (I - G (I - rho W)) d = -residual to a relative `exactness`; return d and rho W d, both (k, dim)."""
    slopes, working_set, rough = _slopes(trial, nodes.friction), nodes.working_set, nodes.rough
    weights, local = (rough.of_body, rough.of_penalty), working_set.coupling.body
    renew_rows(inverse.near, inverse.rows, inverse.marks, slopes, working_set.frames, weights, local, working_set.nodes)
    count = _acting(trial, residual)
    derivatives, scaled = slopes[:count].astype(np.float32), rough.of_first(count)
    size = float(np.linalg.norm(residual))
    right = (-residual[:count].ravel() / size).astype(np.float32)
    preconditioner = Preconditioner.of(derivatives, working_set.coarse, inverse)
    result, moved, reached = solve(derivatives, scaled, preconditioner, right, exactness, nodes.space)
    if not reached:
        result, moved = _solved_densely(derivatives, scaled, right)
    direction, response = np.zeros_like(residual), np.zeros_like(residual)
    direction[:count] = size * result.reshape(count, -1)
    response[:count] = size * moved.reshape(count, -1)
    # An open node loses its force exactly.
    is_open = trial[:, 0] <= 0.0
    direction[is_open] = -residual[is_open]
    return direction, response


@numba.njit(cache=True, nogil=True)
def _acting(trial, residual):  # type: ignore[no-untyped-def]
    """Return how many nodes there are until the last that touches or loses a force; all behind it stay as they are."""
    for i in range(len(trial) - 1, -1, -1):
        if trial[i, 0] > 0.0 or residual[i].any():
            return i + 1
    return 0


@numba.njit(cache=True, nogil=True)
def _slopes(trial, friction):  # type: ignore[no-untyped-def]
    """Return G of every node, the derivative of its projection, shape (k, dim, dim); zero where it is open."""
    count, dim = trial.shape
    slopes = np.zeros((count, dim, dim))
    for i in range(count):
        if trial[i, 0] > 0.0:
            derivative(trial[i], friction[i], slopes[i])
    return slopes


def _solved_densely(slopes: Single, scaled: ScaledCompliance, right: Single) -> tuple[Single, Single]:
    """Return the solution for a right-hand side (k * dim,), and rho W times it, by factors of J = I - G (I - rho W)."""
    count, dim = scaled.of_body.shape
    size, frames, nodes = count * dim, scaled.frames, np.arange(count)
    half = np.tril(scaled.body[:size, :size])
    body = (half + np.tril(half, -1).T).reshape(count, dim, count, dim)
    response = np.einsum("ikx,ixjy,jmy->ikjm", frames, body, frames, optimize=True)
    response *= scaled.of_body[:, :, None, None]
    response[nodes, :, nodes, :] -= np.eye(dim) * (1.0 - scaled.of_penalty[:, :, None])
    matrix: Single = np.einsum("ikx,ixjm->ikjm", slopes, response).reshape(size, size)
    matrix.flat[:: size + 1] += 1.0
    direction, moved = np.zeros_like(right), np.empty_like(right)
    # A singular matrix leaves nothing, at which the line search stalls.
    with contextlib.suppress(np.linalg.LinAlgError):
        direction = np.linalg.solve(matrix, right)
    write_motion(scaled, direction, moved)
    return direction, moved
