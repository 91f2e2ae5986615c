"""A system in the coordinates of a reduced body, which a step treats as it treats one on a mesh.

The interface of the basis holds all degrees of freedom of the contact candidates and those of rigid bodies: their
constraint modes are exact. An unknown of the reduced system is a coordinate of the basis or the displacement of an
interface unknown, which follows from the coordinates but is kept beside them, so that contact reads it as it does on a
mesh.

A field is kept as the coordinates z (m,) with the displacement o = E z (p,) of the interface behind them, so that
contact candidates are read off as on a mesh. Matrices act on z alone. Forces may act on both: those on o do the
work of E^T times them on z. With [1; E] in front and behind, a diagonal matrix D of z has the solution ::

    x = [1; E] D^-1 [1, E^T] b
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
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
    """A diagonal matrix D of the coordinates, condensed: see :class:`fingerslip.dynamics.step.condensation.Condensed`.

    Halfway there are the coordinates alone: of the interface, contact needs the local displacements only.
    """

    diagonal: Floats  # (m,), D
    interface: Floats  # (p, m), E, displacement of the interface per coordinate
    local: Floats  # (c, m), local displacements of the candidates per coordinate, B [1
    description: ClassVar[str] = "reduced basis, two products a step"

    def forward(self, right_hand_side: Floats) -> Halfway:
        """Solve for b, shape (m + p,) or (m + p, k) [N], without contact forces."""
        coordinates, outside = np.split(right_hand_side, [self.diagonal.size])
        if right_hand_side.ndim == 1:
            coordinates = coordinates + weighted_rows(self.interface, outside)
        elif outside.any():
            # Forces of nodes that have left act on the interface: on few of its unknowns.
            rows = np.flatnonzero(outside.any(axis=1))
            coordinates = coordinates + self.interface[rows].T @ outside[rows]
        coordinates = self._divide(coordinates)
        return Halfway(coordinates, self.local @ coordinates)

    def backward(self, halfway: Halfway, forces: Floats, moved: Floats | None = None) -> Floats:  # noqa: ARG002
        """Return x for contact forces r, shape (c,) or (c, k) [N]."""
        added = weighted_rows(self.local, forces) if forces.ndim == 1 else self.local.T @ forces
        coordinates = halfway.vector + self._divide(added)
        return np.concatenate([coordinates, self.interface @ coordinates])

    def _divide(self, forces: Floats) -> Floats:
        """Return D^-1 b for forces on the coordinates, (m,) or (m, k)."""
        return (forces.T / self.diagonal).T


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

    def components(self, dofs: Integers) -> NodalComponents:
        """Find degrees of freedom (k,) of the interface."""
        on_mesh = self.system.coordinates.components(dofs)
        return NodalComponents(np.where(on_mesh.held, 0, self._at(on_mesh.rows, skip=on_mesh.held)), on_mesh.held)

    def apply_map(self, matrix: sparse.csr_matrix) -> tuple[NodalComponents, Floats]:
        """Return the coordinates of the basis, and a map (k, n_dofs) of the mesh's displacement as one of these."""
        every = np.arange(self.basis.eigenvalues.size)
        none = sparse.csr_matrix((matrix.shape[0], len(self.system.unknowns.freedoms)))
        of_unknowns = sparse.csr_matrix(sparse.hstack([matrix[:, self.system.free], none]))
        return NodalComponents(every, np.zeros(every.size, dtype=bool)), self.restrict(of_unknowns)

    def on_mesh(self, field: Floats) -> Floats:
        """Return a field (m + p,) or (m + p, k) at all degrees of freedom of the mesh, (n_dofs,) or (n_dofs, k)."""
        coordinates = field[: self.basis.eigenvalues.size]
        return self.system.coordinates.on_mesh(self.basis.field(self.body, coordinates))

    def condense(
        self,
        matrix: sparse.csr_matrix,
        local: sparse.csr_matrix,
        solver: LinearSolver,  # noqa: ARG002
        reserved_bytes: int,  # noqa: ARG002
    ) -> tuple[ByModes, Floats]:
        """Condense a matrix, which is diagonal."""
        diagonal, interface = matrix.diagonal()[: self.basis.eigenvalues.size], self.basis.at_interface
        moved = np.asarray(local[:, diagonal.size :] @ interface)
        scaled = moved / np.sqrt(diagonal)
        return ByModes(diagonal, interface, moved), scaled @ scaled.T

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
    """Return the unknowns of contact candidates and rigid bodies of systems, ascending, shape (p,)."""
    unknowns = [system.relative.indices for system in systems]
    return np.unique(np.concatenate([*unknowns, systems[0].coordinates.rigid])).astype(np.int64)


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

    Its matrices have nothing on the interface.
    """
    coordinates, velocity = ReducedCoordinates(system, body, basis), system.initial_velocity
    size, behind = basis.eigenvalues.size, np.zeros(basis.interface.size)

    def project(forces: Floats) -> Floats:
        return basis.project(body, forces) if forces.any() else np.zeros((size, *forces.shape[1:]))

    if twin is None:
        diagonals = basis.eigenvalues, np.ones(size)
        stiffness, mass = (sparse.diags(np.concatenate([part, behind]), format="csr") for part in diagonals)
        # Linear maps (r, n) of the mesh's unknowns as those of coordinates and interface, (r, m + p).
        rows = (sparse.csr_matrix(matrix) for matrix in (system.supports.stiffness, system.supports.mass))
        held = [
            np.hstack([project(np.asarray(row.T.todense())).T, np.zeros((row.shape[0], behind.size))]) for row in rows
        ]
    else:
        stiffness, mass, held = twin.stiffness, twin.mass, [np.asarray(twin.supports.stiffness), twin.supports.mass]
    start = project(system.mass @ velocity)
    none = sparse.csr_matrix((system.relative.shape[0], size))
    return replace(
        system,
        coordinates=coordinates,
        stiffness=stiffness,
        mass=mass,
        loads=tuple(replace(load, forces=np.concatenate([project(load.forces), behind])) for load in system.loads),
        initial_velocity=np.concatenate([start, basis.at_interface @ start]),
        relative=sparse.csr_matrix(sparse.hstack([none, system.relative[:, basis.interface]])),
        outsiders=tuple(
            replace(outsider, relative=coordinates.restrict(sparse.csr_matrix(outsider.relative)))
            for outsider in system.outsiders
        ),
        supports=replace(system.supports, stiffness=held[0], mass=held[1]),
    )
