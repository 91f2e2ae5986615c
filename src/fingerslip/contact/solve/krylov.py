"""Newton's method for hundreds of touching nodes: directions by GMRES, and a line search.

The Newton matrix J = I - G (I - rho W) is never made. GMRES (Saad & Schultz 1986) needs products with W and a
preconditioner in two levels (:mod:`fingerslip.contact.solve.preconditioner`). Its directions are of single precision,
and so is what they are taken to do to the trial forces. Where that is no longer exact enough for what is left of the
residual, what all directions since have done is computed again, in double precision: with the compliance among the
nodes, if its entries are of single precision themselves, so that nothing is rounded; otherwise by the caller, with that
of all candidates, who then calls again.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np

from fingerslip.arrays import Floats
from fingerslip.contact.solve.preconditioner import Preconditioner, solve_roughly
from fingerslip.contact.solve.projection import NEWTON_LIMIT, SEARCH_LIMIT, decreases_enough, derivative, project
from fingerslip.contact.solve.working_set import WorkingSet, write_motion

_KRYLOV_LIMIT = 60
# Length of a new direction of GMRES, over that of its image, from which on there is none but rounding.
_NO_NEW_DIRECTION = 1e-6
# Keeps 0/0 away.
_NOTHING = 1e-300
_ROUGHEST, _FINEST = 0.1, 1e-5
# Share of the directions since the last product in double precision, below which the residual is not known.
_KNOWN = 1e-5
# Residual of the last direction over what is wanted: what norms and nonlinearity add.
_SAFETY = 0.3


@dataclass(frozen=True)
class _Iterate:
    """Forces on the way to the solution, all of shape (k, dim) [N]."""

    forces: Floats  # the contact forces
    trial: Floats  # the trial forces z = r - rho y
    residual: Floats  # the forces less the projection of the trial forces
    owed: Floats  # directions since the last product in double precision
    assumed: Floats  # what they are taken to do by single precision

    @property
    def on_cone(self) -> Floats:
        """The forces with sliding nodes exactly on the cone, and no force on open ones."""
        return self.forces - self.residual

    @cached_property
    def merit(self) -> float:
        """Sum of the squared residuals [N^2]."""
        return float(np.vdot(self.residual, self.residual))


def newton_krylov(
    working_set: WorkingSet, friction: Floats, forces: Floats, trial: Floats, *, goal: float, least: float, rough: float
) -> tuple[Floats, bool, int]:
    """Iterate until the residual is small enough, single precision allows no more, or the line search stalls.

    It begins with forces and their trial forces z = r - rho y (k, dim) [N], and with a direction as `rough` [-]; the
    goal counts relative to the largest force, but to the least [N] at least. Returns forces (k, dim) [N], whether they
    solve the problem with friction (k,) [-], and iterations; the rows of the inverse are renewed in place.
    """
    iterate, exactness = _at(friction, forces, trial), rough
    for iteration in range(NEWTON_LIMIT):
        enough = goal * max(_largest(iterate.forces), least)
        # Whether the residual is larger than what single precision leaves open.
        owed = _largest(iterate.owed)
        if owed and not _largest(iterate.residual) > _KNOWN * owed:
            if not working_set.is_exact:
                return iterate.on_cone, True, iteration
            iterate = _in_double_precision(working_set, friction, iterate)
            exactness = _direction_tolerance(enough, iterate)
        if _largest(iterate.residual) <= enough:
            return iterate.on_cone, True, iteration
        after = _step_along(working_set, friction, iterate, exactness)
        if not after.merit < iterate.merit:
            # The line search may have stalled because the residual is not what it seemed.
            if not (working_set.is_exact and iterate.owed.any()):
                return iterate.on_cone, False, iteration + 1
            iterate = _in_double_precision(working_set, friction, iterate)
            continue
        # As exact as the last iteration was successful (Eisenstat & Walker 1996), but not more than the goal needs.
        exactness = min(max(0.9 * after.merit / iterate.merit, _direction_tolerance(enough, after)), _ROUGHEST)
        iterate = after
    return iterate.on_cone, False, NEWTON_LIMIT


def _largest(values: Floats) -> float:
    return float(np.abs(values).max())


def _direction_tolerance(enough: float, iterate: _Iterate) -> float:
    """Return how exact a direction has to be to be the last one, or the last before nothing is known any more."""
    wanted = max(enough, _KNOWN * _largest(iterate.owed)) / (_largest(iterate.residual) or 1.0)
    return min(max(_SAFETY * wanted, _FINEST), _ROUGHEST)


def _at(friction: Floats, forces: Floats, trial: Floats) -> _Iterate:
    """Return an iterate at which nothing is owed."""
    nothing = np.zeros_like(forces)
    return _Iterate(forces, trial, forces - project(trial, friction), nothing, nothing)


def _in_double_precision(working_set: WorkingSet, friction: Floats, iterate: _Iterate) -> _Iterate:
    """Return the iterate with what its directions did in double precision."""
    moved = working_set.motion(iterate.owed)
    return _at(friction, iterate.forces, iterate.trial - (moved - iterate.assumed))


def _step_along(working_set: WorkingSet, friction: Floats, iterate: _Iterate, exactness: float) -> _Iterate:
    """Return the end of a step along a new direction, halved until the merit decreases enough, or too often."""
    direction, moved = _direction(working_set, friction, iterate.trial, iterate.residual, exactness)
    length, after = 1.0, iterate
    for _ in range(SEARCH_LIMIT):
        step, response = length * direction, length * moved
        forces, trial = iterate.forces + step, iterate.trial + (step - response)
        residual = forces - project(trial, friction)
        after = _Iterate(forces, trial, residual, iterate.owed + step, iterate.assumed + response)
        if decreases_enough(after.merit, iterate.merit, length):
            break
        length *= 0.5
    return after


def _direction(
    working_set: WorkingSet, friction: Floats, trial: Floats, residual: Floats, exactness: float
) -> tuple[Floats, Floats]:
    """Solve (I - G (I - rho W)) d = -residual to a relative `exactness`; return d and rho W d, both (k, dim)."""
    slopes, inverse = _slopes(trial, friction), working_set.inverse
    inverse.renew(slopes, working_set.frames, working_set.weights, working_set.coupling, working_set.nodes)
    # All nodes behind the last that touches or loses a force stay as they are.
    acting = np.flatnonzero((trial[:, 0] > 0.0) | residual.any(axis=1))
    count = acting.max(initial=-1) + 1
    derivatives, scaled = slopes[:count].astype(np.float32), working_set.compliance_in(count, np.float32)
    size = float(np.linalg.norm(residual))
    right = (-residual[:count].ravel() / size).astype(np.float32)
    preconditioner = Preconditioner.of(derivatives, *working_set.coarse, inverse)
    shares, ready, moved = _gmres(derivatives, scaled, preconditioner, right, exactness, _KRYLOV_LIMIT)
    direction, response = np.zeros_like(residual), np.zeros_like(residual)
    direction[:count] = size * (shares @ ready).reshape(count, -1)
    response[:count] = size * (shares @ moved).reshape(count, -1)
    # An open node loses its force exactly.
    is_open = trial[:, 0] <= 0.0
    direction[is_open] = -residual[is_open]
    return direction, response


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
def _gmres(slopes, scaled, preconditioner, right, exactness, limit):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Solve J d = b, preconditioned from the right so that the residual of GMRES is the true one.

    Return the shares (q,) that d has of q directions, these and rho W times them, (q, n * dim) each. Where the residual
    is not as small as wanted with the most directions, the search along the line has to do.

    Arrays: slopes (n, dim, dim), G [-]; right (n * dim,), b, of length one; exactness, residual to reach [-].
    """
    size, used, left, length = right.size, 0, np.inf, 1.0
    basis = np.empty((limit + 1, size), dtype=np.float32)
    ready, moved = np.empty((limit, size), dtype=np.float32), np.empty((limit, size), dtype=np.float32)
    triangle, rotations, target, image = np.zeros((limit, limit + 1)), np.empty((limit, 2)), np.zeros(limit + 1), right
    target[0] = 1.0
    while used < limit and left > exactness and length > _NO_NEW_DIRECTION:
        basis[used] = image / np.float32(length)
        solve_roughly(preconditioner, basis[used], ready[used])
        write_motion(scaled, ready[used], moved[used])
        image = _image(slopes, ready[used], moved[used])
        directions, column = basis[: used + 1], triangle[used]
        # The second time removes what rounding left.
        for _ in range(2):
            overlaps = directions @ image
            image -= overlaps @ directions
            column[: used + 1] += overlaps
        length = column[used + 1] = float(np.linalg.norm(image))
        # Givens' rotations make a triangle of the columns, and tell what is left without a solution.
        for k in range(used):
            _rotate(rotations[k], column[k : k + 2])
        rotations[used] = column[used : used + 2] / max(np.hypot(column[used], length), _NOTHING)
        for pair in (column[used : used + 2], target[used : used + 2]):
            _rotate(rotations[used], pair)
        used += 1
        left = np.abs(target[used])
    shares = np.linalg.lstsq(triangle[:used, :used].T.copy(), target[:used])[0]
    return shares, ready[:used], moved[:used]


@numba.njit(cache=True, nogil=True)
def _rotate(rotation, pair):  # type: ignore[no-untyped-def]
    """Rotate a pair of numbers in place by a cosine and a sine."""
    first, second = pair
    pair[0] = rotation[0] * first + rotation[1] * second
    pair[1] = rotation[0] * second - rotation[1] * first


@numba.njit(cache=True, nogil=True)
def _image(slopes, vector, moved):  # type: ignore[no-untyped-def]
    """Return J v from v and rho W v, all (n * dim,)."""
    image, (count, dim) = vector.copy(), slopes.shape[:2]
    for i in range(count):
        for k in range(dim):
            for m in range(dim):
                image[i * dim + k] -= slopes[i, k, m] * (vector[i * dim + m] - moved[i * dim + m])
    return image
