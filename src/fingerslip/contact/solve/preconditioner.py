"""What solves roughly with the Newton matrix of the contact: a coarse space, and local inverses.

*Coarse space.* Groups of nodes that the body couples closely push and slide as one, along each axis of their frames.
What the Newton matrix J does to such forces follows from their products with the compliance, which are made once for a
working set. A coarse solution takes them out of a residual b: y = (Z^T J Z)^-1 Z^T b. The local inverse then serves for
b - J Z y.

*Local inverses.* A force moves the body most where it acts. Row by row, the inverse of I - G (I - rho W) is therefore
near that of a small matrix: the part of it among a node and those most strongly coupled to it. A row is made again only
where one of the nearest of these nodes has changed its state. So the cost follows the nodes that change, where that of
factors follows all that touch.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np

from fingerslip.arrays import Floats, Integers, Reals, Singles

# Nodes of a local matrix, and change of the projection's derivative or of frames from which it is made again [-].
_COUPLED, _CHANGE = 8, 0.3
# The first of these nodes, itself included, whose change counts: others cost more rows than they save iterations.
_COUNTING = 4
_ROWS_AT_ONCE = 256
# Condition from which on a matrix of the coarse space has no inverse.
_SINGULAR = 1e12
# Nodes of a group on average, at least and at most, and groups from which on they grow to these.
_LEAST, _MOST, _GROUPS = 10, 50, 12


@dataclass(frozen=True)
class Coupled:
    """For each of n_c nodes, those to which a compliance couples it most."""

    near: Integers  # (n_c, m), these nodes, itself first
    body: Singles  # (n_c, m * dim, m * dim)

    @classmethod
    def of(cls, body: Reals, count: int) -> Coupled:
        """Find the nodes in the compliance (count * dim, count * dim) of `count` nodes."""
        dim, most = len(body) // max(count, 1), min(_COUPLED, count)
        near = np.zeros((count, most), dtype=np.int64)
        for start in range(0, count, _ROWS_AT_ONCE):
            end = min(start + _ROWS_AT_ONCE, count)
            rows = body[start * dim : end * dim].reshape(end - start, dim, count, dim)
            coupling: Floats = np.einsum("akbk->ab", rows)
            coupling[np.arange(end - start), np.arange(start, end)] = np.inf
            chosen = np.argpartition(-coupling, most - 1, axis=1)[:, :most]
            order = np.argsort(-np.take_along_axis(coupling, chosen, axis=1), axis=1, kind="stable")
            near[start:end] = np.take_along_axis(chosen, order, axis=1)
        return cls(near, _local_parts(body, near, dim))

    def under(self, body: Reals) -> Coupled:
        """Return the same nodes under another compliance, (n_c * dim, n_c * dim)."""
        return Coupled(self.near, _local_parts(body, self.near, len(body) // max(len(self.near), 1)))


def _local_parts(body: Reals, near: Integers, dim: int) -> Singles:
    """Return the parts of a compliance among the nodes `near` (n_c, m), shape (n_c, m * dim, m * dim)."""
    unknowns = (near[:, :, None] * dim + np.arange(dim)).reshape(len(near), -1)
    return np.asarray(body[unknowns[:, :, None], unknowns[:, None, :]], dtype=np.float32)


@dataclass(frozen=True)
class LocalInverse:
    """Rows of local inverses, one for each of k nodes."""

    near: Integers  # (k, m), the nodes of each local matrix among the k, itself first, k where they are none of these
    rows: Singles  # (k, dim, m * dim), rows of the inverses, in single precision [-]
    marks: Floats  # (k, 2 * dim, dim), what the rows were made for, slopes and frames

    @classmethod
    def empty(cls, near: Integers, dim: int) -> LocalInverse:
        """Return an inverse of which no row is made, for nodes with `dim` components."""
        count, width = near.shape
        rows = np.zeros((count, dim, width * dim), dtype=np.float32)
        return cls(near, rows, np.full((count, 2 * dim, dim), np.nan))

    def copy(self) -> LocalInverse:
        """Return an inverse whose rows may be renewed without changing these."""
        return LocalInverse(self.near, self.rows.copy(), self.marks.copy())

    def renew(
        self, slopes: Floats, frames: Floats, weights: tuple[Floats, Floats], coupling: Coupled, nodes: Integers
    ) -> None:
        """Make the rows of nodes that have changed again, and those of the nodes most coupled to them, in place.

        Arrays: slopes, frames (k, dim, dim) [-]; weights of the body's response and of the force itself, (k, dim) each;
        nodes (k,), which of the candidates of the coupling they are.
        """
        wanted = np.concatenate([slopes, frames], axis=1)
        # Where there was nothing, the marks are no numbers, and nothing is the same.
        changed = ~(np.abs(self.marks - wanted) <= _CHANGE).all(axis=(1, 2))
        self.marks[changed] = wanted[changed]
        stale = np.flatnonzero(np.append(changed, False)[self.near[:, :_COUNTING]].any(axis=1))
        _renew_rows(self.rows, stale, self.near, slopes, frames, weights, coupling.body, nodes)


@numba.njit(cache=True, nogil=True)
def _renew_rows(rows, stale, near, slopes, frames, weights, local, nodes):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Make some rows again; the arrays are those of :meth:`LocalInverse.renew`."""
    size, dim = rows.shape[2], slopes.shape[2]
    system, unit = np.empty((size, size), dtype=np.float32), np.eye(size, dtype=np.float32)[:, :dim].copy()
    for i in stale:
        _write_system(system, near[i], slopes, frames, weights, local[nodes[i]])
        solved = unit
        try:
            solved = np.linalg.solve(system, unit)
        except Exception:  # noqa: BLE001  numba knows no narrower one: a matrix without an inverse leaves the identity
            solved = unit
        rows[i] = solved.T


@numba.njit(cache=True, nogil=True)
def _write_system(system, near, slopes, frames, weights, local):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Write the transpose of the Newton matrix among nodes near one.

    Its parts are J_ij = G_i rho_i f R_i C_ij R_j^T + delta_ij [I - G_i (I - rho_i P_i)]. Rows of nodes that are open,
    or not there, are those of the identity, and these nodes do not act on others.
    """
    count, dim, of_body, of_penalty = len(slopes), slopes.shape[1], weights[0], weights[1]
    left, turned = np.empty((dim, dim), dtype=np.float32), np.empty((dim, dim), dtype=np.float32)
    touches = [near[a] < count and slopes[near[a], 0, 0] != 0.0 for a in range(near.size)]
    system[:] = 0.0
    for a in range(near.size):
        i = near[a]
        for k in range(dim):
            system[a * dim + k, a * dim + k] = 1.0
        if not touches[a]:
            continue
        for k in range(dim):
            for m in range(dim):
                system[a * dim + m, a * dim + k] += slopes[i, k, m] * (of_penalty[i, m] - 1.0)
                left[k, m] = 0.0
                for x in range(dim):
                    left[k, m] += slopes[i, k, x] * of_body[i, x] * frames[i, x, m]
        for b in range(near.size):
            if touches[b]:
                _add_response(system, a, b, left, local, frames[near[b]], turned)


@numba.njit(cache=True, nogil=True)
def _add_response(system, a, b, left, local, frame, turned):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Add the transpose of left C_ab R_b^T to a system, with the compliance C among its nodes."""
    dim = len(left)
    for k in range(dim):
        for y in range(dim):
            turned[k, y] = 0.0
            for x in range(dim):
                turned[k, y] += left[k, x] * local[a * dim + x, b * dim + y]
    for m in range(dim):
        for k in range(dim):
            for y in range(dim):
                system[b * dim + m, a * dim + k] += turned[k, y] * frame[m, y]


def groups(body: Reals, nodes: Integers, dim: int) -> Integers:
    """Divide nodes (k,) into groups that a compliance couples closely; return the group of each, shape (k,).

    Each group grows around a node that is coupled little to those before.

    Arrays: body (n_c * dim, n_c * dim), compliance of all candidates, node by node, of any unit.
    """
    best, group = np.full(nodes.size, -np.inf), np.zeros(nodes.size, dtype=np.int64)
    count = min(max(nodes.size // _MOST, _GROUPS), max(nodes.size // _LEAST, 1), nodes.size)
    for number in range(count):
        centre = int(nodes[np.argmin(best)])
        coupling = np.sum([body[centre * dim + k, nodes * dim + k] for k in range(dim)], axis=0)
        closer = coupling > best
        group[closer], best[closer] = number, coupling[closer]
    return group


class Preconditioner(NamedTuple):
    """What solves roughly with J, for the first n nodes."""

    forces: Singles  # (n * dim, q), unit forces Z
    images: Singles  # (n * dim, q), J Z
    inverse: Singles  # (q, q), of Z^T J Z
    near: Integers  # (n, m), the nodes of each local matrix
    rows: Singles  # (n, dim, m * dim), rows of the local inverses

    @classmethod
    def of(cls, slopes: Singles, forces: Singles, moved: Singles, local: LocalInverse) -> Preconditioner:
        """Return the preconditioner for slopes G (n, dim, dim) [-], unit forces Z and rho W Z, (>= n * dim, q)."""
        count, dim = slopes.shape[:2]
        forces, moved = forces[: count * dim], moved[: count * dim]
        images = forces - (slopes @ (forces - moved).reshape(count, dim, -1)).reshape(forces.shape)
        return cls(forces, images, _inverse(forces.T @ images), local.near[:count], local.rows[:count])


@numba.njit(cache=True, nogil=True, fastmath={"reassoc", "contract"})
def solve_roughly(preconditioner, vector, out):  # type: ignore[no-untyped-def]
    """Write what solves J d = b roughly into `out` for a vector b, both (n * dim,)."""
    forces, images, inverse, near, rows = preconditioner
    shares = inverse @ (forces.T @ vector)
    left, common = vector - images @ shares, forces @ shares
    count, dim, width = rows.shape
    gathered = np.empty(width, vector.dtype)
    for i in range(count):
        for a in range(near.shape[1]):
            for m in range(dim):
                gathered[a * dim + m] = left[near[i, a] * dim + m] if near[i, a] < count else 0.0
        for k in range(dim):
            total = np.float32(0.0)
            for c in range(width):
                total += rows[i, k, c] * gathered[c]
            out[i * dim + k] = total + common[i * dim + k]


def _inverse(matrix: Singles) -> Singles:
    """Return the inverse of a matrix (q, q); forces that nothing resists are left out."""
    try:
        inverse = np.linalg.inv(matrix.astype(np.float64))
    except np.linalg.LinAlgError:
        inverse = np.full(matrix.shape, np.inf)
    if not np.abs(inverse).max(initial=0.0) * np.abs(matrix).max(initial=0.0) < _SINGULAR:
        inverse = np.linalg.pinv(matrix.astype(np.float64), rcond=1.0 / _SINGULAR)
    return inverse.astype(np.float32)
