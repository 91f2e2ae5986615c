"""Linear maps from the unknowns of a system to displacements of boundary nodes relative to their counterfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.contact.candidates import node_operator
from fingerslip.contact.counterfaces import Counterface
from fingerslip.fe.space import Space

__all__ = ["Outsiders", "Unknowns", "relative_operator"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Unknowns:
    """The unknowns of a system: free degrees of freedom of the mesh, then one for each driven counterface.

    Parameters
    ----------
    free : (n_free,) array
        Free degrees of freedom among all of the mesh.
    driven : (n_driven,) array
        Indices of the counterfaces that a force drives.
    """

    free: Indices
    driven: Indices

    def restrict(self, forces: Array) -> Array:
        """Return nodal forces (n_dofs,) [N] on the unknowns, shape (n,), zero for driven counterfaces."""
        return np.concatenate([forces[self.free], np.zeros(self.driven.size)])


@dataclass(frozen=True)
class Outsiders:
    """Nodes of a boundary that are no candidates and must not reach its counterface.

    Parameters
    ----------
    nodes : (k,) array
        Mesh nodes.
    positions : (k, dim) array
        Reference positions [m].
    relative : sparse matrix, shape (k * dim, n)
        Map from the unknowns to their displacement relative to what the counterface's drive adds to its motion.
    """

    nodes: Indices
    positions: Array
    relative: sparse.csr_matrix


def relative_operator(
    space: Space, unknowns: Unknowns, nodes: Indices, counterface: Indices, shapes: Sequence[Counterface]
) -> sparse.csr_matrix:
    """Return the map from the unknowns to displacements of nodes relative to their driven counterfaces.

    Parameters
    ----------
    space : Space
        Displacement space of the mesh.
    unknowns : Unknowns
        The n unknowns.
    nodes : (k,) array
        Mesh nodes.
    counterface : (k,) array
        Index of the counterface that each may touch.
    shapes : sequence of Counterface
        The counterfaces; a driven one moves along its unit normal.

    Returns
    -------
    sparse matrix, shape (k * dim, n)
        Node by node.
    """
    columns = [
        -((counterface == number)[:, None] * shapes[number].unit_normal[None, :]).reshape(-1, 1)
        for number in unknowns.driven
    ]
    of_mesh = node_operator(nodes, space.dim, space.n_dofs)[:, unknowns.free]
    return sparse.csr_matrix(sparse.hstack([of_mesh, *(sparse.csr_matrix(column) for column in columns)]))
