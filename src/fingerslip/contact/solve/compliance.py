"""The compliance that couples the contact nodes, and the parts of it that a step needs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np

from fingerslip.arrays import Floats, Integers, Reals
from fingerslip.contact.counterfaces import rotate_compliance
from fingerslip.contact.solve.preconditioner import Coupled
from fingerslip.linear.symmetric import symmetric_product, weighted_rows

# Share of nodes with a force from which reading half of the symmetric matrix is faster than reading their rows.
_MOSTLY = 0.3


@dataclass(frozen=True)
class Compliance:
    """W of :mod:`fingerslip.contact.solve.newton`: the body's compliance, those of the penalties on its diagonal."""

    body: Reals  # (n_c * dim, n_c * dim), symmetric, node by node
    penalty: Floats  # (n_c, dim), compliance of the contact penalties in the nodes' frames [m/N]
    frames: Floats | None = None  # (n_c, dim, dim), frames of the nodes [-] where `body` is in global components
    factor: float = 1.0  # what makes a compliance of `body`, which large matrices share
    edition: tuple[float, ...] = ()

    @property
    def is_single(self) -> bool:
        """Whether the body's compliance is of single precision."""
        return self.body.dtype == np.float32

    @cached_property
    def diagonal(self) -> Floats:
        """Diagonal of W in the nodes' frames, shape (n_c, dim) [m/N]."""
        count, dim = self.penalty.shape
        nodes = np.arange(count)
        blocks = self.body.reshape(count, dim, count, dim)[nodes, :, nodes, :].astype(np.float64)
        if self.frames is None:
            return np.asarray(self.factor * np.diagonal(blocks, axis1=1, axis2=2) + self.penalty)
        rotated = np.einsum("aij,ajk,aik->ai", self.frames, blocks, self.frames)
        return np.asarray(self.factor * rotated + self.penalty)

    @cached_property
    def coupling(self) -> Coupled:
        """For each node those to which the body couples it most."""
        return Coupled.of(self.body, len(self.penalty))

    @cached_property
    def matrix(self) -> Floats:
        """W itself, shape (n_c * dim, n_c * dim) [m/N]; meant for few nodes."""
        return self.block(np.arange(len(self.penalty)))

    def block(self, nodes: Integers) -> Floats:
        """Return the part of W among `nodes` (k,), shape (k * dim, k * dim) [m/N]."""
        dim = self.penalty.shape[1]
        unknowns = (nodes[:, None] * dim + np.arange(dim)).ravel()
        block = self.factor * self.body[np.ix_(unknowns, unknowns)].astype(np.float64)
        if self.frames is not None:
            block = rotate_compliance(block, self.frames[nodes])
        block.flat[:: unknowns.size + 1] += self.penalty[nodes].ravel()
        return block

    def response(self, forces: Floats) -> Floats:
        """Return the body's displacement (n_c, dim) [m] under `forces` (n_c, dim) [N], without the penalties'."""
        if self.frames is None:
            return self._product(np.ascontiguousarray(forces))
        components = np.einsum("cij,ci->cj", self.frames, forces)
        return np.asarray(np.einsum("cij,cj->ci", self.frames, self._product(components)))

    def _product(self, forces: Floats) -> Floats:
        if np.count_nonzero(forces.any(axis=1)) < _MOSTLY * len(forces):
            moved: Floats = active_product(self.body, forces)
        else:
            moved = symmetric_product(self.body, forces.ravel()).reshape(forces.shape)
        return self.factor * moved


@numba.njit(cache=True, nogil=True)
def active_product(matrix, forces):  # type: ignore[no-untyped-def]
    """Return matrix @ forces, shape (n_c, dim), without reading the columns of nodes that carry no force.

    Arrays: matrix (n_c * dim, n_c * dim) [m/N]; forces (n_c, dim) [N].
    """
    return weighted_rows(matrix, forces.ravel()).reshape(forces.shape)
