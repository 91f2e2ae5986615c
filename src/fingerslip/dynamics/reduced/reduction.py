"""A system in the coordinates of a reduced body, which a step treats as it treats one on a mesh.

The interface of the basis holds all degrees of freedom of the contact candidates and those of rigid bodies: their
constraint modes are exact.

A field is kept as the coordinates z (m,) with the displacement o = E z (p,) of the interface behind them, so that
contact candidates are read off as on a mesh. Moving supports are the last of o, where E is zero. Matrices act on z and
on these; dampers of rigid bodies, and forces, may act on all: forces on o do the work of E^T times them on z. With
[1; E] in front and behind, a diagonal matrix D of z with B of dampers on o has the solution ::

    x = [1; E] (D + E^T B E)^-1 [1, E^T] b
    (D + E^T B E)^-1 = D^-1 - H^T E D^-1,    H = (B^-1 + E D^-1 E^T)^-1 E D^-1
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from scipy import sparse

from fingerslip.arrays import Flags, Floats, Integers
from fingerslip.dynamics.step.condensation import Halfway
from fingerslip.dynamics.system.operators import NodalComponents
from fingerslip.dynamics.system.system import System
from fingerslip.fe.recovery import site_recovery
from fingerslip.fe.space import vector_dofs
from fingerslip.linear.craig_bampton import ConstraintModes, CraigBampton
from fingerslip.linear.solver import LinearSolver
from fingerslip.linear.symmetric import weighted_rows
from fingerslip.model.model import Model


@dataclass(frozen=True)
class ByModes:
    """A matrix D + E^T B E of the coordinates, condensed: see :class:`fingerslip.dynamics.step.condensation.Condensed`.

    Halfway there are the coordinates alone: of the interface, contact needs the local displacements only.
    """

    diagonal: Floats  # (m,), D
    interface: Floats  # (p, m), E, displacement of the interface per coordinate
    local: Floats  # (c, m), local displacements of the candidates per coordinate
    damped: Floats  # (r, m), E where dampers act
    relief: Floats  # (r, m), H
    description: ClassVar[str] = "reduced basis, two products a step"

    def forward(self, right_hand_side: Floats) -> Halfway:
        """Solve for b, shape (m + p,) or (m + p, k) [N], without contact forces."""
        coordinates, outside = np.split(right_hand_side, [self.diagonal.size])
        # Forces of nodes that have left and of dampers act on the interface: on few of its unknowns.
        rows = np.unique(np.nonzero(outside)[0])
        coordinates = self._divide(coordinates + self.interface[rows].T @ outside[rows])
        return Halfway(coordinates, self.local @ coordinates)

    def backward(self, halfway: Halfway, forces: Floats, moved: Floats | None = None) -> Floats:  # noqa: ARG002
        """Return x for contact forces r, shape (c,) or (c, k) [N]."""
        added = weighted_rows(self.local, forces) if forces.ndim == 1 else self.local.T @ forces
        coordinates = halfway.vector + self._divide(added)
        return np.concatenate([coordinates, self.interface @ coordinates])

    def _divide(self, forces: Floats) -> Floats:
        """Solve for forces b on the coordinates, (m,) or (m, k)."""
        divided: Floats = (forces.T / self.diagonal).T
        return divided - self.relief.T @ (self.damped @ divided) if self.damped.size else divided


_MOST_RESPONSES = 500  # forces at sites


@dataclass(frozen=True)
class ReducedCoordinates:
    """Coordinates of a reduced body with the displacement of its interface; see :class:`.coordinates.Coordinates`."""

    system: System  # the system on the mesh
    body: ConstraintModes  # its body and interface
    basis: CraigBampton  # the reduced basis

    @property
    def rigid(self) -> Integers:
        """Where the free directions of rigid bodies stand: they are of the interface."""
        return self._at(self.system.unknowns.rigid)

    @property
    def moving(self) -> Integers:
        """Where moving supports stand among them: they are the last of the interface."""
        return self._at(self.system.unknowns.moving)

    @cached_property
    def on_basis(self) -> Integers:
        """Where the coordinates of the basis, supports included, stand among them."""
        return np.concatenate([np.arange(self.basis.eigenvalues.size), self.moving])

    def components(self, dofs: Integers) -> NodalComponents:
        """Find degrees of freedom (k,) of the interface."""
        on_mesh = self.system.coordinates.components(dofs)
        return NodalComponents(np.where(on_mesh.held, 0, self._at(on_mesh.rows, skip=on_mesh.held)), on_mesh.held)

    def apply_map(self, matrix: sparse.csr_matrix) -> tuple[NodalComponents, Floats]:
        """Return the coordinates of the basis, and a map (k, n_dofs) of the mesh's displacement as one of these."""
        of_unknowns = sparse.csr_matrix(matrix @ self.system.unknowns.expansion)
        return NodalComponents(self.on_basis, np.zeros(self.on_basis.size, dtype=bool)), self.restrict(of_unknowns)

    def on_mesh(self, field: Floats) -> Floats:
        """Return a field (m + p,) or (m + p, k) at all degrees of freedom of the mesh, (n_dofs,) or (n_dofs, k)."""
        return self.system.coordinates.on_mesh(self.basis.field(self.body, field[self.on_basis]))

    def spread(self, values: Floats) -> Floats:
        """Return forces, or maps of the coordinates of the basis, (..., m), on all coordinates; zero at the others."""
        result = np.zeros((*values.shape[:-1], self.basis.eigenvalues.size + self.basis.interface.size))
        result[..., self.on_basis] = values
        return result

    def condense(
        self,
        matrix: sparse.csr_matrix,
        local: sparse.csr_matrix,
        solver: LinearSolver,  # noqa: ARG002
        reserved_bytes: int,  # noqa: ARG002
    ) -> tuple[ByModes, Floats]:
        """Condense a matrix, which is diagonal on all that moves freely."""
        size = self.basis.eigenvalues.size
        diagonal, behind = np.split(matrix.diagonal(), [size])
        behind[self.moving - size] = 0.0
        interface = np.ascontiguousarray(self.basis.at_interface[:, :size])
        moved = np.asarray(local[:, size:] @ interface)
        scaled = moved / np.sqrt(diagonal)
        compliance = scaled @ scaled.T
        damped = interface[np.flatnonzero(behind)]
        divided = damped / diagonal
        relief = np.linalg.solve(np.diag(1.0 / behind[behind != 0.0]) + damped @ divided.T, divided)
        if damped.size:
            compliance -= (moved @ relief.T) @ (divided @ moved.T)
            compliance = 0.5 * (compliance + compliance.T)
        return ByModes(diagonal, interface, moved, damped, relief), compliance

    def matrix(self, diagonal: Floats, rows: Floats) -> sparse.csr_matrix:
        """Return a matrix that is diagonal but for rows (k, m) and columns of moving supports, (m + p, m + p)."""
        shape = (diagonal.size + self.basis.interface.size,) * 2
        halved = np.hstack([rows[:, : diagonal.size], 0.5 * rows[:, diagonal.size :]])
        at = np.repeat(self.moving, rows.shape[1]), np.tile(self.on_basis, len(rows))
        border = sparse.csr_matrix((halved.ravel(), at), shape=shape)
        inner = sparse.csr_matrix((diagonal, [np.arange(diagonal.size)] * 2), shape=shape)
        return sparse.csr_matrix(inner + border + border.T)

    def restrict(self, matrix: sparse.csr_matrix) -> Floats:
        """Return a map (k, n) of the mesh's unknowns as a map of the coordinates, shape (k, m).

        It may read the interface and the further rows of the basis alone.
        """
        product: Floats = matrix[:, self.basis.interface] @ self.basis.at_interface
        product += matrix[:, self.basis.rows] @ self.basis.at_rows
        return product

    def _at(self, unknowns: Integers, skip: Flags | None = None) -> Integers:
        """Return where unknowns (k,) of the mesh stand among the interface, but for some that are skipped."""
        interface = self.basis.interface
        position = np.minimum(np.searchsorted(interface, unknowns), interface.size - 1)
        wanted = np.ones(unknowns.size, dtype=bool) if skip is None else ~skip
        assert (interface[position[wanted]] == unknowns[wanted]).all(), "is no unknown of the interface"
        return self.basis.eigenvalues.size + position


def interface_unknowns(systems: Sequence[System]) -> Integers:
    """Return the unknowns of contact candidates, rigid bodies and moving supports of systems, ascending, shape (p,)."""
    unknowns, coordinates = [system.relative.indices for system in systems], systems[0].coordinates
    return np.unique(np.concatenate([*unknowns, coordinates.rigid, coordinates.moving])).astype(np.int64)


def observed_unknowns(models: Sequence[Model], systems: Sequence[System]) -> Integers:
    """Return the unknowns that sites and checks of the other boundary nodes read, ascending, shape (r,)."""
    outside = [sparse.csr_matrix(outsider.relative).indices for system in systems for outsider in system.outsiders]
    regions = [tuple(site.region for site in model.record.sites) for model in models]
    # Motions mostly record the same sites.
    recorded = {
        (system.site_nodes.tobytes(), region): (system, region) for system, region in zip(systems, regions, strict=True)
    }
    at_sites = []
    for system, region in recorded.values():
        strained = site_recovery(system.space, system.materials, system.site_nodes, region).strain
        sites = vector_dofs(system.site_nodes, system.space.dim).ravel()
        components = system.coordinates.components(np.union1d(sites, strained.indices))
        at_sites.append(components.rows[~components.held])
    return np.setdiff1d(np.concatenate([*outside, *at_sites]), interface_unknowns(systems)).astype(np.int64)


def further_shapes(body: ConstraintModes, systems: Sequence[System]) -> list[Floats]:
    """Return what a basis has to hold beside contact and normal modes: responses to loads, and how motions start."""
    forces = {load.forces.tobytes(): load.forces for system in systems for load in system.loads if load.forces.any()}
    velocities = {
        element.tobytes(): element for element in (system.initial_velocity for system in systems) if element.any()
    }
    if not (forces or velocities):
        return []
    # Loads and stiffness damping accelerate the body at the start.
    pushes = [*forces.values(), *(body.stiffness @ velocity for velocity in velocities.values())]
    factor = body.solver.factorise(body.mass)
    fields = [*(factor.backward(factor.forward(push)) for push in pushes), *velocities.values()]
    responses = [body.give_way(force) for force in forces.values()]
    return responses + [field - body.follow(field[body.interface]) for field in fields]


def site_unknowns(systems: Sequence[System]) -> Integers:
    """Return the unknowns of sites that are none of the interface, (k,); of very many, some that are evenly spread."""
    nodes = np.unique(np.concatenate([system.site_nodes for system in systems]))
    components = systems[0].coordinates.components(vector_dofs(nodes, systems[0].space.dim).ravel())
    unknowns = np.setdiff1d(components.rows[~components.held], interface_unknowns(systems))
    return unknowns[:: 1 + unknowns.size // _MOST_RESPONSES]


def site_responses(body: ConstraintModes, systems: Sequence[System]) -> Floats:
    """Return the displacements (n, k) [m] under a unit force at each site while the interface is held.

    A motion is read at a site as well as its response to a force there is held by the basis.
    """
    unknowns = site_unknowns(systems)
    forces = np.zeros((body.stiffness.shape[0], unknowns.size), order="F")
    forces[unknowns, np.arange(unknowns.size)] = 1.0
    return body.give_way(forces)


def reduced_system(system: System, body: ConstraintModes, basis: CraigBampton, twin: System | None = None) -> System:
    """Return a system in the coordinates of a reduced body; one that shares its matrices with a twin takes them over.

    Its matrices have nothing on the interface but on moving supports.
    """
    coordinates = ReducedCoordinates(system, body, basis)
    size, unknowns = basis.eigenvalues.size, basis.eigenvalues.size + basis.interface.size

    def project(forces: Floats) -> Floats:
        """Return forces (n,) or (k, n) on the mesh's unknowns on coordinates and interface, (m + p,) or (k, m + p)."""
        if not forces.any():
            return np.zeros((*forces.shape[:-1], unknowns))
        return coordinates.spread(basis.project(body, forces.T).T)

    if twin is None:
        stiffness, mass = map(coordinates.matrix, (basis.eigenvalues, np.ones(size)), basis.prescribed)
        rows = (sparse.csr_matrix(matrix) for matrix in (system.supports.stiffness, system.supports.mass))
        held = [project(row.toarray()) for row in rows]
    else:
        stiffness, mass, held = twin.stiffness, twin.mass, [np.asarray(twin.supports.stiffness), twin.supports.mass]
    start = project(system.mass @ system.initial_velocity)[:size]
    none = sparse.csr_matrix((system.relative.shape[0], size))
    dampers = None if system.dampers is None else np.zeros(unknowns)
    if dampers is not None and system.dampers is not None:
        dampers[coordinates.rigid] = system.dampers[system.coordinates.rigid]
    return replace(
        system,
        coordinates=coordinates,
        stiffness=stiffness,
        mass=mass,
        loads=tuple(replace(load, forces=project(load.forces)) for load in system.loads),
        initial_velocity=np.concatenate([start, basis.at_interface[:, :size] @ start]),
        relative=sparse.csr_matrix(sparse.hstack([none, system.relative[:, basis.interface]])),
        outsiders=tuple(
            replace(outsider, relative=coordinates.spread(coordinates.restrict(sparse.csr_matrix(outsider.relative))))
            for outsider in system.outsiders
        ),
        supports=replace(system.supports, stiffness=held[0], mass=held[1]),
        dampers=dampers,
    )
