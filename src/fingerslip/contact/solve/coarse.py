"""A coarse space of the contact: what local inverses miss, the response to forces on whole groups of nodes.

Groups of nodes that the body couples closely push and slide as one, along each axis of their frames. What the Newton
matrix J does to such forces follows from their products with the compliance, which are made once for a working set. A
coarse solution takes them out of a residual b: y = (Z^T J Z)^-1 Z^T b. The local inverse then serves for b - J Z y.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["CoarseSpace", "coarse_inverse", "group_columns", "groups", "images_of", "unit_forces"]

Reals = NDArray[np.floating[Any]]
Single = NDArray[np.float32]
Indices = NDArray[np.int64]

# Nodes of a group on average, at least and at most, and groups from which on they grow to these.
_LEAST, _MOST, _GROUPS = 10, 50, 12


@dataclass(frozen=True)
class CoarseSpace:
    """Forces on groups of k nodes, and what the compliance does to them."""

    columns: Indices  # (k * dim,)
    moved: Single  # (k * dim, q), rho W Z, in single precision


def groups(body: Reals, nodes: Indices, dim: int) -> Indices:
    """Divide nodes (k,) into groups that a compliance couples closely; return the group of each, shape (k,).

    Each group grows around a node that is coupled little to those before.

    Parameters
    ----------
    body : (n_c * dim, n_c * dim) array
        Compliance of all candidates, node by node, of any unit.
    nodes : (k,) array of int
        The nodes.
    dim : int
        Components of a node.
    """
    best, group = np.full(nodes.size, -np.inf), np.zeros(nodes.size, dtype=np.int64)
    for number in range(_group_count(nodes.size)):
        centre = int(nodes[np.argmin(best)])
        coupling = np.sum([body[centre * dim + k, nodes * dim + k] for k in range(dim)], axis=0)
        closer = coupling > best
        group[closer], best[closer] = number, coupling[closer]
    return group


def _group_count(nodes: int) -> int:
    """Return how many groups a number of nodes is divided into."""
    return min(max(nodes // _MOST, _GROUPS), max(nodes // _LEAST, 1), nodes)


def group_columns(group: Indices, dim: int) -> Indices:
    """Return which unit force each component of the nodes of groups (k,) belongs to, shape (k * dim,)."""
    columns: Indices = (group[:, None] * dim + np.arange(dim)).ravel()
    return columns


def unit_forces(columns: Indices) -> Single:
    """Return the q unit forces to which components belong, (n,) array of int, as a matrix of shape (n, q)."""
    forces = np.zeros((columns.size, int(columns.max(initial=-1)) + 1), dtype=np.float32)
    forces[np.arange(columns.size), columns] = 1.0
    return forces


@numba.njit(cache=True, nogil=True)
def images_of(slopes, columns, moved):  # type: ignore[no-untyped-def]
    """Return J Z = (I - G (I - rho W)) Z of k nodes, shape (k * dim, q).

    Arrays: slopes (k, dim, dim) [-]; columns, moved (n,).
    """
    count, dim = slopes.shape[:2]
    out = np.zeros((count * dim, moved.shape[1]), moved.dtype)
    for i in range(count):
        for k in range(dim):
            row = out[i * dim + k]
            row[columns[i * dim + k]] = 1.0
            for m in range(dim):
                slope = slopes[i, k, m]
                if slope != 0.0:
                    other = moved[i * dim + m]
                    for c in range(row.size):
                        row[c] += slope * other[c]
                    row[columns[i * dim + m]] -= slope
    return out


@numba.njit(cache=True, nogil=True)
def coarse_inverse(columns, images):  # type: ignore[no-untyped-def]
    """Return the inverse of Z^T J Z, (q, q), for images J Z (n, q); forces that nothing resists are left out."""
    size = images.shape[1]
    # The matrix with the identity behind it, which becomes the inverse.
    both = np.zeros((size, 2 * size))
    for i in range(len(images)):
        for c in range(size):
            both[columns[i], c] += images[i, c]
    largest = 0.0
    for a in range(size):
        both[a, size + a] = 1.0
        for c in range(size):
            largest = max(largest, abs(both[a, c]))
    for column in range(size):
        _clear(both, column, 1e-12 * largest)
    inverse = np.empty((size, size), images.dtype)
    for a in range(size):
        for c in range(size):
            inverse[a, c] = both[a, size + c]
    return inverse


@numba.njit(cache=True, nogil=True)
def _clear(both, column, least):  # type: ignore[no-untyped-def]
    """Make a column that of the identity, in place (Gauss and Jordan); without a pivot its row becomes zero."""
    size, width = both.shape
    pivot = column
    for row in range(column + 1, size):
        if abs(both[row, column]) > abs(both[pivot, column]):
            pivot = row
    scale = 1.0 / both[pivot, column] if abs(both[pivot, column]) > least else 0.0
    for c in range(width):
        # Without a pivot nothing is swapped.
        other = both[pivot, c] if scale != 0.0 else 0.0
        both[pivot, c] = both[column, c] if scale != 0.0 else both[pivot, c]
        both[column, c] = scale * other
    for row in range(size):
        share = both[row, column]
        if row != column and share != 0.0:
            for c in range(column, width):
                both[row, c] -= share * both[column, c]
