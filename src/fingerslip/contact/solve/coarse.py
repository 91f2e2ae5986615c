"""A coarse space of the contact: what local inverses miss, the response to forces on whole groups of nodes.

Groups of nodes that the body couples closely push and slide as one, along each axis of their frames. What the Newton
matrix J does to such forces follows from their products with the compliance, which are made once for a working set. A
coarse solution takes them out of a residual b: y = (Z^T J Z)^-1 Z^T b. The local inverse then serves for b - J Z y.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

__all__ = ["CoarseInverse", "CoarseSpace", "group_columns", "groups", "unit_forces"]

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Indices = NDArray[np.int64]

# Groups at most, and nodes of a group on average at least.
_GROUPS, _LEAST = 20, 10


@dataclass(frozen=True)
class CoarseSpace:
    """Forces on groups of k nodes, and what the compliance does to them.

    Parameters
    ----------
    columns : (k * dim,) array of int
        For each component of each node, which of the q unit forces Z it belongs to: one for each group and axis.
    moved : (k * dim, q) array
        rho W Z, in single precision.
    """

    columns: Indices
    moved: Single

    def inverse(self, slopes: Single) -> CoarseInverse:
        """Return the coarse inverse for the derivative G of the projection, (k, dim, dim) [-]."""
        images = _images(slopes, self.columns, self.moved)
        return CoarseInverse(self.columns, images, _inverse(_sums(self.columns, images).astype(np.float64)))


@dataclass(frozen=True)
class CoarseInverse:
    """A coarse space with the inverse of the Newton matrix on it.

    Parameters
    ----------
    columns : (k * dim,) array of int
        Which unit force each component belongs to.
    images : (k * dim, q) array
        J Z.
    inverse : (q, q) array
        Of Z^T J Z.
    """

    columns: Indices
    images: Single
    inverse: Array

    def split(self, vector: Single) -> tuple[Single, Single]:
        """Return the coarse solution for a residual (k * dim,), and what is left of the residual."""
        sums = np.bincount(self.columns, weights=vector, minlength=len(self.inverse))
        shares = (self.inverse @ sums).astype(np.float32)
        return shares[self.columns], vector - self.images @ shares


def _inverse(matrix: Array) -> Array:
    """Return the inverse of a matrix (q, q); where there is none, as for groups that nothing resists, the nearest."""
    try:
        found = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    except np.linalg.LinAlgError:
        found = np.asarray(np.linalg.pinv(matrix), dtype=np.float64)
    return found


def groups(body: Array, nodes: Indices, dim: int) -> Indices:
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
    for number in range(min(_GROUPS, max(1, nodes.size // _LEAST)) if nodes.size else 0):
        centre = int(nodes[np.argmin(best)])
        coupling = np.sum([body[centre * dim + k, nodes * dim + k] for k in range(dim)], axis=0)
        closer = coupling > best
        group[closer], best[closer] = number, coupling[closer]
    return group


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
def _images(slopes, columns, moved):  # type: ignore[no-untyped-def]
    """Return (I - G (I - rho W)) Z from rho W Z."""
    count, dim = slopes.shape[:2]
    out = np.zeros_like(moved)
    for i in range(count):
        for k in range(dim):
            row = out[i * dim + k]
            row[columns[i * dim + k]] = 1.0
            for m in range(dim):
                slope = slopes[i, k, m]
                if slope != 0.0:
                    row += slope * moved[i * dim + m]
                    row[columns[i * dim + m]] -= slope
    return out


@numba.njit(cache=True, nogil=True)
def _sums(columns, images):  # type: ignore[no-untyped-def]
    """Return Z^T times vectors (n, q), shape (q, q)."""
    out = np.zeros((images.shape[1], images.shape[1]), images.dtype)
    for i in range(columns.size):
        out[columns[i]] += images[i]
    return out
