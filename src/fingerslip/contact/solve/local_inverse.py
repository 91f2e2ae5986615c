"""A local inverse of the Newton matrix of the contact: what makes GMRES need few products with the compliance.

A force moves the body most where it acts. Row by row, the inverse of I - G (I - rho W) is therefore near that of a
small matrix: the part of it among a node and those most strongly coupled to it. A row is made again only where one of
these nodes has changed its state. So the cost follows the nodes that change, where that of factors follows all that
touch.
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
_ROWS_AT_ONCE = 256


@dataclass(frozen=True)
class LocalInverse:
    """Rows of local inverses, one for each of k nodes.

    Parameters
    ----------
    near : (k, m) array of int
        The nodes of each local matrix among the k, itself first; -1 for one that is not among them.
    rows : (k, m, dim, dim) array
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
        return cls(near, np.zeros((*near.shape, shape[2], shape[2]), dtype=np.float32), np.full(shape, np.nan))

    def solve(self, vector: Single) -> Single:
        """Return the product with a vector (k * dim,), same shape."""
        found: Single = _product(self.near, self.rows, vector.reshape(-1, self.rows.shape[-1]))
        return found.ravel()

    def stale(self, marks: Array) -> NDArray[np.bool_]:
        """Return which nodes have changed since their rows were made, shape (k,)."""
        change = np.abs(marks - self.marks).reshape(len(marks), -1).max(axis=1)
        return np.asarray(~(change <= _CHANGE))

    def renewed(
        self, marks: Array, slopes: Array, scale: Array, parts: tuple[Single, Array, Array, float]
    ) -> LocalInverse:
        """Return the inverse with new rows for nodes that have changed, and for those coupled to them.

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
        which = np.flatnonzero((changed[self.near] & (self.near >= 0)).any(axis=1))
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


@numba.njit(cache=True, nogil=True)
def _product(near, rows, vector):  # type: ignore[no-untyped-def]
    count, most, dim = rows.shape[:3]
    out = np.zeros_like(vector)
    for i in range(count):
        for a in range(most):
            j = near[i, a]
            if j >= 0:
                for k in range(dim):
                    for m in range(dim):
                        out[i, k] += rows[i, a, k, m] * vector[j, m]
    return out


@numba.njit(cache=True, nogil=True)
def _make_rows(which, near, slopes, scale, body, frames, penalty, factor, rows):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    dim = slopes.shape[1]
    for i in which:
        rows[i] = 0.0
        columns = _touching(near[i], slopes)
        # An open node's own row is that of the identity.
        if columns.size == 0 or columns[0] != 0:
            for k in range(dim):
                rows[i, 0, k, k] = 1.0
            continue
        found = _first_rows(_local_matrix(near[i][columns], slopes, scale, body, frames, penalty, factor), dim)
        for a in range(columns.size):
            for k in range(dim):
                for m in range(dim):
                    rows[i, columns[a], k, m] = found[a * dim + m, k]


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
def _first_rows(matrix, dim):  # type: ignore[no-untyped-def]
    """Return the first rows of the inverse of a matrix, as columns."""
    right = np.zeros((len(matrix), dim))
    for k in range(dim):
        right[k, k] = 1.0
    try:
        return np.linalg.solve(matrix.T.copy(), right)
    except Exception:  # noqa: BLE001  numba knows no narrower one: a singular matrix leaves the identity
        return right


@numba.njit(cache=True, nogil=True)
def _local_matrix(nodes, slopes, scale, body, frames, penalty, factor):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Return I - G (I - rho W) among a few nodes."""
    dim, size = slopes.shape[1], nodes.size
    matrix, block = np.zeros((size * dim, size * dim)), np.empty((dim, dim))
    for a in range(size):
        for b in range(a + 1):
            _in_frames(nodes[a], nodes[b], body, frames, block)
            for k in range(dim):
                for m in range(dim):
                    matrix[a * dim + k, b * dim + m] = matrix[b * dim + m, a * dim + k] = factor * block[k, m]
        for k in range(dim):
            matrix[a * dim + k, a * dim + k] += penalty[nodes[a], k]
    for a in range(size):
        _project_rows(matrix, a * dim, slopes[nodes[a]], scale[nodes[a]])
    return matrix


@numba.njit(cache=True, nogil=True)
def _in_frames(i, j, body, frames, block):  # type: ignore[no-untyped-def]
    """Write the part of the body's compliance between two nodes, in their frames, into `block` (dim, dim)."""
    dim = len(block)
    block[:, :] = 0.0
    for x in range(dim):
        for y in range(dim):
            row, column = max(i * dim + x, j * dim + y), min(i * dim + x, j * dim + y)
            for k in range(dim):
                share = frames[i, k, x] * body[row, column]
                for m in range(dim):
                    block[k, m] += share * frames[j, m, y]


@numba.njit(cache=True, nogil=True)
def _project_rows(matrix, first, slope, scale):  # type: ignore[no-untyped-def]
    """Turn the rows of a node from those of W to those of I - G (I - rho W), in place."""
    dim = slope.shape[0]
    own = matrix[first : first + dim].copy()
    for k in range(dim):
        matrix[first + k] = 0.0
        for m in range(dim):
            if slope[k, m] != 0.0:
                matrix[first + k] += slope[k, m] * scale[m] * own[m]
                matrix[first + k, first + m] -= slope[k, m]
        matrix[first + k, first + k] += 1.0
