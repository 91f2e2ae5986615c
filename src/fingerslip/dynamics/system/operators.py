"""The unknowns of a system, and linear maps from them: to boundary nodes relative to counterfaces, and to fields."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy import sparse
from scipy.spatial.transform import Rotation

from fingerslip.arrays import Flags, Floats, Integers, Reals
from fingerslip.contact.candidates import node_operator
from fingerslip.dynamics.step.condensation import Condensed, condense
from fingerslip.dynamics.system.bodies import RigidFreedom
from fingerslip.fe.space import Space
from fingerslip.linear.solver import LinearSolver


@dataclass(frozen=True)
class NodalComponents:
    """Some displacement components of the mesh, found among the unknowns."""

    rows: Integers  # (k,), their indices among the unknowns
    held: Flags  # (k,), which of them supports hold

    def among(self, nodes_left: Integers) -> NodalComponents:
        """Find them among some of the unknowns, `taken` (m,), ascending."""
        return replace(self, rows=np.searchsorted(nodes_left, self.rows))

    def read(self, fields: Floats) -> Floats:
        """Return the components (..., k) of fields (..., n) on the unknowns; zero where supports hold them."""
        values: Floats = fields[..., self.rows]
        values[..., self.held] = 0.0
        return values


@dataclass(frozen=True)
class Outsiders:
    """Nodes of a boundary that are no candidates and must not reach its counterface."""

    nodes: Integers  # (k,), mesh nodes
    positions: Floats  # (k, dim), reference positions [m]
    relative: sparse.csr_matrix | Floats
    searched: float | None = None  # within which distance candidates were looked for, where that is given [m]


@dataclass(frozen=True)
class Pose:
    """Nodes that may touch counterfaces of bodies that have turned."""

    # (k, dim), where they are for whom turns with their counterface, relative to where that started [m]
    points: Floats
    turned: Floats  # (k, dim, dim), rotation of the counterface of each [-]
    # (k * dim, r), displacement relative to the counterfaces per rotation of their bodies, in global components [m]
    columns: Floats


@dataclass(frozen=True)
class Rotations:
    """The r rotations of rigid bodies about their present centres, as their counterfaces see them.

    A node at x, on whose body the centre has moved from c to c + d, has the arm a = x - c - d. Turned by R, the body
    sees it at c + R^T a, and a further rotation about e moves the body's point there by e x a.
    """

    at: Integers  # (r,), which of the unknowns they are
    axes: Floats  # (r, n_counterfaces, 3), the axis of each on the counterfaces of its body, zero on others [-]
    turns: Floats  # (r, n_counterfaces, dim, dim), map from an arm to its displacement per radian [-]
    centres: Floats  # (n_counterfaces, dim), centres of the bodies at the start [m]

    def matrices(self, angles: Floats) -> Floats:
        """Return the rotation of every counterface for angles (..., r), shape (..., n_counterfaces, dim, dim) [-]."""
        vectors = np.tensordot(angles, self.axes, axes=1)
        dim = self.centres.shape[1]
        result = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix()[:, :dim, :dim]
        return np.asarray(result.reshape(*vectors.shape[:-1], dim, dim))

    def seen(self, turned: Floats, points: Floats, counterface: Integers) -> Floats:
        """Return points (..., k, dim) [m], relative to the centres' motion, as counterfaces see them in rotations."""
        centres = self.centres[counterface]
        return np.asarray(centres + np.einsum("...ij,...i->...j", turned, points - centres))

    def pose(self, angles: Floats, points: Floats, counterface: Integers) -> Pose:
        """Return the pose for angles (r,) of points (k, dim) [m], which are relative to the motion of the centres."""
        turned = self.matrices(angles)[counterface]
        arms = points - self.centres[counterface]
        columns = -np.einsum("rcij,cj->cir", self.turns[:, counterface], arms).reshape(points.size, -1)
        return Pose(self.seen(turned, points, counterface), turned, columns)


def rotations_of(rigid: Sequence[RigidFreedom], at: Integers, n_counterfaces: int) -> Rotations | None:
    """Return the rotations among free directions of rigid bodies, which are the unknowns `at`; None without any."""
    turning = [
        (unknown, freedom) for unknown, freedom in zip(at, rigid, strict=True) if freedom.turns and freedom.faces
    ]
    if not turning:
        return None
    dim = turning[0][1].centre.size
    axes, centres = np.zeros((len(turning), n_counterfaces, 3)), np.zeros((n_counterfaces, dim))
    turns = np.zeros((len(turning), n_counterfaces, dim, dim))
    for row, (_, freedom) in enumerate(turning):
        faces = list(freedom.faces)
        axes[row, faces, freedom.axis], turns[row, faces], centres[faces] = 1.0, freedom.turn, freedom.centre
    return Rotations(np.array([int(unknown) for unknown, _ in turning]), axes, turns, centres)


def relative_operator(space: Space, unknowns: Unknowns, nodes: Integers, counterface: Integers) -> sparse.csr_matrix:
    """Return the map from the unknowns to displacements of nodes relative to their counterfaces on free rigid bodies.

    Rotations, which do not move the centres, are left out: see :class:`Rotations`.
    """
    of_mesh = sparse.csr_matrix(node_operator(nodes, space.dim, space.n_dofs) @ unknowns.expansion)
    if not unknowns.freedoms:
        return of_mesh
    columns = [
        -(np.isin(counterface, freedom.faces)[:, None] * freedom.shift).reshape(-1, 1) for freedom in unknowns.freedoms
    ]
    first, last = of_mesh[:, : unknowns.free.size], of_mesh[:, unknowns.free.size + len(unknowns.freedoms) :]
    return sparse.csr_matrix(sparse.hstack([first, *(sparse.csr_matrix(column) for column in columns), last]))


class Coordinates(Protocol):
    """Coordinates of a system: n numbers for each field."""

    @property
    def rigid(self) -> Integers:
        """Where the free directions of rigid bodies stand among them, shape (n_rigid,)."""

    @property
    def moving(self) -> Integers:
        """Where the moving supports stand among them."""

    def components(self, dofs: Integers) -> NodalComponents:
        """Find degrees of freedom of the mesh, such as those of sites and candidates, shape (k,)."""

    def apply_map(self, matrix: sparse.csr_matrix) -> tuple[NodalComponents, Floats | sparse.csr_matrix]:
        """Return what a linear map (k, n_dofs) of the mesh's displacement takes, and the map of that."""

    def on_mesh(self, field: Floats) -> Floats:
        """Return a field (n,) or k of them (n, k) at all degrees of freedom of the mesh, zero where it is held."""

    def condense(
        self, matrix: sparse.csr_matrix, local: sparse.csr_matrix, solver: LinearSolver, reserved_bytes: int
    ) -> tuple[Condensed, Reals]:
        """Factorise and condense a matrix; see :func:`fingerslip.dynamics.step.condensation.condense`."""


@dataclass(frozen=True)
class Unknowns:
    """The unknowns of a mesh, which are its :class:`Coordinates`: n in all."""

    free: Integers  # (n_free,), free degrees of freedom among all of the mesh; they come first
    n_dofs: int  # degrees of freedom of the mesh
    freedoms: tuple[RigidFreedom, ...] = ()  # free directions of rigid bodies, driven counterfaces included
    carried: tuple[
        Integers, ...
    ] = ()  # (k,), degrees of freedom of each component of supports that move; they are last

    @property
    def count(self) -> int:
        """How many there are, n."""
        return self.free.size + len(self.freedoms) + len(self.carried)

    @cached_property
    def rigid(self) -> Integers:
        """Where the free directions of rigid bodies stand among them."""
        return self.free.size + np.arange(len(self.freedoms))

    @cached_property
    def moving(self) -> Integers:
        """Where the moving supports stand among them."""
        return self.free.size + len(self.freedoms) + np.arange(len(self.carried))

    @cached_property
    def rows(self) -> Integers:
        """The unknown of each of the mesh's degrees of freedom, shape (n_dofs,); -1 for those at rest."""
        rows = np.full(self.n_dofs, -1, dtype=np.int64)
        rows[self.free] = np.arange(self.free.size)
        for unknown, dofs in zip(self.moving, self.carried, strict=True):
            rows[dofs] = unknown
        return rows

    @cached_property
    def expansion(self) -> sparse.csr_matrix:
        """The map from the unknowns to the mesh's degrees of freedom, shape (n_dofs, n) [-]."""
        moving = np.flatnonzero(self.rows >= 0)
        return sparse.csr_matrix((np.ones(moving.size), (moving, self.rows[moving])), shape=(self.n_dofs, self.count))

    def restrict(self, forces: Floats) -> Floats:
        """Return nodal forces (n_dofs,) [N] on the unknowns, shape (n,): zero for rigid bodies, sums for supports."""
        return np.asarray(self.expansion.T @ forces)

    def project(self, matrix: sparse.csr_matrix, of_rigid: Floats | float = 0.0) -> sparse.csr_matrix:
        """Return a matrix (n_dofs, n_dofs) on the unknowns, with values (n_rigid,) of the free directions, (n, n)."""
        diagonal = np.zeros(self.count)
        diagonal[self.rigid] = of_rigid
        return sparse.csr_matrix(self.expansion.T @ matrix @ self.expansion + sparse.diags(diagonal))

    def components(self, dofs: Integers) -> NodalComponents:
        """Find degrees of freedom (k,) among the unknowns."""
        rows = self.rows[dofs]
        return NodalComponents(np.maximum(rows, 0), rows < 0)

    def apply_map(self, matrix: sparse.csr_matrix) -> tuple[NodalComponents, sparse.csr_matrix]:
        """Return the components that a map (k, n_dofs) does not ignore, and the map of these."""
        columns = np.unique(matrix.indices)
        return self.components(columns), matrix[:, columns]

    def on_mesh(self, field: Floats) -> Floats:
        """Return a field (n,) or (n, k) on all of the mesh, shape (n_dofs,) or (n_dofs, k)."""
        return np.asarray(self.expansion @ field)

    def condense(
        self, matrix: sparse.csr_matrix, local: sparse.csr_matrix, solver: LinearSolver, reserved_bytes: int
    ) -> tuple[Condensed, Reals]:
        """Factorise and condense a sparse matrix; see :func:`fingerslip.dynamics.step.condensation.condense`."""
        return condense(matrix, local, solver, reserved_bytes)
