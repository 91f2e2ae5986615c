"""A local inverse of the Newton matrix of the contact: what makes GMRES need few products with the compliance.

A force moves the body most where it acts. Row by row, the inverse of I - G (I - rho W) is therefore near that of a
small matrix: the part of it among a node and those most strongly coupled to it. A row is made again only where one of
the nearest of these nodes has changed its state. So the cost follows the nodes that change, where that of factors
follows all that touch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["LocalInverse", "coupled_nodes"]

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Indices = NDArray[np.int64]

# Nodes of a local matrix, and change of the projection's derivative or of frames from which it is made again [-].
_COUPLED, _CHANGE = 16, 0.3
# The first of these nodes, itself included, whose change counts: others cost more rows than they save iterations.
_COUNTING = 8
_ROWS_AT_ONCE = 256


@dataclass(frozen=True)
class LocalInverse:
    """Rows of local inverses, one for each of k nodes.

    Parameters
    ----------
    near : (k, m) array of int
        The nodes of each local matrix among the k, itself first; -1 for one that is not among them.
    rows : (k, dim, m * dim) array
        Rows of the inverses, in single precision [-].
    marks : (k, j, dim) array
        What the rows were made for; no numbers where they were not made yet.
    """

    near: Indices
    rows: Single
    marks: Array

    @classmethod
    def empty(cls, near: Indices, shape: tuple[int, ...]) -> LocalInverse:
        """Return an inverse of which no row is made, for marks of the given shape."""
        count, dim = shape[0], shape[2]
        return cls(near, np.zeros((count, dim, near.shape[1] * dim), dtype=np.float32), np.full(shape, np.nan))

    def solve(self, vector: Single) -> Single:
        """Return the product with a vector (k * dim,), same shape."""
        found: Single = _product(self.near, self.rows, vector.reshape(-1, self.rows.shape[1]))
        return found.ravel()

    def stale(self, marks: Array) -> NDArray[np.bool_]:
        """Return which nodes have changed since their rows were made, shape (k,)."""
        change = np.abs(marks - self.marks).reshape(len(marks), -1).max(axis=1)
        return np.asarray(~(change <= _CHANGE))

    def renewed(
        self, marks: Array, slopes: Array, scale: Array, parts: tuple[Single, Array, Array, float]
    ) -> LocalInverse:
        """Return the inverse with new rows for nodes that have changed, and for those most coupled to them.

        Parameters
        ----------
        marks : (k, j, dim) array
            What the rows are made for.
        slopes : (k, dim, dim) array
            G, the derivative of the projection [-].
        scale : (k, dim) array
            Step lengths rho of the projection [N/m].
        parts : tuple
            The compliance: lower triangle of the body's in global components, frames, penalties', factor of the body's.
        """
        changed = self.stale(marks)
        if not changed.any():
            return self
        near = self.near[:, :_COUNTING]
        which = np.flatnonzero((changed[near] & (near >= 0)).any(axis=1))
        rows = self.rows.copy()
        _make_rows(which, self.near, slopes, scale, *parts, rows)
        return LocalInverse(self.near, rows, np.where(changed[:, None, None], marks, self.marks))


def coupled_nodes(body: Array, count: int) -> Indices:
    """Return for each of `count` nodes those to which a compliance couples it most, itself first.

    Parameters
    ----------
    body : (count * dim, count * dim) array
        The compliance, of any unit.

    Returns
    -------
    (count, m) array of int
        Indices of nodes.
    """
    dim, most = len(body) // count, min(_COUPLED, count)
    found = np.zeros((count, most), dtype=np.int64)
    for start in range(0, count, _ROWS_AT_ONCE):
        end = min(start + _ROWS_AT_ONCE, count)
        rows = body[start * dim : end * dim].reshape(end - start, dim, count, dim)
        coupling: Array = np.einsum("akbk->ab", rows)
        coupling[np.arange(end - start), np.arange(start, end)] = np.inf
        chosen = np.argpartition(-coupling, most - 1, axis=1)[:, :most]
        order = np.argsort(-np.take_along_axis(coupling, chosen, axis=1), axis=1, kind="stable")
        found[start:end] = np.take_along_axis(chosen, order, axis=1)
    return found


@numba.njit(cache=True, nogil=True, fastmath={"reassoc", "contract"})
def _product(near, rows, vector):  # type: ignore[no-untyped-def]
    count, dim, width = rows.shape
    out, given = np.empty_like(vector), np.empty(width, vector.dtype)
    for i in range(count):
        for a in range(near.shape[1]):
            j = near[i, a]
            for m in range(dim):
                given[a * dim + m] = vector[j, m] if j >= 0 else 0.0
        for k in range(dim):
            total = np.float32(0.0)
            for c in range(width):
                total += rows[i, k, c] * given[c]
            out[i, k] = total
    return out


@numba.njit(cache=True, nogil=True)
def _make_rows(which, near, slopes, scale, body, frames, penalty, factor, rows):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    count, dim = slopes.shape[:2]
    own, left, known = np.empty((count, dim, dim), body.dtype), np.empty((count, dim, dim), body.dtype), np.zeros(count)
    for i in which:
        rows[i] = 0.0
        columns = _touching(near[i], slopes)
        # An open node's own row is that of the identity.
        if columns.size == 0 or columns[0] != 0:
            for k in range(dim):
                rows[i, k, k] = 1.0
            continue
        nodes = near[i][columns]
        for j in nodes:
            if known[j] == 0.0:
                _write_parts(slopes[j], scale[j], frames[j], penalty[j], factor, own[j], left[j])
                known[j] = 1.0
        found = _first_rows(_local_system(nodes, body, own, left), frames[i])
        for a in range(columns.size):
            for k in range(dim):
                for m in range(dim):
                    rows[i, k, columns[a] * dim + m] = found[a * dim + m, k]


@numba.njit(cache=True, nogil=True)
def _touching(near, slopes):  # type: ignore[no-untyped-def]
    """Return at which places of `near` (m,) there are nodes that touch."""
    columns = np.empty(near.size, dtype=np.int64)
    size = 0
    for a in range(near.size):
        if near[a] >= 0 and slopes[near[a], 0, 0] != 0.0:
            columns[size] = a
            size += 1
    return columns[:size]


@numba.njit(cache=True, nogil=True)
def _write_parts(slope, scale, frame, penalty, factor, own, left):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Write D = [I - G (I - rho P)] R^-T and L = G rho f R of a node, all (dim, dim).

    With the body's compliance C in global components, the Newton matrix in the frames R is (D + L C) R^T.
    """
    dim = len(frame)
    inverse = np.linalg.inv(frame)
    for k in range(dim):
        for m in range(dim):
            own[k, m], left[k, m] = inverse[m, k], 0.0
            for x in range(dim):
                own[k, m] -= slope[k, x] * (1.0 - scale[x] * penalty[x]) * inverse[m, x]
                left[k, m] += factor * slope[k, x] * scale[x] * frame[x, m]


@numba.njit(cache=True, nogil=True)
def _local_system(nodes, body, own, left):  # type: ignore[no-untyped-def]
    """Return the transpose of D + L C among a few nodes, with room for right-hand sides behind it."""
    dim, size = own.shape[1], nodes.size
    system = np.zeros((size * dim, (size + 1) * dim), body.dtype)
    for a in range(size):
        for b in range(size):
            i, j = nodes[a], nodes[b]
            for x in range(dim):
                for m in range(dim):
                    # Only the lower triangle of the compliance is there.
                    row, column = i * dim + x, j * dim + m
                    entry = body[row, column] if row >= column else body[column, row]
                    for k in range(dim):
                        system[b * dim + m, a * dim + k] += left[i, k, x] * entry
        for k in range(dim):
            for m in range(dim):
                system[a * dim + m, a * dim + k] += own[nodes[a], k, m]
    return system


@numba.njit(cache=True, nogil=True)
def _first_rows(system, frame):  # type: ignore[no-untyped-def]
    """Return the first rows of the inverse of the Newton matrix as columns, by elimination in place."""
    dim, size = len(frame), len(system)
    for k in range(dim):
        system[k, size + k] = 1.0
    if not _eliminate(system):
        # A singular matrix leaves the identity.
        return np.eye(size, dim).astype(system.dtype)
    for j in range(size - 1, -1, -1):
        for k in range(size, size + dim):
            system[j, k] /= system[j, j]
            for r in range(j):
                system[r, k] -= system[r, j] * system[j, k]
    # The rows were those of (D + L C)^-1; in front of them stands R^-T.
    return np.ascontiguousarray(system[:, size:]) @ np.linalg.inv(frame).astype(system.dtype)


@numba.njit(cache=True, nogil=True)
def _eliminate(system):  # type: ignore[no-untyped-def]
    """Make a matrix upper triangular in place, with right-hand sides behind it; tell whether it is regular."""
    size, width = system.shape
    for j in range(size):
        pivot = _pivot(system, j)
        if system[pivot, j] == 0.0:
            return False
        if pivot != j:
            for c in range(j, width):
                system[j, c], system[pivot, c] = system[pivot, c], system[j, c]
        # Two rows at a time, for which the row of the pivot is read once.
        for r in range(j + 1, size - 1, 2):
            first, second = system[r, j] / system[j, j], system[r + 1, j] / system[j, j]
            for c in range(j + 1, width):
                system[r, c] -= first * system[j, c]
                system[r + 1, c] -= second * system[j, c]
        if (size - j) % 2 == 0:
            last = system[size - 1, j] / system[j, j]
            for c in range(j + 1, width):
                system[size - 1, c] -= last * system[j, c]
    return True


@numba.njit(cache=True, nogil=True)
def _pivot(system, column):  # type: ignore[no-untyped-def]
    """Return the row, at or below the diagonal, with the largest entry of a column."""
    pivot = column
    for r in range(column + 1, len(system)):
        if abs(system[r, column]) > abs(system[pivot, column]):
            pivot = r
    return pivot
