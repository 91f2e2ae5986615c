"""The working set: the nodes on which Newton's method runs, and what is kept of them from step to step."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas

from fingerslip.contact.solve.coarse import CoarseSpace, group_columns, groups, unit_forces
from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.local_inverse import Coupled, LocalInverse
from fingerslip.contact.solve.past import Past

__all__ = ["WorkingSet", "gather"]

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class WorkingSet:
    """The nodes that take part in Newton's method."""

    nodes: Indices  # (k,), contact nodes, in any order
    scale: Array  # (k, dim), step lengths rho of the projection [N/m]
    body: Single  # (k * dim, k * dim), the body's compliance among the nodes in single precision, its lower triangle
    frames: Array  # (k, dim, dim), frames of the nodes [-]
    penalty: Array  # (k, dim), compliance of the penalties [m/N]
    factor: float  # what makes a compliance of `body`
    coupling: Coupled  # for all candidates those to which the body couples them most
    inverse: LocalInverse  # preconditioner
    coarse: CoarseSpace  # what the preconditioner has beside it
    past: Past | None = None  # the forces that were found last
    edition: tuple[float, ...] = ()  # of the compliance that `body` was taken from
    is_exact: bool = False  # whether the entries of that compliance are of single precision themselves

    def in_step(self, compliance: Compliance, scale: Array) -> WorkingSet:
        """Return the working set with the compliance, frames and step lengths (n_c, dim) [N/m] of a step."""
        if compliance.edition != self.edition:
            return gather(compliance, scale, self.nodes, self)
        if compliance.frames is None:
            return self
        return replace(self, frames=compliance.frames[self.nodes], scale=scale[self.nodes])

    def products(self, vectors: Single) -> Single:
        """Return rho W times vectors (k * dim, q), same shape."""
        frames, components = self.frames.astype(np.float32), vectors.reshape(*self.scale.shape, -1)
        turned = np.einsum("imk,imq->ikq", frames, components).reshape(vectors.shape)
        moved = blas.ssymm(1.0, self.body.T, np.asfortranarray(turned)).reshape(components.shape)
        body, penalty = ((self.scale * weight).astype(np.float32) for weight in (self.factor, self.penalty))
        result = body[..., None] * np.einsum("ikm,imq->ikq", frames, moved) + penalty[..., None] * components
        return np.asarray(result.reshape(vectors.shape))


def gather(compliance: Compliance, scale: Array, nodes: Indices, old: WorkingSet | None) -> WorkingSet:
    """Make a working set that keeps the preconditioner of an old one.

    Arrays: scale (n_c, dim) [N/m]; nodes (k,).
    """
    count, dim = scale.shape
    frames = np.broadcast_to(np.eye(dim), (count, dim, dim)) if compliance.frames is None else compliance.frames
    coupling = _coupling(compliance, old)
    position = np.full(count, -1)
    position[nodes] = np.arange(nodes.size)
    columns = group_columns(groups(compliance.body, nodes, dim), dim)
    working_set = WorkingSet(
        nodes=nodes,
        scale=scale[nodes],
        body=_lower_triangle(compliance.body, nodes, dim),
        frames=np.ascontiguousarray(frames[nodes]),
        penalty=compliance.penalty[nodes],
        factor=compliance.factor,
        coupling=coupling,
        inverse=_taken_over(LocalInverse.empty(position[coupling.near[nodes]], dim), position, old),
        coarse=CoarseSpace(columns, np.zeros((0, 0), dtype=np.float32)),
        past=None if old is None else old.past,
        edition=compliance.edition,
        is_exact=compliance.is_single,
    )
    return replace(working_set, coarse=CoarseSpace(columns, working_set.products(unit_forces(columns))))


def _coupling(compliance: Compliance, old: WorkingSet | None) -> Coupled:
    """Return the most coupled nodes: those of the old working set, whose rows stay, with the compliance as it is."""
    if old is None:
        return compliance.coupling
    return old.coupling if old.edition == compliance.edition else old.coupling.under(compliance.body)


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
            row, target = body[nodes[a] * dim + k], out[a * dim + k]
            for b in range(a + 1):
                for m in range(dim):
                    target[b * dim + m] = row[nodes[b] * dim + m]
    return out
