"""The compliance that couples the contact nodes, and the parts of it that a step needs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.frames import rotate_compliance

__all__ = ["Compliance", "active_product"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Compliance:
    """W of :mod:`fingerslip.contact.solve.newton`: the body's compliance, with that of the penalties on its diagonal.

    Parameters
    ----------
    body : (n_c * dim, n_c * dim) array
        Compliance of the body, symmetric, node by node [m/N].
    penalty : (n_c, dim) array
        Compliance of the contact penalties in the nodes' frames [m/N].
    frames : (n_c, dim, dim) array, optional
        Frames of the nodes [-] where `body` is in global components; without them `body` is in the frames already.
    """

    body: Array
    penalty: Array
    frames: Array | None = None

    def in_frames(self, frames: Array) -> Compliance:
        """Return the same compliance [m/N] with `body` in constant frames (n_c, dim, dim) [-]."""
        return Compliance(rotate_compliance(self.body, frames), self.penalty)

    @cached_property
    def diagonal(self) -> Array:
        """Diagonal of W in the nodes' frames, shape (n_c, dim) [m/N]."""
        count, dim = self.penalty.shape
        nodes = np.arange(count)
        blocks = self.body.reshape(count, dim, count, dim)[nodes, :, nodes, :]
        if self.frames is not None:
            rotated: Array = np.einsum("aij,ajk,aik->ai", self.frames, blocks, self.frames) + self.penalty
            return rotated
        diagonal: Array = np.diagonal(blocks, axis1=1, axis2=2) + self.penalty
        return diagonal

    @cached_property
    def matrix(self) -> Array:
        """W itself, shape (n_c * dim, n_c * dim) [m/N]; meant for few nodes."""
        return self.block(np.arange(len(self.penalty)))

    def block(self, nodes: NDArray[np.int64]) -> Array:
        """Return the part of W among `nodes` (k,), shape (k * dim, k * dim) [m/N]."""
        dim = self.penalty.shape[1]
        unknowns = (nodes[:, None] * dim + np.arange(dim)).ravel()
        block = self.body[np.ix_(unknowns, unknowns)]
        if self.frames is not None:
            block = rotate_compliance(block, self.frames[nodes])
        block.flat[:: unknowns.size + 1] += self.penalty[nodes].ravel()
        return block

    def response(self, forces: Array) -> Array:
        """Return the body's displacement (n_c, dim) [m] under `forces` (n_c, dim) [N], without the penalties'."""
        if self.frames is None:
            moved: Array = active_product(self.body, np.ascontiguousarray(forces))
            return moved
        given = np.einsum("cij,ci->cj", self.frames, forces)
        rotated: Array = np.einsum("cij,cj->ci", self.frames, active_product(self.body, given))
        return rotated


@numba.njit(cache=True, nogil=True)
def active_product(matrix, forces):  # type: ignore[no-untyped-def]
    """Return matrix @ forces, shape (n_c, dim), without reading the columns of nodes that carry no force.

    Parameters
    ----------
    matrix : (n_c * dim, n_c * dim) array
        Symmetric, so that its contiguous rows serve as columns [m/N].
    forces : (n_c, dim) array
        Nodal forces [N].
    """
    count, dim = forces.shape
    out = np.zeros(count * dim)
    for i in range(count):
        for k in range(dim):
            if forces[i, k] != 0.0:
                out += forces[i, k] * matrix[i * dim + k]
    return out.reshape(count, dim)
