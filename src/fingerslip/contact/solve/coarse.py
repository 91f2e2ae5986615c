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

__all__ = ["CoarseInverse", "CoarseSpace", "groups", "unit_forces"]

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
    forces, moved : (k * dim, q) array
        Z, and rho W Z, in single precision.
    """

    forces: Single
    moved: Single

    def inverse(self, slopes: Single) -> CoarseInverse:
        """Return the coarse inverse for the derivative G of the projection, (k, dim, dim) [-]."""
        images = _images(slopes, self.forces, self.moved)
        return CoarseInverse(self.forces, images, _inverse((self.forces.T @ images).astype(np.float64)))


@dataclass(frozen=True)
class CoarseInverse:
    """A coarse space with the inverse of the Newton matrix on it.

    Parameters
    ----------
    forces, images : (k * dim, q) array
        Z and J Z.
    inverse : (q, q) array
        Of Z^T J Z.
    """

    forces: Single
    images: Single
    inverse: Array

    def split(self, vector: Single) -> tuple[Single, Single]:
        """Return the coarse solution for a residual (k * dim,), and what is left of the residual."""
        shares = (self.inverse @ (vector @ self.forces)).astype(np.float32)
        return self.forces @ shares, vector - self.images @ shares


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


def unit_forces(group: Indices, dim: int) -> Single:
    """Return unit forces on all nodes of a group along an axis of their frames, for groups (k,); shape (k * dim, q)."""
    columns = (group[:, None] * dim + np.arange(dim)).ravel()
    forces = np.zeros((columns.size, dim * (int(group.max(initial=-1)) + 1)), dtype=np.float32)
    forces[np.arange(columns.size), columns] = 1.0
    return forces


@numba.njit(cache=True, nogil=True)
def _images(slopes, forces, moved):  # type: ignore[no-untyped-def]
    """Return (I - G (I - rho W)) Z from Z and rho W Z."""
    count, dim = slopes.shape[:2]
    out = forces.copy()
    for i in range(count):
        for k in range(dim):
            row = out[i * dim + k]
            for m in range(dim):
                if slopes[i, k, m] != 0.0:
                    row -= slopes[i, k, m] * (forces[i * dim + m] - moved[i * dim + m])
    return out
