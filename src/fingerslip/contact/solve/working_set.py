"""The working set: the nodes on which Newton's method runs, and what is kept of them from step to step."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.dense import DenseFactor

__all__ = ["Preconditioner", "WorkingSet", "gather"]

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Preconditioner:
    """Factors of an earlier Newton matrix, possibly of another working set.

    Parameters
    ----------
    dense : DenseFactor
        LU factors of that matrix.
    nodes : (j,) array
        Contact nodes that it was made for.
    kept : (j * dim,) array of bool
        Which of its unknowns are in the present working set.
    unknowns : array of int
        Indices of the kept ones among the unknowns of the present working set.
    """

    dense: DenseFactor[np.float32]
    nodes: Indices
    kept: NDArray[np.bool_]
    unknowns: Indices

    def solve(self, vector: Single) -> Single:
        """Return the factored inverse times `vector` (k * dim,); unknowns without a factor pass unchanged."""
        given = np.zeros(self.kept.size, dtype=np.float32)
        given[self.kept] = vector[self.unknowns]
        found = self.dense.solve(given)
        out = vector.copy()
        out[self.unknowns] = found[self.kept]
        return out

    def moved_to(self, nodes: Indices, dim: int) -> Preconditioner:
        """Return the same factors for the working set of ascending `nodes` (k,)."""
        position = np.minimum(np.searchsorted(nodes, self.nodes), nodes.size - 1)
        kept = nodes[position] == self.nodes
        unknowns = (position[kept][:, None] * dim + np.arange(dim)).ravel()
        return replace(self, kept=np.repeat(kept, dim), unknowns=unknowns)


@dataclass(frozen=True)
class WorkingSet:
    """The nodes that take part in Newton's method.

    Parameters
    ----------
    nodes : (k,) array
        Contact nodes, ascending.
    scale : (k, dim) array
        Step lengths rho of the projection [N/m].
    scaled : (k * dim, k * dim) array
        rho W among the nodes, in single precision [-].
    preconditioner : Preconditioner, optional
        Factors of an earlier Newton matrix.
    lost : int
        GMRES iterations that fresh factors would have saved so far.
    before : (n_c, dim) array, optional
        Forces of all candidates one step before the last [N].
    """

    nodes: Indices
    scale: Array
    scaled: Single
    preconditioner: Preconditioner | None = None
    lost: int = 0
    before: Array | None = None


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
    own = scale[nodes]
    scaled = (own.reshape(-1, 1) * compliance.block(nodes)).astype(np.float32)
    if old is None or old.preconditioner is None:
        return WorkingSet(nodes, own, scaled)
    preconditioner = old.preconditioner.moved_to(nodes, own.shape[1])
    return WorkingSet(nodes, own, scaled, preconditioner, old.lost, old.before)
