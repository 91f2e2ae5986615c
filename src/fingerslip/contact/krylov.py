"""Newton's method for hundreds of touching nodes: directions by GMRES with a factor that serves many steps.

The Newton matrix I - G (I - rho W) of :mod:`fingerslip.contact.solver` changes little from one iteration, and
from one time step, to the next: a few nodes begin to touch or to slip. Its factor is therefore kept as a
preconditioner, in single precision, and made anew when GMRES begins to need many iterations. Directions may
be rough: only the residual, in double precision, says what is solved.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from fingerslip.contact.projection import derivative, project

__all__ = ["WorkSet", "newton_krylov"]

Array = NDArray[np.float64]
Single = NDArray[np.float32]

_NEWTON_LIMIT = 60
_SEARCH_LIMIT = 12
_SUFFICIENT = 1e-4
_KRYLOV_LIMIT = 60
# A factorisation costs about as much as this many iterations beyond the few that a fresh factor needs.
_STALE_AFTER = 18
_ROUGHEST, _FINEST = 0.1, 1e-5


@dataclass(frozen=True)
class WorkSet:
    """The nodes that take part in Newton's method, with what is kept of them from step to step.

    Parameters
    ----------
    nodes : (k,) array
        The nodes.
    block : (k * dim, k * dim) array
        W among them [m/N].
    scale : (k, dim) array
        Step lengths rho [N/m].
    scaled : (k * dim, k * dim) array
        rho W in single precision [-].
    factor : tuple, optional
        LU factors of a Newton matrix.
    before : (n_c, dim) array, optional
        Forces of all nodes one step before the last [N].
    """

    nodes: NDArray[np.int64]
    block: Array
    scale: Array
    scaled: Single
    factor: Any = None
    before: Array | None = None


def newton_krylov(
    work: WorkSet, free: Array, friction: Array, start: Array, goal: tuple[float, float]
) -> tuple[Array, WorkSet, bool, int]:
    """Iterate until the residual is small enough or the line search stalls.

    Parameters
    ----------
    work : WorkSet
        The nodes.
    free : (k, dim) array
        q of these nodes [m].
    friction : (k,) array
        Friction coefficients [-].
    start : (k, dim) array
        First guess of the forces [N].
    goal : tuple of float
        Residual at which to stop, relative to the largest force [-], and what counts as that force at least [N].

    Returns
    -------
    forces : (k, dim) array
        [N].
    work : WorkSet
        The nodes, with the newest factor.
    solved : bool
        Whether the residual is small enough.
    iterations : int
        Newton iterations.
    """
    forces, (tolerance, least) = start, goal
    trial, residual = _evaluate(work, free, friction, forces)
    merit, before = float(np.sum(residual**2)), np.inf
    for iteration in range(_NEWTON_LIMIT):
        if np.abs(residual).max() <= tolerance * max(np.abs(forces).max(), least):
            # The last projection puts sliding nodes on the cone exactly, and leaves open ones without any force.
            return forces - residual, work, True, iteration
        # As exact as the last iteration was successful (Eisenstat & Walker 1996).
        exactness = min(max(0.9 * merit / before, _FINEST), _ROUGHEST)
        direction, work = _direction(work, friction, trial, residual, exactness)
        length, found, new = 1.0, forces, (trial, residual)
        for _ in range(_SEARCH_LIMIT):
            found = forces + length * direction
            new = _evaluate(work, free, friction, found)
            if float(np.sum(new[1] ** 2)) <= (1.0 - 2.0 * _SUFFICIENT * length) * merit:
                break
            length *= 0.5
        if not float(np.sum(new[1] ** 2)) < merit:
            return forces, work, False, iteration + 1
        forces, (trial, residual) = found, new
        merit, before = float(np.sum(residual**2)), merit
    return forces, work, False, _NEWTON_LIMIT


def _evaluate(work: WorkSet, free: Array, friction: Array, forces: Array) -> tuple[Array, Array]:
    """Return the trial forces z and the residual r - P(z)."""
    trial = forces - work.scale * ((work.block @ forces.ravel()).reshape(forces.shape) + free)
    return trial, forces - project(trial, friction)


def _direction(
    work: WorkSet, friction: Array, trial: Array, residual: Array, exactness: float
) -> tuple[Array, WorkSet]:
    """Solve (I - G (I - rho W)) d = -residual to a relative `exactness`."""
    slopes = _slopes(trial, friction).astype(np.float32)
    size = float(np.linalg.norm(residual))
    right = (-residual.ravel() / size).astype(np.float32)
    if work.factor is None:
        work = _factorised(work, slopes)
    found, used = _gmres(work, slopes, right, exactness)
    if used > _STALE_AFTER:
        work = _factorised(work, slopes)
        if used >= _KRYLOV_LIMIT:
            found, _ = _gmres(work, slopes, right, exactness)
    direction: Array = size * found.astype(np.float64).reshape(residual.shape)
    # What is open loses its force to the last digit.
    is_open = trial[:, 0] <= 0.0
    direction[is_open] = -residual[is_open]
    return direction, work


def _factorised(work: WorkSet, slopes: Single) -> WorkSet:
    matrix = _newton_matrix(slopes, work.scaled)
    # In place, the transpose's factors: LAPACK wants columns.
    return replace(work, factor=linalg.lu_factor(matrix.T, overwrite_a=True, check_finite=False))


def _gmres(work: WorkSet, slopes: Single, right: Single, exactness: float) -> tuple[Single, int]:
    """Solve by GMRES, preconditioned from the right so that its residual is the true one; `right` has length one."""
    basis = np.zeros((_KRYLOV_LIMIT + 1, right.size), dtype=np.float32)
    ready = np.zeros((_KRYLOV_LIMIT, right.size), dtype=np.float32)
    columns = np.zeros((_KRYLOV_LIMIT + 1, _KRYLOV_LIMIT))
    target = np.eye(_KRYLOV_LIMIT + 1, 1).ravel()
    basis[0] = right
    weights: Array = np.zeros(0)
    used = 0
    for used in range(1, _KRYLOV_LIMIT + 1):
        ready[used - 1] = linalg.lu_solve(work.factor, basis[used - 1], trans=1, check_finite=False)
        image = _apply(slopes, work.scaled, ready[used - 1])
        for _ in range(2):
            parts = basis[:used] @ image
            image -= (parts @ basis[:used]).astype(np.float32)
            columns[:used, used - 1] += parts
        columns[used, used - 1] = length = float(np.linalg.norm(image))
        equations = columns[: used + 1, :used]
        weights = np.asarray(np.linalg.lstsq(equations, target[: used + 1], rcond=None)[0], dtype=np.float64)
        if np.linalg.norm(target[: used + 1] - equations @ weights) <= exactness or length <= 1e-6:
            break
        basis[used] = image / np.float32(length)
    found: Single = weights.astype(np.float32) @ ready[:used]
    return found, used


def _apply(slopes: Single, scaled: Single, vector: Single) -> Single:
    """Return (I - G (I - rho W)) v."""
    inner = (vector - scaled @ vector).reshape(slopes.shape[:2])
    outer: Single = vector - np.einsum("aij,aj->ai", slopes, inner).ravel()
    return outer


@numba.njit(cache=True)
def _slopes(trial, friction):  # type: ignore[no-untyped-def]
    """Return G of every node, the derivative of its projection, shape (k, dim, dim); zero where it is open."""
    count, dim = trial.shape
    slopes = np.zeros((count, dim, dim))
    for i in range(count):
        if trial[i, 0] > 0.0:
            derivative(trial[i], friction[i], slopes[i])
    return slopes


@numba.njit(cache=True)
def _newton_matrix(slopes, scaled):  # type: ignore[no-untyped-def]
    """Return I - G (I - rho W) from G and rho W."""
    count, dim = slopes.shape[:2]
    matrix = np.zeros((count * dim, count * dim), dtype=np.float32)
    for i in range(count):
        for k in range(dim):
            row = matrix[i * dim + k]
            for m in range(dim):
                if slopes[i, k, m] != 0.0:
                    row += slopes[i, k, m] * scaled[i * dim + m]
                    row[i * dim + m] -= slopes[i, k, m]
            row[i * dim + k] += 1.0
    return matrix
