"""Newton's method for hundreds of touching nodes: directions by GMRES with a factor that serves many steps.

The Newton matrix I - G (I - rho W) of :mod:`fingerslip.contact.solve.newton` changes little from one iteration, and
from one time step, to the next: a few nodes begin to touch or to slip. Its factor is therefore kept as a
preconditioner, in single precision, until the iterations that it costs more have cost as much as a new one.

What is solved here is rough by the rounding of single precision: what the directions do to the slip is known from
GMRES without another product. The caller computes the residual of the forces that come out in double precision,
over all candidates, and comes back with it where that is not small enough yet.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.solve.dense import DenseFactor, factorise_dense
from fingerslip.contact.solve.projection import derivative, project

__all__ = ["Factor", "Start", "WorkSet", "newton_krylov"]

Array = NDArray[np.float64]
Single = NDArray[np.float32]

_NEWTON_LIMIT = 60
_SEARCH_LIMIT = 12
_SUFFICIENT = 1e-4
_KRYLOV_LIMIT = 60
# Iterations of one solution with a fresh factor, and the unknowns per iteration that a factorisation costs.
_FRESH, _UNKNOWNS_PER_ITERATION = 3, 50
_ROUGHEST, _FINEST = 0.1, 1e-5
# What single precision leaves of the residual with which a call begins.
_REACHABLE = 1e-6


@dataclass(frozen=True)
class Factor:
    """Factors of an earlier Newton matrix, perhaps of other nodes.

    Parameters
    ----------
    dense : DenseFactor
        Its LU factors.
    nodes : (j,) array
        The nodes that it was made for.
    kept : (j * dim,) array of bool
        Which of its unknowns are in the present work set.
    places : array
        Where these are there.
    """

    dense: DenseFactor
    nodes: NDArray[np.int64]
    kept: NDArray[np.bool_]
    places: NDArray[np.int64]

    def solve(self, vector: Single) -> Single:
        """Return the factored inverse times a vector; unknowns that are not among the factor's own stay."""
        given = np.zeros(self.kept.size, dtype=np.float32)
        given[self.kept] = vector[self.places]
        found = self.dense.solve(given)
        out = vector.copy()
        out[self.places] = found[self.kept]
        return out

    def moved_to(self, nodes: NDArray[np.int64], dim: int) -> Factor:
        """Return the same factor for another work set of ascending `nodes` (k,)."""
        place = np.minimum(np.searchsorted(nodes, self.nodes), nodes.size - 1)
        kept = nodes[place] == self.nodes
        places = (place[kept][:, None] * dim + np.arange(dim)).ravel()
        return replace(self, kept=np.repeat(kept, dim), places=places)


@dataclass(frozen=True)
class WorkSet:
    """The nodes that take part in Newton's method, with what is kept of them from step to step.

    Parameters
    ----------
    nodes : (k,) array
        The nodes, ascending.
    scale : (k, dim) array
        Step lengths rho [N/m].
    scaled : (k * dim, k * dim) array
        rho W among them in single precision [-].
    factor : Factor, optional
        Of an earlier Newton matrix.
    lost : int
        Iterations that a fresh factor would have saved.
    before : (n_c, dim) array, optional
        Forces of all nodes one step before the last [N].
    """

    nodes: NDArray[np.int64]
    scale: Array
    scaled: Single
    factor: Factor | None = None
    lost: int = 0
    before: Array | None = None


@dataclass(frozen=True)
class Start:
    """Where Newton's method begins, and where it is to end.

    Parameters
    ----------
    forces : (k, dim) array
        [N].
    trial : (k, dim) array
        z = r - rho y of these forces [N].
    goal : float
        Residual at which to stop, relative to the largest force [-].
    least : float
        What counts as the largest force at least [N].
    roughest : float
        Relative residual of the first direction [-].
    """

    forces: Array
    trial: Array
    goal: float
    least: float = 0.0
    roughest: float = _ROUGHEST


def newton_krylov(work: WorkSet, friction: Array, start: Start) -> tuple[Array, WorkSet, bool, int]:
    """Iterate until the residual is small enough, or as small as single precision makes it, or the search stalls.

    Parameters
    ----------
    work : WorkSet
        The nodes.
    friction : (k,) array
        Friction coefficients [-].
    start : Start
        Where to begin.

    Returns
    -------
    forces : (k, dim) array
        [N].
    work : WorkSet
        The nodes, with the newest factor.
    solved : bool
        Whether the residual became small enough; it is that of single precision.
    iterations : int
        Newton iterations.
    """
    forces, trial = start.forces, start.trial
    residual = forces - project(trial, friction)
    reachable = _REACHABLE * float(np.abs(residual).max())
    merit, exactness = float(np.sum(residual**2)), start.roughest
    for iteration in range(_NEWTON_LIMIT):
        enough = max(start.goal * max(float(np.abs(forces).max()), start.least), reachable)
        if np.abs(residual).max() <= enough:
            # The last projection puts sliding nodes on the cone exactly, and leaves open ones without any force.
            return forces - residual, work, True, iteration
        direction, change, work = _direction(work, friction, trial, residual, exactness)
        length, new = 1.0, residual
        for _ in range(_SEARCH_LIMIT):
            new = forces + length * direction - project(trial + length * change, friction)
            if float(np.sum(new**2)) <= (1.0 - 2.0 * _SUFFICIENT * length) * merit:
                break
            length *= 0.5
        if not float(np.sum(new**2)) < merit:
            return forces - residual, work, False, iteration + 1
        forces, trial, residual = forces + length * direction, trial + length * change, new
        before, merit = merit, float(np.sum(residual**2))
        # As exact as the last iteration was successful (Eisenstat & Walker 1996), but not more than the goal needs.
        needed = 0.1 * enough / (float(np.abs(residual).max()) or 1.0)
        exactness = min(max(0.9 * merit / before, needed, _FINEST), _ROUGHEST)
    return forces - residual, work, False, _NEWTON_LIMIT


def _direction(
    work: WorkSet, friction: Array, trial: Array, residual: Array, exactness: float
) -> tuple[Array, Array, WorkSet]:
    """Solve (I - G (I - rho W)) d = -residual to a relative `exactness`; return also what d does to the trial force."""
    slopes = _slopes(trial, friction).astype(np.float32)
    size = float(np.linalg.norm(residual))
    right = (-residual.ravel() / size).astype(np.float32)
    if work.factor is None or work.lost * _UNKNOWNS_PER_ITERATION > right.size:
        work = _factorised(work, slopes)
    found, moved, used = _gmres(work, slopes, right, exactness)
    if used == _KRYLOV_LIMIT and work.lost:
        work = _factorised(work, slopes)
        found, moved, used = _gmres(work, slopes, right, exactness)
    direction = size * found.astype(np.float64).reshape(residual.shape)
    # What is open loses its force to the last digit.
    is_open = trial[:, 0] <= 0.0
    direction[is_open] = -residual[is_open]
    change = direction - size * moved.astype(np.float64).reshape(residual.shape)
    return direction, change, replace(work, lost=work.lost + max(used - _FRESH, 0))


def _factorised(work: WorkSet, slopes: Single) -> WorkSet:
    dense = factorise_dense(_newton_matrix(slopes, work.scaled))
    size = len(work.scaled)
    factor = Factor(dense, work.nodes, np.ones(size, dtype=bool), np.arange(size))
    return replace(work, factor=factor, lost=0)


def _gmres(work: WorkSet, slopes: Single, right: Single, exactness: float) -> tuple[Single, Single, int]:
    """Solve by GMRES, preconditioned from the right so that its residual is the true one; `right` has length one.

    Returns the solution d, rho W d, and the number of iterations.
    """
    assert work.factor is not None
    basis = np.zeros((_KRYLOV_LIMIT + 1, right.size), dtype=np.float32)
    ready, moved = (np.zeros((_KRYLOV_LIMIT, right.size), dtype=np.float32) for _ in range(2))
    columns = np.zeros((_KRYLOV_LIMIT + 1, _KRYLOV_LIMIT))
    target = np.eye(_KRYLOV_LIMIT + 1, 1).ravel()
    basis[0] = right
    weights: Array = np.zeros(0)
    used = 0
    for used in range(1, _KRYLOV_LIMIT + 1):
        ready[used - 1] = work.factor.solve(basis[used - 1])
        moved[used - 1] = work.scaled @ ready[used - 1]
        image = _image(slopes, ready[used - 1], moved[used - 1])
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
    shares = weights.astype(np.float32)
    return shares @ ready[:used], shares @ moved[:used], used


def _image(slopes: Single, vector: Single, moved: Single) -> Single:
    """Return (I - G (I - rho W)) v from v and rho W v."""
    inner = (vector - moved).reshape(slopes.shape[:2])
    outer: Single = vector - np.einsum("aij,aj->ai", slopes, inner).ravel()
    return outer


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
