"""The compliance that couples the contact nodes, and the parts of it that a step needs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.frames import rotate_compliance

__all__ = ["Compliance"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Compliance:
    """W of :mod:`fingerslip.contact.solve.newton`: the body's compliance with that of the penalties on its diagonal.

    Parameters
    ----------
    body : (n_c * dim, n_c * dim) array
        Compliance of the body, symmetric, node by node [m/N].
    penalty : (n_c, dim) array
        Compliance of the contact penalties in the nodes' frames [m/N].
    frames : (n_c, dim, dim) array, optional
        The nodes' frames where `body` is in global components; without them it is in the frames already.
    """

    body: Array
    penalty: Array
    frames: Array | None = None

    def turned(self, frames: Array) -> Compliance:
        """Return the same compliance with `body` in the given frames (n_c, dim, dim), for frames that stay."""
        return Compliance(rotate_compliance(self.body, frames), self.penalty)

    @cached_property
    def diagonal(self) -> Array:
        """Diagonal of W in the nodes' frames, shape (n_c, dim) [m/N]."""
        count, dim = self.penalty.shape
        places = np.arange(count)
        blocks = self.body.reshape(count, dim, count, dim)[places, :, places, :]
        if self.frames is not None:
            turned: Array = np.einsum("aij,ajk,aik->ai", self.frames, blocks, self.frames) + self.penalty
            return turned
        diagonal: Array = np.diagonal(blocks, axis1=1, axis2=2) + self.penalty
        return diagonal

    @cached_property
    def matrix(self) -> Array:
        """W itself, shape (n_c * dim, n_c * dim); for few nodes."""
        return self.block(np.arange(len(self.penalty)))

    def block(self, nodes: NDArray[np.int64]) -> Array:
        """Return the part of W among `nodes` (k,), shape (k * dim, k * dim) [m/N]."""
        dim = self.penalty.shape[1]
        places = (nodes[:, None] * dim + np.arange(dim)).ravel()
        block = self.body[np.ix_(places, places)]
        if self.frames is not None:
            block = rotate_compliance(block, self.frames[nodes])
        block.flat[:: places.size + 1] += self.penalty[nodes].ravel()
        return block

    def response(self, forces: Array) -> Array:
        """Return what `forces` (n_c, dim) [N] do to the body, without the penalties, shape (n_c, dim) [m]."""
        if self.frames is None:
            moved: Array = _rows_times(self.body, np.ascontiguousarray(forces))
            return moved
        given = np.einsum("cij,ci->cj", self.frames, forces)
        turned: Array = np.einsum("cij,cj->ci", self.frames, _rows_times(self.body, given))
        return turned


@numba.njit(cache=True, nogil=True)
def _rows_times(body, forces):  # type: ignore[no-untyped-def]
    """Return body @ forces without reading the columns of nodes that carry none: the matrix is symmetric."""
    count, dim = forces.shape
    out = np.zeros(count * dim)
    for i in range(count):
        for k in range(dim):
            if forces[i, k] != 0.0:
                out += forces[i, k] * body[i * dim + k]
    return out.reshape(count, dim)
