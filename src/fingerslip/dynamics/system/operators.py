"""Linear maps from the unknowns of a system to displacements of boundary nodes relative to their counterfaces."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.contact.candidates import node_operator
from fingerslip.dynamics.system.bodies import RigidFreedom
from fingerslip.fe.space import Space

__all__ = ["NodalComponents", "Outsiders", "Unknowns", "relative_motion", "relative_operator"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Unknowns:
    """The unknowns of a system: free degrees of freedom, free directions of rigid bodies, then supports that move.

    Parameters
    ----------
    free : (n_free,) array
        Free degrees of freedom among all of the mesh.
    rigid : tuple of RigidFreedom
        Free directions of rigid bodies, driven counterfaces included.
    carried : tuple of (k,) arrays
        Degrees of freedom of the mesh that move as one with each component of a moving support.
    """

    free: Indices
    rigid: tuple[RigidFreedom, ...] = ()
    carried: tuple[Indices, ...] = ()

    @property
    def count(self) -> int:
        """How many there are, n."""
        return self.free.size + len(self.rigid) + len(self.carried)

    @cached_property
    def moving(self) -> Indices:
        """Where the moving supports stand among them: at the end."""
        return self.free.size + len(self.rigid) + np.arange(len(self.carried))

    @cached_property
    def of_rigid(self) -> Indices:
        """Where the free directions of rigid bodies stand among them."""
        return self.free.size + np.arange(len(self.rigid))

    def rows(self, n_dofs: int) -> Indices:
        """Return the unknown of each of the mesh's degrees of freedom, shape (n_dofs,); -1 for those at rest."""
        rows = np.full(n_dofs, -1, dtype=np.int64)
        rows[self.free] = np.arange(self.free.size)
        for unknown, dofs in zip(self.moving, self.carried, strict=True):
            rows[dofs] = unknown
        return rows

    def expansion(self, n_dofs: int) -> sparse.csr_matrix:
        """Return the map from the unknowns to the mesh's degrees of freedom, shape (n_dofs, n) [-]."""
        rows = self.rows(n_dofs)
        moving = np.flatnonzero(rows >= 0)
        return sparse.csr_matrix((np.ones(moving.size), (moving, rows[moving])), shape=(n_dofs, self.count))

    def restrict(self, forces: Array) -> Array:
        """Return nodal forces (n_dofs,) [N] on the unknowns, shape (n,): zero for rigid bodies, sums for supports."""
        sums = [forces[dofs].sum() for dofs in self.carried]
        return np.concatenate([forces[self.free], np.zeros(len(self.rigid)), sums])


@dataclass(frozen=True)
class NodalComponents:
    """Some displacement components of the mesh, found among the unknowns.

    Parameters
    ----------
    rows : (k,) array
        Their indices among the unknowns; any for held components.
    held : (k,) array of bool
        Which of them supports hold.
    """

    rows: Indices
    held: NDArray[np.bool_]

    @classmethod
    def of(cls, unknowns: Unknowns, n_dofs: int, components: Indices) -> NodalComponents:
        """Find `components` (k,), degrees of freedom among the `n_dofs` of the mesh."""
        found = unknowns.rows(n_dofs)[components]
        return cls(np.maximum(found, 0), found < 0)

    def among(self, taken: Indices) -> NodalComponents:
        """Find them among some of the unknowns, `taken` (m,), ascending."""
        return replace(self, rows=np.searchsorted(taken, self.rows))

    def read(self, fields: Array) -> Array:
        """Return the components (..., k) of fields (..., n) on the unknowns; zero where supports hold them."""
        found: Array = fields[..., self.rows]
        found[..., self.held] = 0.0
        return found


@dataclass(frozen=True)
class Outsiders:
    """Nodes of a boundary that are no candidates and must not reach its counterface.

    Parameters
    ----------
    nodes : (k,) array
        Mesh nodes.
    positions : (k, dim) array
        Reference positions [m].
    relative : matrix, shape (k * dim, n)
        Map from the first n unknowns, on a mesh all, to their displacement relative to what the free directions of a
        rigid body add to the counterface's motion.
    """

    nodes: Indices
    positions: Array
    relative: sparse.csr_matrix | Array


def relative_operator(space: Space, unknowns: Unknowns, nodes: Indices, counterface: Indices) -> sparse.csr_matrix:
    """Return the map from the unknowns to displacements of nodes relative to their counterfaces on free rigid bodies.

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

    Returns
    -------
    sparse matrix, shape (k * dim, n)
        Node by node.
    """
    of_mesh = sparse.csr_matrix(node_operator(nodes, space.dim, space.n_dofs) @ unknowns.expansion(space.n_dofs))
    if not unknowns.rigid:
        return of_mesh
    points = space.positions[nodes]
    columns = [
        -(np.isin(counterface, freedom.faces)[:, None] * freedom.moved(points)).reshape(-1, 1)
        for freedom in unknowns.rigid
    ]
    first, last = of_mesh[:, : unknowns.free.size], of_mesh[:, unknowns.free.size + len(unknowns.rigid) :]
    return sparse.csr_matrix(sparse.hstack([first, *(sparse.csr_matrix(column) for column in columns), last]))


@numba.njit(cache=True, nogil=True)
def relative_motion(starts, columns, values, field, counterfaces, counterface):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Return the displacement of nodes relative to their counterfaces, shape (k, dim) [m].

    Parameters
    ----------
    starts, columns, values : arrays
        A :func:`relative_operator`, as :func:`~fingerslip.linear.products.compiled_parts` gives it.
    field : (n,) array
        Displacement of the unknowns [m].
    counterfaces : (n_counterfaces, dim) array
        Prescribed displacement of the counterfaces [m].
    counterface : (k,) array
        Index of the counterface of each node.
    """
    found = np.empty((counterface.size, counterfaces.shape[1]))
    for i in range(found.shape[0]):
        for k in range(found.shape[1]):
            row = i * found.shape[1] + k
            total = 0.0
            for entry in range(starts[row], starts[row + 1]):
                total += values[entry] * field[columns[entry]]
            found[i, k] = total - counterfaces[counterface[i], k]
    return found
