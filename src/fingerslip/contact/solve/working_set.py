"""The working set: the nodes on which Newton's method runs, and what is kept of them from step to step.

The last steps tell a first guess of the next contact forces, and the body's response to that. The response is linear.
Where the compliance stays as it is, that to forces extrapolated from two steps follows from those of these steps, but
for nodes that would open: only these have to be multiplied by the compliance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numba
import numpy as np
from scipy.linalg import blas

from fingerslip.arrays import Floats, Integers, Reals, Singles
from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.preconditioner import Coupled, LocalInverse, groups
from fingerslip.linear.symmetric import write_symmetric_product


@dataclass(frozen=True)
class WarmStart:
    """Contact forces of all n_c candidates that were found last."""

    forces: Floats  # (n_c, dim), those found last [N]
    before: Floats  # (n_c, dim), those one step before [N]
    response: Floats | None = None  # (n_c, dim), displacement of the body under `forces`, without the penalties [m]
    response_before: Floats | None = None  # (n_c, dim), that under `before` [m]
    frames: Floats | None = None  # (n_c, dim, dim), frames of the candidates


def first_guess(
    compliance: Compliance, warm_start: WarmStart | None, start: Floats, origin: Floats | None
) -> tuple[Floats, Floats | None]:
    """Return forces (n_c, dim) [N] to begin a step with, and the body's response to them [m] where it is known.

    Arrays: start (n_c, dim) [N]; origin (n_c, dim) [N].
    """
    if warm_start is None:
        return start, None
    response = warm_start.response if np.array_equal(start, warm_start.forces) else None
    if origin is not None:
        return start, response
    guess = 2.0 * start - warm_start.before
    opens = (start[:, 0] <= 0.0) | (guess[:, 0] <= 0.0)
    lost = np.where(opens[:, None], guess, 0.0)
    guess[opens] = 0.0
    if response is None or warm_start.response_before is None:
        return guess, None
    of_guess = 2.0 * response - warm_start.response_before
    return guess, of_guess - compliance.response(lost) if lost.any() else of_guess


def next_warm_start(
    warm_start: WarmStart | None, forces: Floats, response: Floats | None, start: Floats, origin: Floats | None
) -> WarmStart:
    """Return what a step leaves for the next one; `forces` were found, the others as in :func:`first_guess`."""
    left = WarmStart(forces, start if origin is None else origin, response)
    if warm_start is None:
        return left
    before, response_before = warm_start.forces, warm_start.response
    if origin is not None:
        before, response_before = warm_start.before, warm_start.response_before
    return replace(left, response_before=response_before) if np.array_equal(left.before, before) else left


@dataclass(frozen=True)
class WorkingSet:
    """The nodes that take part in Newton's method."""

    nodes: Integers  # (k,), contact nodes, in any order
    scale: Floats  # (k, dim), step lengths rho of the projection [N/m]
    body: Singles  # (k * dim, k * dim), the body's compliance among the nodes in single precision, its lower triangle
    frames: Floats  # (k, dim, dim), frames of the nodes [-]
    penalty: Floats  # (k, dim), compliance of the penalties [m/N]
    factor: float  # what makes a compliance of `body`
    coupling: Coupled  # for all candidates those to which the body couples them most
    inverse: LocalInverse  # preconditioner
    coarse: tuple[Singles, Singles]  # (k * dim, q), unit forces Z on groups of nodes, and rho W Z
    warm_start: WarmStart | None = None  # the forces that were found last
    edition: tuple[float, ...] = ()  # of the compliance that `body` was taken from
    is_exact: bool = False  # whether the entries of that compliance are of single precision themselves

    def in_step(self, compliance: Compliance, scale: Floats) -> WorkingSet:
        """Return the working set with the compliance, frames and step lengths (n_c, dim) [N/m] of a step.

        The rows of its inverse are its own, as a step renews them in place.
        """
        if compliance.edition != self.edition:
            return gather(compliance, scale, self.nodes, self)
        working_set = replace(self, inverse=self.inverse.copy())
        if compliance.frames is None:
            return working_set
        return replace(working_set, frames=compliance.frames[self.nodes], scale=scale[self.nodes])

    def warm_start_under(self, compliance: Compliance) -> WarmStart | None:
        """Return the warm start, without the responses where the compliance or its frames are others."""
        if (last := self.warm_start) is None:
            return None
        frames, others = last.frames, compliance.frames
        stay = frames is others or (frames is not None and others is not None and np.array_equal(frames, others))
        is_same = stay and compliance.edition == self.edition
        return last if is_same else replace(last, response=None, response_before=None)

    @property
    def weights(self) -> tuple[Floats, Floats]:
        """Weights of the body's response and of the force itself in rho W, (k, dim) each."""
        return self.scale * self.factor, self.scale * self.penalty

    def compliance_in(self, count: int, precision: type[np.floating[Any]]) -> tuple[Singles, Reals, Reals, Reals]:
        """Return rho W of the first nodes, as :func:`write_motion` takes it, with all but the body in a precision."""
        frames, of_body, of_penalty = (part[:count].astype(precision) for part in (self.frames, *self.weights))
        return self.body, frames, of_body, of_penalty

    def motion(self, forces: Floats) -> Floats:
        """Return rho W times forces (n, dim) of the first n nodes, in double precision."""
        moved = np.empty(forces.size)
        write_motion(self.compliance_in(len(forces), np.float64), forces.ravel(), moved)
        return moved.reshape(forces.shape)

    def motions(self, vectors: Singles) -> Singles:
        """Return rho W times vectors (k * dim, q), same shape."""
        _, frames, of_body, of_penalty = self.compliance_in(len(self.nodes), np.float32)
        components = vectors.reshape(*self.scale.shape, -1)
        turned = np.einsum("imk,imq->ikq", frames, components).reshape(vectors.shape)
        moved = blas.ssymm(1.0, self.body.T, np.asfortranarray(turned)).reshape(components.shape)
        result = of_body[..., None] * np.einsum("ikm,imq->ikq", frames, moved) + of_penalty[..., None] * components
        return np.asarray(result.reshape(vectors.shape))


@numba.njit(cache=True, nogil=True, fastmath={"reassoc", "contract"})
def write_motion(scaled, forces, moved):  # type: ignore[no-untyped-def]
    """Write rho W, from :meth:`WorkingSet.compliance_in`, times forces (n * dim,) into `moved`, in their precision."""
    body, frames, of_body, of_penalty = scaled
    count, dim = of_body.shape
    turned, response = np.zeros_like(forces), np.empty_like(forces)
    for i in range(count):
        for m in range(dim):
            for n in range(dim):
                turned[i * dim + m] += frames[i, n, m] * forces[i * dim + n]
    write_symmetric_product(body, turned, response)
    for i in range(count):
        for m in range(dim):
            total = forces.dtype.type(0)
            for n in range(dim):
                total += frames[i, m, n] * response[i * dim + n]
            moved[i * dim + m] = of_body[i, m] * total + of_penalty[i, m] * forces[i * dim + m]


def gather(compliance: Compliance, scale: Floats, nodes: Integers, old: WorkingSet | None) -> WorkingSet:
    """Make a working set that keeps the preconditioner of an old one.

    Arrays: scale (n_c, dim) [N/m]; nodes (k,).
    """
    count, dim = scale.shape
    frames = np.broadcast_to(np.eye(dim), (count, dim, dim)) if compliance.frames is None else compliance.frames
    coupling = compliance.coupling
    if old is not None:
        # Those of the old working set, whose rows stay, with the compliance as it is.
        coupling = old.coupling if old.edition == compliance.edition else old.coupling.under(compliance.body)
    position = np.full(count, nodes.size)
    position[nodes] = np.arange(nodes.size)
    inverse = LocalInverse.empty(position[coupling.near[nodes]], dim)
    if old is not None:
        places = position[old.nodes]
        stay = places < nodes.size
        inverse.rows[places[stay]], inverse.marks[places[stay]] = old.inverse.rows[stay], old.inverse.marks[stay]
    group = groups(compliance.body, nodes, dim)
    of_groups, axes = np.eye(group.max(initial=-1) + 1, dtype=np.float32)[group], np.eye(dim, dtype=np.float32)
    forces: Singles = np.kron(of_groups, axes)
    working_set = WorkingSet(
        nodes=nodes,
        scale=scale[nodes],
        body=_lower_triangle(compliance.body, nodes, dim),
        frames=np.ascontiguousarray(frames[nodes]),
        penalty=compliance.penalty[nodes],
        factor=compliance.factor,
        coupling=coupling,
        inverse=inverse,
        coarse=(forces, forces),
        warm_start=None if old is None else old.warm_start,
        edition=compliance.edition,
        is_exact=compliance.is_single,
    )
    return replace(working_set, coarse=(forces, working_set.motions(forces)))


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
