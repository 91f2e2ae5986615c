"""The equations of a Newton direction of the contact, solved by GMRES in compiled code.

The Newton matrix J = I - G (I - rho W) is never made. GMRES needs products with W, in single precision, and a
preconditioner in two levels (:mod:`fingerslip.contact.solve.preconditioner`): groups of nodes that bear forces as one,
and for what these leave small matrices of nodes near each other.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.solve.preconditioner import (
    CoarseSpace,
    LocalInverse,
    coarse_inverse,
    images_of,
    write_local_product,
)
from fingerslip.contact.solve.working_set import WorkingSet
from fingerslip.linear.symmetric import write_symmetric_product

__all__ = ["Preconditioner", "ScaledCompliance", "Space", "new_space", "solve", "write_motion"]

Reals = NDArray[np.floating[Any]]
Single = NDArray[np.float32]

# Length of a new direction, over that of its image, from which on there is none but rounding.
_NO_NEW_DIRECTION = 1e-6


class ScaledCompliance(NamedTuple):
    """rho W of k nodes, in single or in double precision."""

    body: Single  # (m * dim, m * dim), the body's compliance in global components, of any unit
    frames: Reals  # (k, dim, dim), frames of the nodes [-]
    of_body: Reals  # (k, dim), the weights of the body's response
    of_penalty: Reals  # (k, dim), the weights of the force itself

    @classmethod
    def of(cls, working_set: WorkingSet, precision: type[np.floating[Any]]) -> ScaledCompliance:
        """Return that of a working set, with frames and weights in some precision."""
        scale = working_set.scale
        arrays = working_set.frames, scale * working_set.factor, scale * working_set.penalty
        return cls(working_set.body, *(part.astype(precision) for part in arrays))

    def of_first(self, count: int) -> ScaledCompliance:
        """Return that of the first nodes."""
        arrays = self.frames, self.of_body, self.of_penalty
        return ScaledCompliance(self.body, *(part[:count] for part in arrays))


class Preconditioner(NamedTuple):
    """What solves roughly with J."""

    columns: NDArray[Any]  # (k * dim,), which of q unit forces Z each component belongs to
    images: Single  # (k * dim, q), J Z
    inverse: Single  # (q, q), of Z^T J Z
    near: NDArray[Any]  # (k, m), the nodes of each local matrix
    rows: Single  # (k, dim, m * dim), rows of the local inverses

    @classmethod
    def of(cls, slopes: Single, coarse: CoarseSpace, local: LocalInverse) -> Preconditioner:
        """Return the preconditioner for slopes of the first of the nodes that a coarse space and an inverse have."""
        images = images_of(slopes, coarse.columns, coarse.moved)
        near, rows = local.near[: len(slopes)], local.rows[: len(slopes)]
        return cls(coarse.columns, images, coarse_inverse(coarse.columns, images), near, rows)


class Space(NamedTuple):
    """Memory of GMRES: orthonormal directions, what is left of them by the preconditioner, and rho W times that."""

    basis: Single
    ready: Single
    moved: Single


def new_space(size: int, limit: int) -> Space:
    """Return memory for `size` unknowns and `limit` directions."""
    basis = np.empty((limit + 1, size), dtype=np.float32)
    return Space(basis, *(np.empty((limit, size), dtype=np.float32) for _ in range(2)))


@numba.njit(cache=True, nogil=True)
def solve(slopes, scaled, preconditioner, right, exactness, space):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Solve J d = b, preconditioned from the right so that the residual of GMRES is the true one.

    Return d, rho W d, and whether d is as exact as the relative residual `exactness` [-] asks for. `space` has memory
    for as many directions as there may be.

    Arrays: slopes (k, dim, dim), G [-]; right (k * dim,), b, of length one.
    """
    size, limit = right.size, len(space.ready)
    # The equations of the shares of the directions, kept triangular by rotations (Saad & Schultz 1986).
    triangle, rotations, target = np.zeros((limit + 1, limit)), np.zeros((limit, 2)), np.zeros(limit + 1)
    target[0] = 1.0
    for i in range(size):
        space.basis[0, i] = right[i]
    used, reached, ended = 0, False, False
    while used < limit and not ended:
        ready, moved = space.ready[used, :size], space.moved[used, :size]
        _precondition(preconditioner, space.basis[used, :size], ready)
        write_motion(scaled, ready, moved)
        image = space.basis[used + 1, :size]
        _write_image(slopes, ready, moved, image)
        length = _orthogonalise(space.basis, used + 1, image, triangle[:, used])
        left = _rotate(triangle, rotations, target, used)
        used += 1
        reached = left <= exactness
        ended = reached or length <= _NO_NEW_DIRECTION
        if not ended:
            _scale(image, length)
    shares = _back_substitute(triangle, target, used)
    return _combine(space.ready, shares, size), _combine(space.moved, shares, size), reached


@numba.njit(cache=True, nogil=True, fastmath={"reassoc", "contract"})
def write_motion(scaled, forces, moved):  # type: ignore[no-untyped-def]
    """Write rho W, a :class:`ScaledCompliance`, times forces (k * dim,) into `moved`; in the precision of both."""
    frames = scaled.frames
    count, dim = frames.shape[:2]
    turned, response = np.empty_like(forces), np.empty_like(forces)
    for i in range(count):
        for m in range(dim):
            total = forces.dtype.type(0)
            for n in range(dim):
                total += frames[i, n, m] * forces[i * dim + n]
            turned[i * dim + m] = total
    write_symmetric_product(scaled.body, turned, response)
    for i in range(count):
        for m in range(dim):
            total = forces.dtype.type(0)
            for n in range(dim):
                total += frames[i, m, n] * response[i * dim + n]
            moved[i * dim + m] = scaled.of_body[i, m] * total + scaled.of_penalty[i, m] * forces[i * dim + m]


@numba.njit(cache=True, nogil=True, fastmath={"reassoc", "contract"})
def _precondition(preconditioner, vector, out):  # type: ignore[no-untyped-def]
    """Write what solves J d = b roughly into `found` for b `given`, both (k * dim,)."""
    columns, images = preconditioner.columns, preconditioner.images
    count = preconditioner.inverse.shape[0]
    sums, shares, left = np.zeros(count, np.float32), np.zeros(count, np.float32), np.empty_like(vector)
    for i in range(vector.size):
        sums[columns[i]] += vector[i]
    for a in range(count):
        for b in range(count):
            shares[a] += preconditioner.inverse[a, b] * sums[b]
    for i in range(vector.size):
        total = np.float32(0)
        for b in range(count):
            total += images[i, b] * shares[b]
        left[i] = vector[i] - total
    write_local_product(preconditioner.near, preconditioner.rows, left, out)
    for i in range(vector.size):
        out[i] += shares[columns[i]]


@numba.njit(cache=True, nogil=True)
def _write_image(slopes, vector, moved, image):  # type: ignore[no-untyped-def]
    """Write J v into `image`, from v and rho W v, all (k * dim,)."""
    count, dim = slopes.shape[:2]
    for i in range(count):
        for k in range(dim):
            total = vector[i * dim + k]
            for m in range(dim):
                total -= slopes[i, k, m] * (vector[i * dim + m] - moved[i * dim + m])
            image[i * dim + k] = total


@numba.njit(cache=True, nogil=True, fastmath={"reassoc", "contract"})
def _orthogonalise(basis, count, image, shares):  # type: ignore[no-untyped-def]
    """Make a vector orthogonal to the first `count` rows, twice for rounding; write its parts, return what is left."""
    for _ in range(2):
        for j in range(count):
            direction, part = basis[j], np.float32(0)
            for i in range(image.size):
                part += direction[i] * image[i]
            for i in range(image.size):
                image[i] -= part * direction[i]
            shares[j] += part
    length = np.float32(0)
    for i in range(image.size):
        length += image[i] * image[i]
    shares[count] = np.sqrt(length)
    return shares[count]


@numba.njit(cache=True, nogil=True)
def _scale(vector, length):  # type: ignore[no-untyped-def]
    factor = np.float32(1.0 / length)
    for i in range(vector.size):
        vector[i] *= factor


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
        # A direction without an image takes nothing from the residual.
        rotations[last, 0], rotations[last, 1] = 0.0, 1.0
    triangle[last, last], triangle[last + 1, last] = length, 0.0
    target[last + 1] = -rotations[last, 1] * target[last]
    target[last] *= rotations[last, 0]
    return abs(target[last + 1])


@numba.njit(cache=True, nogil=True)
def _back_substitute(triangle, target, count):  # type: ignore[no-untyped-def]
    """Return the shares of `count` directions; those that have no image get none."""
    shares = np.zeros(count)
    for i in range(count - 1, -1, -1):
        total = target[i]
        for j in range(i + 1, count):
            total -= triangle[i, j] * shares[j]
        shares[i] = total / triangle[i, i] if triangle[i, i] > 0.0 else 0.0
    return shares


@numba.njit(cache=True, nogil=True)
def _combine(vectors, shares, size):  # type: ignore[no-untyped-def]
    """Return the sum of the first vectors with their shares, shape (size,), in double precision."""
    total = np.zeros(size)
    for j in range(shares.size):
        share, vector = shares[j], vectors[j]
        for i in range(size):
            total[i] += share * vector[i]
    return total
