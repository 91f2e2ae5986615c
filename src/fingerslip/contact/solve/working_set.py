"""The working set: the nodes on which Newton's method runs, and what is kept of them from step to step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas

from fingerslip.contact.solve.coarse import CoarseSpace, group_columns, groups, unit_forces
from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.dense import symmetric_product
from fingerslip.contact.solve.local_inverse import LocalInverse, coupled_nodes
from fingerslip.contact.solve.past import Past

__all__ = ["WorkingSet", "gather"]

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class WorkingSet:
    """The nodes that take part in Newton's method.

    Parameters
    ----------
    nodes : (k,) array
        Contact nodes, ascending.
    scale : (k, dim) array
        Step lengths rho of the projection [N/m].
    body : (k * dim, k * dim) array
        The body's compliance among the nodes in single precision, its lower triangle; see
        :class:`fingerslip.contact.solve.compliance.Compliance`.
    frames : (k, dim, dim) array
        Frames of the nodes [-].
    penalty : (k, dim) array
        Compliance of the penalties [m/N].
    factor : float
        What makes a compliance of `body`.
    coupled : (n_c, m) array of int
        For all candidates those to which the body couples them most.
    inverse : LocalInverse
        Preconditioner.
    coarse : CoarseSpace
        What the preconditioner has beside it; in frames that turn, from when the nodes were gathered.
    past : Past, optional
        The forces that were found last.
    edition : tuple
        Of the compliance that `body` was taken from.
    """

    nodes: Indices
    scale: Array
    body: Single
    frames: Array
    penalty: Array
    factor: float
    coupled: Indices
    inverse: LocalInverse
    coarse: CoarseSpace
    past: Past | None = None
    edition: tuple[float, ...] = ()

    def in_step(self, compliance: Compliance, scale: Array) -> WorkingSet:
        """Return the working set with the compliance, frames and step lengths (n_c, dim) [N/m] of a step."""
        if compliance.edition != self.edition:
            return gather(compliance, scale, self.nodes, self)
        if compliance.frames is None:
            return self
        return replace(self, frames=compliance.frames[self.nodes], scale=scale[self.nodes])

    def product(self, vector: Single) -> Single:
        """Return rho W times a vector (k * dim,), same shape."""
        given = vector.reshape(self.scale.shape)
        moved = symmetric_product(self.body, _rotated(self._frames, given, False).ravel())
        found: Single = _scaled(self._frames, moved.reshape(given.shape), given, *self._weights)
        return found.ravel()

    def preconditioner(self, slopes: Single) -> Callable[[Single], Single]:
        """Return what solves roughly with the Newton matrix of slopes G (k, dim, dim), for a vector (k * dim,)."""
        coarse = self.coarse.inverse(slopes)

        def solve(vector: Single) -> Single:
            solved, left = coarse.split(vector)
            found: Single = solved + self.inverse.solve(left)
            return found

        return solve

    def renewed(self, slopes: Array) -> WorkingSet:
        """Return the working set with a preconditioner for the derivative G of the projection, (k, dim, dim) [-]."""
        marks = np.concatenate([slopes, self.frames], axis=1)
        parts = self.body, self.frames, self.penalty, self.factor
        return replace(self, inverse=self.inverse.renewed(marks, slopes, self.scale, parts))

    def scaled(self) -> Single:
        """Return rho W among the nodes, shape (k * dim, k * dim)."""
        return self.products(np.eye(self.scale.size, dtype=np.float32))

    def products(self, vectors: Single) -> Single:
        """Return rho W times vectors (k * dim, q), same shape."""
        given = vectors.reshape(*self.scale.shape, -1)
        turned = np.einsum("imk,imq->ikq", self._frames, given).reshape(vectors.shape)
        moved = blas.ssymm(1.0, self.body.T, np.asfortranarray(turned)).reshape(given.shape)
        body, penalty = self._weights
        found = body[..., None] * np.einsum("ikm,imq->ikq", self._frames, moved) + penalty[..., None] * given
        return np.asarray(found.reshape(vectors.shape))

    @cached_property
    def _frames(self) -> Single:
        return self.frames.astype(np.float32)

    @cached_property
    def _weights(self) -> tuple[Single, Single]:
        """The weights of the body's response and of the force itself in rho W, both (k, dim)."""
        return (self.scale * self.factor).astype(np.float32), (self.scale * self.penalty).astype(np.float32)


def gather(compliance: Compliance, scale: Array, nodes: Indices, old: WorkingSet | None) -> WorkingSet:
    """Make a working set that keeps the preconditioner of an old one.

    Parameters
    ----------
    compliance : Compliance
        W of all n_c candidates.
    scale : (n_c, dim) array
        Step lengths rho of all candidates [N/m].
    nodes : (k,) array
        Nodes of the new working set, ascending.
    old : WorkingSet or None
        The working set so far.
    """
    count, dim = scale.shape
    frames = np.broadcast_to(np.eye(dim), (count, dim, dim)) if compliance.frames is None else compliance.frames
    coupled = coupled_nodes(compliance.body, count) if old is None else old.coupled
    position = np.full(count, -1)
    position[nodes] = np.arange(nodes.size)
    columns = group_columns(groups(compliance.body, nodes, dim), dim)
    made = WorkingSet(
        nodes=nodes,
        scale=scale[nodes],
        body=_lower_triangle(compliance.body, nodes, dim),
        frames=np.ascontiguousarray(frames[nodes]),
        penalty=compliance.penalty[nodes],
        factor=compliance.factor,
        coupled=coupled,
        inverse=_taken_over(LocalInverse.empty(position[coupled[nodes]], (nodes.size, 2 * dim, dim)), position, old),
        coarse=CoarseSpace(columns, np.zeros((0, 0), dtype=np.float32)),
        past=None if old is None else old.past,
        edition=compliance.edition,
    )
    return replace(made, coarse=CoarseSpace(columns, made.products(unit_forces(columns))))


def _taken_over(inverse: LocalInverse, position: Indices, old: WorkingSet | None) -> LocalInverse:
    """Take over the rows of the nodes that stay, from an old working set to new positions (n_c,)."""
    if old is not None:
        places = position[old.nodes]
        stay = places >= 0
        inverse.rows[places[stay]], inverse.marks[places[stay]] = old.inverse.rows[stay], old.inverse.marks[stay]
    return inverse


@numba.njit(cache=True, nogil=True)
def _lower_triangle(body, nodes, dim):  # type: ignore[no-untyped-def]
    """Return the part of a symmetric matrix among nodes in single precision, zero above its diagonal."""
    size = nodes.size * dim
    out = np.zeros((size, size), dtype=np.float32)
    for a in range(nodes.size):
        for k in range(dim):
            row, own = body[nodes[a] * dim + k], out[a * dim + k]
            for b in range(a + 1):
                for m in range(dim):
                    own[b * dim + m] = row[nodes[b] * dim + m]
    return out


@numba.njit(cache=True, nogil=True)
def _rotated(frames, vectors, into):  # type: ignore[no-untyped-def]
    """Return vectors (k, dim) turned into their frames, or out of them."""
    out = np.zeros_like(vectors)
    for i in range(len(vectors)):
        for k in range(vectors.shape[1]):
            for m in range(vectors.shape[1]):
                out[i, k] += (frames[i, k, m] if into else frames[i, m, k]) * vectors[i, m]
    return out


@numba.njit(cache=True, nogil=True)
def _scaled(frames, moved, forces, body_weight, penalty_weight):  # type: ignore[no-untyped-def]
    """Return rho W times forces (k, dim), from the response of the body in global components."""
    return body_weight * _rotated(frames, moved, True) + penalty_weight * forces
