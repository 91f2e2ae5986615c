"""Newton's method for hundreds of touching nodes: GMRES directions with a preconditioner in two levels.

The Newton matrix I - G (I - rho W) of :mod:`fingerslip.contact.solve.newton` is never made. GMRES needs products with
W, and its preconditioner follows the nodes that change their state (:mod:`fingerslip.contact.solve.local_inverse`,
:mod:`fingerslip.contact.solve.coarse`). Where GMRES does not get there, the matrix is made and factorised after all.

All products here are in single precision, so the solution is only as good as that. What a direction does to the slip
is known from GMRES without another product. The caller computes the residual of the forces in double precision, over
all candidates, and calls again where that residual is still too large.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.solve.dense import factorise_dense
from fingerslip.contact.solve.line_search import NEWTON_LIMIT, SEARCH_LIMIT, decreases_enough
from fingerslip.contact.solve.projection import derivative, project
from fingerslip.contact.solve.working_set import WorkingSet

__all__ = ["Start", "newton_krylov"]

Array = NDArray[np.float64]
Single = NDArray[np.float32]

_KRYLOV_LIMIT = 60
_ROUGHEST, _FINEST = 0.1, 1e-5
# Share of the initial residual that single precision can reach.
_REACHABLE = 1e-6
# Length of a new direction of GMRES, over that of its image, from which on there is none but rounding.
_NO_NEW_DIRECTION = 1e-6


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
        Whether the residual, in single precision, became small enough.
    iterations : int
        Newton iterations.
    """
    forces, trial = start.forces, start.trial
    residual = forces - project(trial, friction)
    reachable = _REACHABLE * float(np.abs(residual).max())
    merit, exactness = float(np.sum(residual**2)), start.roughest
    for iteration in range(NEWTON_LIMIT):
        enough = max(start.goal * max(float(np.abs(forces).max()), start.least), reachable)
        if np.abs(residual).max() <= enough:
            # The last projection puts sliding nodes exactly on the cone and removes all force from open ones.
            return forces - residual, working_set, True, iteration
        direction, change, working_set = _direction(working_set, friction, trial, residual, exactness)
        length, new = _search(forces, trial, friction, merit=merit, direction=direction, change=change)
        if not float(np.sum(new**2)) < merit:
            return forces - residual, working_set, False, iteration + 1
        forces, trial, residual = forces + length * direction, trial + length * change, new
        before, merit = merit, float(np.sum(residual**2))
        # As exact as the last iteration was successful (Eisenstat & Walker 1996), but not more than the goal needs.
        needed = 0.1 * enough / (float(np.abs(residual).max()) or 1.0)
        exactness = min(max(0.9 * merit / before, needed, _FINEST), _ROUGHEST)
    return forces - residual, working_set, False, NEWTON_LIMIT


def _search(
    forces: Array, trial: Array, friction: Array, *, merit: float, direction: Array, change: Array
) -> tuple[float, Array]:
    """Halve the step until the merit decreases enough; return its relative length and the residual at its end."""
    length, new = 1.0, forces
    for _ in range(SEARCH_LIMIT):
        new = forces + length * direction - project(trial + length * change, friction)
        if decreases_enough(float(np.sum(new**2)), merit, length):
            break
        length *= 0.5
    return length, new


def _direction(
    working_set: WorkingSet, friction: Array, trial: Array, residual: Array, exactness: float
) -> tuple[Array, Array, WorkingSet]:
    """Solve (I - G (I - rho W)) d = -residual to a relative `exactness`; return d and the change of the trial force."""
    slopes = _slopes(trial, friction)
    single = slopes.astype(np.float32)
    size = float(np.linalg.norm(residual))
    right = (-residual.ravel() / size).astype(np.float32)
    working_set = working_set.renewed(slopes)
    found, moved, reached = _gmres(working_set, single, right, exactness, working_set.preconditioner(single))
    if not reached:
        factors = factorise_dense(_newton_matrix(single, working_set.scaled()))
        found, moved, _ = _gmres(working_set, single, right, exactness, factors.solve)
    direction = size * found.astype(np.float64).reshape(residual.shape)
    # An open node loses its force exactly.
    is_open = trial[:, 0] <= 0.0
    direction[is_open] = -residual[is_open]
    change = direction - size * moved.astype(np.float64).reshape(residual.shape)
    return direction, change, working_set


def _gmres(
    working_set: WorkingSet, slopes: Single, right: Single, exactness: float, inverse: Callable[[Single], Single]
) -> tuple[Single, Single, bool]:
    """Solve by GMRES, preconditioned from the right so that its residual is the true one; `right` has length one.

    Returns the solution d, rho W d, and whether it is as exact as it should be.
    """
    basis = np.zeros((_KRYLOV_LIMIT + 1, right.size), dtype=np.float32)
    ready, moved = (np.zeros((_KRYLOV_LIMIT, right.size), dtype=np.float32) for _ in range(2))
    # The equations of the shares of the directions, kept triangular by rotations (Saad & Schultz 1986).
    triangle, rotations = np.zeros((_KRYLOV_LIMIT + 1, _KRYLOV_LIMIT)), np.zeros((_KRYLOV_LIMIT, 2))
    target = np.eye(_KRYLOV_LIMIT + 1, 1).ravel()
    basis[0] = right
    used, reached = 0, False
    for used in range(1, _KRYLOV_LIMIT + 1):
        ready[used - 1] = inverse(basis[used - 1])
        moved[used - 1] = working_set.product(ready[used - 1])
        image = _image(slopes, ready[used - 1], moved[used - 1])
        triangle[:used, used - 1] = _orthogonalise(image, basis[:used])
        triangle[used, used - 1] = length = float(np.linalg.norm(image))
        left = _rotate(triangle, rotations, target, used - 1)
        reached = bool(left <= exactness or length <= _NO_NEW_DIRECTION)
        if reached:
            break
        basis[used] = image / np.float32(length)
    weights = np.linalg.lstsq(triangle[:used, :used], target[:used], rcond=None)[0]
    shares = weights.astype(np.float32)
    return shares @ ready[:used], shares @ moved[:used], reached


@numba.njit(cache=True, nogil=True)
def _rotate(triangle, rotations, target, last):  # type: ignore[no-untyped-def]
    """Make the last column of the equations triangular, too, in place; return the norm of their residual."""
    for k in range(last):
        cosine, sine = rotations[k]
        upper, lower = triangle[k, last], triangle[k + 1, last]
        triangle[k, last], triangle[k + 1, last] = cosine * upper + sine * lower, cosine * lower - sine * upper
    length = np.hypot(triangle[last, last], triangle[last + 1, last])
    if length > 0.0:
        rotations[last, 0], rotations[last, 1] = triangle[last, last] / length, triangle[last + 1, last] / length
    else:
        rotations[last, 0], rotations[last, 1] = 1.0, 0.0
    triangle[last, last], triangle[last + 1, last] = length, 0.0
    target[last + 1] = -rotations[last, 1] * target[last]
    target[last] *= rotations[last, 0]
    return abs(target[last + 1])


def _orthogonalise(image: Single, basis: Single) -> Array:
    """Make a vector orthogonal to the rows of `basis`, in place and twice for rounding; return its parts along them."""
    total = np.zeros(len(basis))
    for _ in range(2):
        parts = basis @ image
        image -= (parts @ basis).astype(np.float32)
        total += parts
    return total


@numba.njit(cache=True, nogil=True)
def _image(slopes, vector, moved):  # type: ignore[no-untyped-def]
    """Return (I - G (I - rho W)) v from v and rho W v."""
    count, dim = slopes.shape[:2]
    out = vector.copy()
    for i in range(count):
        for k in range(dim):
            for m in range(dim):
                out[i * dim + k] -= slopes[i, k, m] * (vector[i * dim + m] - moved[i * dim + m])
    return out


@numba.njit(cache=True, nogil=True)
def _slopes(trial, friction):  # type: ignore[no-untyped-def]
    """Return G of every node, the derivative of its projection, shape (k, dim, dim); zero where it is open."""
    count, dim = trial.shape
    slopes = np.zeros((count, dim, dim))
    for i in range(count):
        if trial[i, 0] > 0.0:
            derivative(trial[i], friction[i], slopes[i])
    return slopes


@numba.njit(cache=True, nogil=True)
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
