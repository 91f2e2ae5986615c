"""The coordinates in which a motion is computed: how fields are read from them, and the algebra of a step in them.

A system's matrices, loads and contact operators are in its coordinates, and a step needs no more than these. On the
mesh the coordinates are its free degrees of freedom and those of rigid bodies. Those of a reduced body are in
:mod:`fingerslip.dynamics.reduced.reduction`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.dynamics.step.condensation import Condensed, condense
from fingerslip.dynamics.system.operators import NodalComponents, Unknowns
from fingerslip.linear.solver import Factor, LinearSolver, factorise

__all__ = ["Coordinates", "MeshCoordinates"]

Array = NDArray[np.float64]
Reals = NDArray[np.floating[Any]]
Indices = NDArray[np.int64]


class Coordinates(Protocol):
    """Coordinates of a system: n numbers for each field."""

    @property
    def rigid(self) -> Indices:
        """Where the free directions of rigid bodies stand among them, shape (n_rigid,)."""

    @property
    def checks_at_once(self) -> int:
        """Steps whose other boundary nodes are best checked at once for whether they reach a counterface."""

    @property
    def snapshots_at_once(self) -> int:
        """Snapshots that are best carried to the mesh at once."""

    def components(self, dofs: Indices) -> NodalComponents:
        """Find degrees of freedom of the mesh, such as those of sites and candidates, shape (k,)."""

    def apply_map(self, matrix: sparse.csr_matrix) -> tuple[NodalComponents, Array | sparse.csr_matrix]:
        """Return what a linear map (k, n_dofs) of the mesh's displacement takes, and the map of that."""

    def on_mesh(self, field: Array) -> Array:
        """Return a field (n,) or k of them (n, k) at all degrees of freedom of the mesh, zero where it is held."""

    def factorise(self, matrix: sparse.csr_matrix, solver: LinearSolver) -> Factor:
        """Factorise a matrix (n, n)."""

    def condense(
        self, matrix: sparse.csr_matrix, local: sparse.csr_matrix, solver: LinearSolver, reserved_bytes: int
    ) -> tuple[Condensed, Reals]:
        """Factorise and condense a matrix; see :func:`fingerslip.dynamics.step.condensation.condense`."""


@dataclass(frozen=True)
class MeshCoordinates:
    """The unknowns of a mesh themselves; see :class:`Coordinates`."""

    unknowns: Unknowns  # free degrees of freedom, then those of rigid bodies and moving supports
    n_dofs: int  # degrees of freedom of the mesh
    checks_at_once = 16
    snapshots_at_once = 1

    @property
    def rigid(self) -> Indices:
        """The unknowns behind the free ones."""
        return self.unknowns.of_rigid

    def components(self, dofs: Indices) -> NodalComponents:
        """Find degrees of freedom (k,) among the unknowns."""
        return NodalComponents.of(self.unknowns, self.n_dofs, dofs)

    def apply_map(self, matrix: sparse.csr_matrix) -> tuple[NodalComponents, sparse.csr_matrix]:
        """Return the components that a map (k, n_dofs) does not ignore, and the map of these."""
        columns = np.unique(matrix.indices)
        return self.components(columns), matrix[:, columns]

    def on_mesh(self, field: Array) -> Array:
        """Return a field (n,) or (n, k) on all of the mesh, shape (n_dofs,) or (n_dofs, k)."""
        full = np.zeros((self.n_dofs, *field.shape[1:]), order="F")
        # Column by column: memory is read and written in its order.
        for column, of_field in zip(_columns(full), _columns(field), strict=True):
            column[self.unknowns.free] = of_field[: self.unknowns.free.size]
            for unknown, dofs in zip(self.unknowns.moving, self.unknowns.carried, strict=True):
                column[dofs] = of_field[unknown]
        return full

    def factorise(self, matrix: sparse.csr_matrix, solver: LinearSolver) -> Factor:
        """Factorise a sparse matrix (n, n)."""
        return factorise(matrix, solver)

    def condense(
        self, matrix: sparse.csr_matrix, local: sparse.csr_matrix, solver: LinearSolver, reserved_bytes: int
    ) -> tuple[Condensed, Reals]:
        """Factorise and condense a sparse matrix; see :func:`fingerslip.dynamics.step.condensation.condense`."""
        return condense(matrix, local, solver, reserved_bytes)


def _columns(field: Array) -> Array:
    """Return the columns of a field (n,) or (n, k), shape (1, n) or (k, n), without copying."""
    return field[None] if field.ndim == 1 else field.T
