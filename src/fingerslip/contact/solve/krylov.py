"""Newton's method for hundreds of touching nodes: directions by GMRES in compiled code, and a line search.

The directions (:mod:`fingerslip.contact.solve.gmres`) are of single precision, and so is what they are taken to do to
the trial forces. Where that is no longer exact enough for what is left of the residual, what all directions since have
done is computed again, in double precision: with the compliance among the nodes, if its entries are of single precision
themselves, so that nothing is rounded; otherwise by the caller, with that of all candidates, who then calls again.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, replace

import numba
import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.solve.gmres import Preconditioner, ScaledCompliance, Space, new_space, solve, write_moved
from fingerslip.contact.solve.line_search import NEWTON_LIMIT, SEARCH_LIMIT, decreases_enough
from fingerslip.contact.solve.local_inverse import LocalInverse, renew_rows
from fingerslip.contact.solve.projection import derivative, project
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
    """Where Newton's method begins and when it ends.

    Parameters
    ----------
    forces : (k, dim) array
        First guess of the contact forces [N].
    trial : (k, dim) array
        Trial forces z = r - rho y of that guess [N].
    goal : float
        Residual at which to stop, relative to the largest force [-].
    least : float
        Lower bound of the largest force in that ratio [N].
    roughest : float
        Relative residual of the first direction [-].
    """

    forces: Array
    trial: Array
    goal: float
    least: float = 0.0
    roughest: float = _ROUGHEST


def newton_krylov(working_set: WorkingSet, friction: Array, start: Start) -> tuple[Array, WorkingSet, bool, int]:
    """Iterate until the residual is small enough, single precision allows no more, or the line search stalls.

    Parameters
    ----------
    working_set : WorkingSet
        The k nodes to solve on.
    friction : (k,) array
        Friction coefficients [-].
    start : Start
        Where to begin.

    Returns
    -------
    forces : (k, dim) array
        Contact forces [N].
    working_set : WorkingSet
        The same nodes with the newest preconditioner.
    solved : bool
        Whether the residual became small enough, as far as it is known.
    iterations : int
        Newton iterations.
    """
    nodes, inverse = _Nodes.of(working_set, friction), working_set.inverse.copy()
    forces, solved, iterations = _iterate(nodes, inverse, start)
    return forces, replace(working_set, inverse=inverse), solved, iterations


@dataclass(frozen=True)
class _Nodes:
    """What stays the same for k nodes.

    Parameters
    ----------
    working_set : WorkingSet
        Compliance and coarse space.
    friction : (k,) array
        Friction coefficients [-].
    exact, rough : ScaledCompliance
        rho W in double and in single precision.
    space : Space
        Memory of GMRES.
    """

    working_set: WorkingSet
    friction: Array
    exact: ScaledCompliance
    rough: ScaledCompliance
    space: Space

    @classmethod
    def of(cls, working_set: WorkingSet, friction: Array) -> _Nodes:
        """Return what stays the same in a working set."""
        exact, rough = (ScaledCompliance.of(working_set, precision) for precision in (np.float64, np.float32))
        space = new_space(working_set.scale.size, _KRYLOV_LIMIT)
        return cls(working_set, np.ascontiguousarray(friction), exact, rough, space)


def _iterate(nodes: _Nodes, inverse: LocalInverse, start: Start) -> tuple[Array, bool, int]:
    """Return forces, whether they solve the problem, and iterations; the rows of the inverse are renewed."""
    forces, trial, exactness = start.forces, start.trial, start.roughest
    residual = forces - project(trial, nodes.friction)
    # Directions since the last product in double precision, and what single precision says that they do.
    owed, assumed = np.zeros_like(forces), np.zeros_like(forces)
    for iteration in range(NEWTON_LIMIT):
        enough = start.goal * max(_largest(forces), start.least)
        if owed.any() and _largest(residual) <= _KNOWN * _largest(owed):
            if not nodes.working_set.is_exact:
                return forces - residual, True, iteration
            trial, owed, assumed = _settled(nodes, trial, owed, assumed)
            residual = forces - project(trial, nodes.friction)
            exactness = _needed(enough, residual, owed)
        if _largest(residual) <= enough:
            # The last projection puts sliding nodes exactly on the cone and removes all force from open ones.
            return forces - residual, True, iteration
        direction, moved = _direction(nodes, inverse, trial, residual, exactness)
        merit = float(np.vdot(residual, residual))
        length, new = _search(forces, trial, nodes.friction, merit=merit, direction=direction, change=direction - moved)
        if not float(np.vdot(new, new)) < merit:
            if not (owed.any() and nodes.working_set.is_exact):
                return forces - residual, False, iteration + 1
            trial, owed, assumed = _settled(nodes, trial, owed, assumed)
            residual = forces - project(trial, nodes.friction)
            continue
        forces, trial, residual = forces + length * direction, trial + length * (direction - moved), new
        owed, assumed = owed + length * direction, assumed + length * moved
        # As exact as the last iteration was successful (Eisenstat & Walker 1996), but not more than the goal needs.
        success = 0.9 * float(np.vdot(new, new)) / merit
        exactness = min(max(success, _needed(enough, residual, owed)), _ROUGHEST)
    return forces - residual, False, NEWTON_LIMIT


def _largest(values: Array) -> float:
    return float(np.abs(values).max())


def _needed(enough: float, residual: Array, owed: Array) -> float:
    """Return how exact a direction has to be to be the last one, or the last before nothing is known any more."""
    wanted = max(enough, _KNOWN * _largest(owed)) / (_largest(residual) or 1.0)
    return min(max(_SAFETY * wanted, _FINEST), _ROUGHEST)


def _settled(nodes: _Nodes, trial: Array, owed: Array, assumed: Array) -> tuple[Array, Array, Array]:
    """Return the trial forces with what directions did in double precision; from then on nothing is owed."""
    moved = np.empty(owed.size)
    write_moved(nodes.exact, owed.ravel(), moved)
    return trial - (moved.reshape(owed.shape) - assumed), np.zeros_like(owed), np.zeros_like(owed)


def _search(
    forces: Array, trial: Array, friction: Array, *, merit: float, direction: Array, change: Array
) -> tuple[float, Array]:
    """Halve the step until the merit decreases enough; return its relative length and the residual at its end."""
    length, new = 1.0, forces
    for _ in range(SEARCH_LIMIT):
        new = forces + length * direction - project(trial + length * change, friction)
        if decreases_enough(float(np.vdot(new, new)), merit, length):
            break
        length *= 0.5
    return length, new


def _direction(
    nodes: _Nodes, inverse: LocalInverse, trial: Array, residual: Array, exactness: float
) -> tuple[Array, Array]:
    """Solve (I - G (I - rho W)) d = -residual to a relative `exactness`; return d and rho W d, both (k, dim)."""
    slopes, known, rough = _slopes(trial, nodes.friction), nodes.working_set, nodes.rough
    weights, local = (rough.of_body, rough.of_penalty), known.coupled.body
    renew_rows(inverse.near, inverse.rows, inverse.marks, slopes, known.frames, weights, local, known.nodes)
    count = _acting(trial, residual)
    given, scaled = slopes[:count].astype(np.float32), rough.of_first(count)
    size = float(np.linalg.norm(residual))
    right = (-residual[:count].ravel() / size).astype(np.float32)
    preconditioner = Preconditioner.of(given, known.coarse, inverse)
    found, moved, reached = solve(given, scaled, preconditioner, right, exactness, nodes.space)
    if not reached:
        found, moved = _solved_densely(given, scaled, right)
    direction, response = np.zeros_like(residual), np.zeros_like(residual)
    direction[:count] = size * found.reshape(count, -1)
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
    """Return the solution for a right-hand side (k * dim,), and rho W times it, by factors of the Newton matrix."""
    found, moved = np.zeros_like(right), np.empty_like(right)
    # A singular matrix leaves nothing, at which the line search stalls.
    with contextlib.suppress(np.linalg.LinAlgError):
        found = np.linalg.solve(_newton_matrix(slopes, scaled), right)
    write_moved(scaled, found, moved)
    return found, moved


def _newton_matrix(slopes: Single, scaled: ScaledCompliance) -> Single:
    """Return J = I - G (I - rho W), shape (k * dim, k * dim), in single precision."""
    count, dim = scaled.of_body.shape
    size, frames, nodes = count * dim, scaled.frames, np.arange(count)
    half = np.tril(scaled.body[:size, :size])
    body = (half + np.tril(half, -1).T).reshape(count, dim, count, dim)
    response = np.einsum("ikx,ixjy,jmy->ikjm", frames, body, frames, optimize=True)
    response *= scaled.of_body[:, :, None, None]
    response[nodes, :, nodes, :] -= np.eye(dim) * (1.0 - scaled.of_penalty[:, :, None])
    matrix: Single = np.einsum("ikx,ixjm->ikjm", slopes, response).reshape(size, size)
    matrix.flat[:: size + 1] += 1.0
    return matrix
