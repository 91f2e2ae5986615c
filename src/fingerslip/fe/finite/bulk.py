"""A body at large strain: its nodal forces, strain energy and stiffness at a displacement."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.arrays import Floats, Integers
from fingerslip.errors import InvertedCellError
from fingerslip.fe.cell_materials import CellMaterials
from fingerslip.fe.finite.history import (
    Deformed,
    Left,
    Relaxation,
    end_history,
    members_of,
    relaxation_of,
    selective_excess,
    spring_excess,
)
from fingerslip.fe.finite.history_kernels import add_forces, add_stiffness, add_thickness, push_forward
from fingerslip.fe.finite.kernels import (
    add_blocks,
    nodal_forces,
    nodal_forces_2d,
    stiffness_of_cells,
    strains,
    strains_2d,
    volume_slopes,
)
from fingerslip.fe.finite.powers import PointLaws, laws_of_points
from fingerslip.fe.finite.thickness import Pulled, thickness_strain
from fingerslip.fe.finite.volumes import Volumes, mean_volumes, selective_energy
from fingerslip.fe.integration import Integration, check_integration
from fingerslip.fe.recovery import cell_dofs, shape_gradients
from fingerslip.fe.space import Space
from fingerslip.materials.large_strain import FiniteMaterial, log_volume_of
from fingerslip.materials.relaxing import StepLaw

# Added to all entries of a tangent [N/m].
_SWALLOWED = 1e-200


@dataclass(frozen=True)
class LargeStrain:
    """The mesh and the laws of a body at large strain."""

    space: Space  # displacement space
    materials: CellMaterials[FiniteMaterial]  # of every cell
    gradients: Floats  # (n_cells, n_q, n_nodes, dim), gradients of the shape functions in the reference state [1/m]
    nodes: Integers  # (n_cells, n_nodes), nodes of the cells
    weights: Floats  # (n_cells, n_q), reference volumes of the quadrature points [m^3]
    volumes: Volumes | None  # groups over which volumes are averaged
    relaxation: Relaxation | None = None  # how it relaxes

    def at_rest(self, step: float) -> Deformed:
        """Return the body that has never moved, at the end of a step [s]."""
        state = self.deformed(np.zeros(self.space.n_dofs))
        return state if self.relaxation is None else self.begun(replace(state, history=self.relaxation.at_rest()), step)

    def begun(self, state: Deformed, step: float) -> Deformed:
        """Return a body at the start of a step [s], near which its end is searched."""
        if self.relaxation is None or state.history is None:
            return state
        left = self.relaxation.left(state.history, step)
        return replace(state, left=left, pulled=self._start_part(state, left))

    def ended(self, state: Deformed) -> Deformed:
        """Return a body at the end of a step with what it remembers."""
        if self.relaxation is None:
            return state
        return replace(state, history=end_history(self.relaxation, self.materials.materials, state))

    def deformed(self, displacement: Floats, near: Deformed | None = None) -> Deformed:
        """Return the body at a displacement (n_dofs,) [m]; an error where a cell is turned inside out.

        `near` is the body at one near it in the same step, from which the thickness in plane stress is searched.
        """
        count, dim = self.weights.size, self.space.dim
        arrays = np.empty((count, dim, dim)), np.empty((count, dim)), np.empty((count, dim, dim))
        compiled = strains_2d if dim == 2 else strains
        worst = compiled(self.gradients, self.nodes, displacement.reshape(-1, dim), *arrays)
        if worst >= 0:
            centre = self.space.mesh.p[:, self.space.mesh.t[:, worst]].mean(axis=1)
            raise InvertedCellError(int(worst), tuple(centre.tolist()))
        # Components one after the other, which passes over all points read.
        log_strain = np.zeros((count, 3), order="F")
        log_strain[:, :dim] = 0.5 * np.log(arrays[1])
        if near is not None and self.materials.formulation == "plane_stress":
            # An incompressible body keeps its volume.
            log_strain[:, 2] = near.log_strain[:, 2] + near.log_volume - log_volume_of(log_strain[:, :2])
        left, history = (None, None) if near is None else (near.left, near.history)
        return self._with_stresses(Deformed(*arrays, log_strain, np.zeros((0, 3)), None, None, left, None, history))

    def force(self, state: Deformed) -> Floats:
        """Return the forces of the nodes on the body, shape (n_dofs,) [N]."""
        forces = np.zeros_like(self.space.positions)
        fields = state.deformation, state.squared, state.directions, state.stress
        compiled = nodal_forces_2d if self.space.dim == 2 else nodal_forces
        compiled(self.gradients, self.nodes, self.weights.ravel(), *fields, forces)
        if state.pulled is not None:
            add_forces(self.gradients, self.nodes, self.weights.ravel(), state.deformation, state.pulled, forces)
        return forces.ravel()

    def energy(self, state: Deformed) -> float:
        """Return the strain energy, in bodies that relax what springs store [J]."""
        energy = float(self.weights.ravel() @ self._point_densities(state, np.arange(self.weights.size)))
        return energy if self.volumes is None else energy + float(self.volumes.size @ self._group_densities(state))

    def energy_densities(self, state: Deformed, points: Integers) -> Floats:
        """Return the strain energy per reference volume [J/m^3] at quadrature points (k,), shape (k,).

        That of a group with a mean volume is spread evenly over its points.
        """
        density = self._point_densities(state, points)
        if self.volumes is not None:
            density += (self._spread @ self._group_densities(state))[points]
        return density

    def _group_densities(self, state: Deformed) -> Floats:
        """Return what groups with a mean volume store, shape (n_groups,) [J/m^3]."""
        density = self._selective_energy(np.log(np.asarray(state.mean_volume)), 0, of=1)
        if state.history is not None and self.relaxation is not None:
            for number, (_, _, groups) in enumerate(self._parts()):
                constants, history = self.relaxation.constants[number], state.history.groups[:, groups]
                density[groups] += selective_excess(constants, self.materials.formulation, history)
        return density

    def _point_densities(self, state: Deformed, points: Integers) -> Floats:
        """Return what points (k,) store beside their groups, shape (k,) [J/m^3]."""
        if self._laws is not None and self.relaxation is None:
            return self._laws.energy(points, state.squared, state.log_strain, self._selective_moduli[0])
        density, number = np.empty(len(points)), self._point_materials[points]
        for element, material in enumerate(self.materials.materials):
            strains = state.log_strain[points[number == element]]
            energy = material.stored_energy(strains)
            if self.volumes is not None:
                log_volume = log_volume_of(strains[:, : self.space.dim])
                energy = energy - selective_energy(material, self.materials.formulation, log_volume)[0]
            if self.relaxation is not None:
                energy = energy + self._point_excess(self.relaxation, element, state, points[number == element])
            density[number == element] = energy
        return density

    def _point_excess(self, relaxation: Relaxation, number: int, state: Deformed, points: Integers) -> Floats:
        """Return by how much bodies that relax store more than elastic ones at points (k,), shape (k,) [J/m^3]."""
        material, history = self.materials.materials[number], state.history
        excess = spring_excess(relaxation, number, material, state, points)
        if self.volumes is None or history is None:
            return excess
        of_volume = history.points[:, points, -2:]
        return excess - selective_excess(relaxation.constants[number], relaxation.formulation, of_volume)

    @cached_property
    def _spread(self) -> sparse.csr_matrix:
        """The map that spreads densities of groups over quadrature points, shape (n_p, n_groups) [-]."""
        volumes = self._volumes
        of_points = sparse.diags(1.0 / self.weights.ravel()) @ volumes.mean.T @ sparse.diags(volumes.size)
        return sparse.csr_matrix(of_points)

    def tangent(self, state: Deformed, *, positive: bool = False) -> sparse.csr_matrix:
        """Return the derivative of the force by the displacement, shape (n_dofs, n_dofs) [N/m].

        With `positive`, what would make the stiffness of a point indefinite is left out.
        """
        size = self.nodes.shape[1] * self.space.dim
        matrices = np.empty((len(self.nodes), size, size))
        fields = state.deformation, state.squared, state.directions, state.stress
        moduli = self._moduli(state, positive=positive)
        stiffness_of_cells(self.gradients, self.weights.ravel(), *fields, moduli, positive, matrices)
        if state.pulled is not None and not positive:
            self._add_start_part(state, state.pulled, matrices)
        total = self._assemble(matrices)
        if self.volumes is not None and state.mean_volume is not None:
            of_points = np.empty((self.weights.size, *self.gradients.shape[2:]))
            volume_slopes(self.gradients, state.deformation, state.squared, state.directions, of_points)
            slopes, weights = self._of_volumes(of_points), self._mean_curvature(state)
            if positive:
                weights = np.maximum(weights, 0.0)
            total = total + slopes.T @ sparse.diags(weights) @ slopes
        return sparse.csr_matrix(total + self._everywhere)

    @cached_property
    def _everywhere(self) -> sparse.csr_matrix:
        """What rounding swallows, in all entries of a tangent: sums drop zeros, and a new pattern is analysed again."""
        corners = self.nodes.shape[1] * self.space.dim
        total = self._assemble(np.ones((len(self.nodes), corners, corners)))
        if self.volumes is not None:
            slopes = self._of_volumes(np.ones((*self.gradients.shape[:3], self.space.dim)))
            total = total + abs(slopes).T @ abs(slopes)
        total.data[:] = _SWALLOWED
        return sparse.csr_matrix(total)

    def _assemble(self, matrices: Floats) -> sparse.csr_matrix:
        """Return the sum of the matrices of cells (n_cells, n_local, n_local), shape (n_dofs, n_dofs); zeros stay."""
        dim, size, (pairs, neighbours, starts) = self.space.dim, self.space.n_dofs, self._pattern
        blocks = np.zeros((neighbours.size, dim, dim))
        add_blocks(matrices, pairs, blocks)
        return sparse.csr_matrix(sparse.bsr_matrix((blocks, neighbours, starts), shape=(size, size)))

    @cached_property
    def _pattern(self) -> tuple[NDArray[np.int32], ...]:
        """The numbers of the pairs of nodes of cells, (n_cells, n_nodes, n_nodes), and these pairs by rows."""
        count, (cells, corners) = len(self.space.positions), self.nodes.shape
        first, second = np.repeat(self.nodes, corners, axis=1).ravel(), np.tile(self.nodes, (1, corners)).ravel()
        pairs, number = np.unique(first * count + second, return_inverse=True)
        starts = np.searchsorted(pairs, np.arange(count + 1) * count)
        number = number.reshape(cells, corners, corners)
        return number.astype(np.int32), (pairs % count).astype(np.int32), starts.astype(np.int32)

    def _with_stresses(self, state: Deformed) -> Deformed:
        """Return a state with its stresses, and in plane stress its thickness."""
        is_free = self.materials.formulation == "plane_stress"
        if self._laws is not None and state.left is None:
            thickness = self._laws.thickness(state.log_strain) if is_free else state.log_strain[:, 2]
            if thickness is not None:
                state.log_strain[:, 2] = thickness
                return self._with_pressures(state, self._laws.stress(state.log_strain))
        # A law of a user's own, or one whose thickness was not found, which the error names.
        stress = np.empty_like(state.log_strain)
        for number, (material, points, _) in enumerate(self._parts()):
            strain, law = state.log_strain[points], self._law(number, material, state.left, points)
            if is_free:
                across = self._across(state, points) if law is not material else None
                state.log_strain[points, 2] = strain[:, 2] = thickness_strain(law, strain, across)
            stress[points] = law.kirchhoff_stress(strain)
        if state.left is not None:
            state = replace(state, pulled=self._start_part(state, state.left))
        return self._with_pressures(state, stress)

    def _with_pressures(self, state: Deformed, stress: Floats) -> Deformed:
        """Return a state with the stresses (n_p, 3) [Pa] of its points, to which the mean volumes add."""
        if self.volumes is None:
            return replace(state, stress=stress)
        volume = state.volume
        mean = self.volumes.mean @ volume
        # What the mean volumes of groups make the points feel.
        log_mean = np.log(mean)
        slope = self._selective_energy(log_mean, 1, of=1)
        if state.left is not None:
            slope += state.left.moduli[self.volumes.material] * log_mean + state.left.group_offsets
        pressure = self._spread @ (slope / mean)
        added = pressure * volume - self._selective(state, 1)
        for k in range(2 if self.materials.formulation == "plane_stress" else 3):
            stress[:, k] += added
        return replace(state, stress=stress, mean_volume=mean, pressure=pressure)

    def _law(
        self, number: int, material: FiniteMaterial, left: Left | None, points: Integers | slice
    ) -> FiniteMaterial | StepLaw:
        """Return the law of a material at the end of a step."""
        if left is None or self.relaxation is None or not self.relaxation.constants[number].prony:
            return material
        share, pressure = left.terms[number].taken_share, left.points[points, self.relaxation.tensor]
        return StepLaw(material, share, pressure)

    def _across(self, state: Deformed, points: Integers | slice) -> Pulled | None:
        """Return what the start of a step leaves in the stress across the plane."""
        if state.left is None:
            return None
        first, other, beside, across = state.left.points[points, :4].T
        (xx, xy), (yx, yy) = state.deformation[points].transpose(1, 2, 0)
        in_plane = first * (xx**2 + yx**2) + other * (xy**2 + yy**2) + 2.0 * beside * (xx * xy + yx * yy)
        return Pulled(in_plane, across)

    def _start_part(self, state: Deformed, left: Left) -> Floats:
        """Return what of the stress at all points the start of a step takes, packed, shape (n_p, k) [Pa]."""
        pulled = np.empty((len(left.points), left.points.shape[1] - 3))
        push_forward(state.deformation, state.log_strain, left.points, pulled)
        return pulled

    def _add_start_part(self, state: Deformed, pulled: Floats, matrices: Floats) -> None:
        """Add the stiffness of what the start of a step leaves, and in plane stress that of the thickness."""
        weights = self.weights.ravel()
        add_stiffness(self.gradients, weights, state.deformation, pulled, matrices)
        if self.materials.formulation != "plane_stress":
            return
        across = self._tangents(state)[:, :, 2]
        stiffness = across[:, 2] - 2.0 / 9.0 * (pulled[:, 0] + pulled[:, 1]) - 8.0 / 9.0 * pulled[:, 3]
        fields = state.deformation, state.squared, state.directions
        add_thickness(self.gradients, weights, *fields, across[:, :2].copy(), pulled, stiffness, matrices)

    def _selective(self, state: Deformed, derivative: int) -> Floats:
        """Return the first or second derivative of the selective energy at all points, shape (n_p,) [Pa]."""
        log_volume, left = state.log_volume, state.left
        values = self._selective_energy(log_volume, derivative, of=0)
        if left is not None and self.relaxation is not None:
            moduli = left.moduli[self.relaxation.points]
            values += moduli * log_volume + left.offsets if derivative == 1 else moduli
        return values

    def _tangents(self, state: Deformed) -> Floats:
        """Return the derivative of the stresses of the laws by the logarithmic strains, shape (n_p, 3, 3) [Pa]."""
        moduli = np.empty((len(state.log_strain), 3, 3))
        for number, (material, points, _) in enumerate(self._parts()):
            law = self._law(number, material, state.left, points)
            moduli[points] = law.kirchhoff_tangent(state.log_strain[points])
        return moduli

    def _moduli(self, state: Deformed, *, positive: bool) -> Floats:
        """Return the derivative of the stresses at fixed pressures of mean volumes, shape (n_p, dim, dim) [Pa]."""
        dim, moduli = self.space.dim, self._tangents(state)
        # Where the start of a step leaves something, the thickness gives way to this as well.
        if self.materials.formulation == "plane_stress" and (state.pulled is None or positive):
            across = moduli[:, :2, 2]
            moduli[:, :2, :2] -= across[:, :, None] * across[:, None, :] / moduli[:, 2, 2][:, None, None]
        moduli = np.ascontiguousarray(moduli[:, :dim, :dim])
        if state.pressure is not None:
            added = state.pressure * state.volume - self._selective(state, 2)
            moduli += added[:, None, None]
        return moduli

    def _mean_curvature(self, state: Deformed) -> Floats:
        """Return the second derivative of the groups' energies by their mean volumes, shape (n_groups,) [J]."""
        mean = np.asarray(state.mean_volume)
        log_mean = np.log(mean)
        slope, second = (self._selective_energy(log_mean, derivative, of=1) for derivative in (1, 2))
        if state.left is not None:
            modulus = state.left.moduli[self._volumes.material]
            second = second + modulus
            slope = slope + modulus * log_mean + state.left.group_offsets
        return np.asarray(self._volumes.size * (second - slope) / mean**2)

    def _of_volumes(self, slopes: Floats) -> sparse.csr_matrix:
        """Return the matrix (n_groups, n_dofs) of slopes of the points' volumes (n_points, n_corners, dim) [1/m]."""
        cells, points, corners, dim = self.gradients.shape
        columns = np.repeat(cell_dofs(self.space.full, np.arange(cells)), points, axis=0).ravel()
        starts = np.arange(cells * points + 1) * corners * dim
        of_points = sparse.csr_matrix((slopes.ravel(), columns, starts), shape=(cells * points, self.space.n_dofs))
        return sparse.csr_matrix(self._volumes.mean @ of_points)

    def _selective_energy(self, log_volume: Floats, derivative: int, of: int) -> Floats:
        """Return the selective energy or a derivative of all points, `of` 0, or groups, 1, at ln J (n,), (n,) [Pa]."""
        if self._laws is not None:
            exact = self._selective_moduli[of] * log_volume ** (2 - derivative)
            return np.asarray(exact if derivative else 0.5 * exact)
        values = np.empty_like(log_volume)
        for material, rows in zip(self.materials.materials, self._members[of], strict=True):
            values[rows] = selective_energy(material, self.materials.formulation, log_volume[rows])[derivative]
        return values

    @cached_property
    def _laws(self) -> PointLaws | None:
        """The laws of all quadrature points at once, where they are sums of powers."""
        return laws_of_points(self.materials.materials, self._point_materials)

    @cached_property
    def _selective_moduli(self) -> tuple[Floats, Floats]:
        """Second derivatives of the selective energies of points and groups, where they do not change [Pa]."""
        laws, formulation = [law.at_rest() for law in self.materials.materials], self.materials.formulation
        moduli = np.array([law.dilatational_modulus(formulation) if self.volumes else 0.0 for law in laws])
        return moduli[self._point_materials], moduli[self._group_materials]

    @cached_property
    def _point_materials(self) -> Integers:
        """Index of the material of every quadrature point, shape (n_p,)."""
        return np.repeat(self.materials.number, self.weights.shape[1])

    @property
    def _group_materials(self) -> Integers:
        """Index of the material of every group, shape (n_groups,)."""
        return np.zeros(0, dtype=np.int64) if self.volumes is None else self.volumes.material

    @property
    def _volumes(self) -> Volumes:
        if self.volumes is None:
            raise ValueError("every point stands for itself")
        return self.volumes

    def _parts(self) -> Iterator[tuple[FiniteMaterial, Integers | slice, Integers | slice]]:
        """Yield every material with its quadrature points and its groups."""
        yield from zip(self.materials.materials, *self._members, strict=True)

    @cached_property
    def _members(self) -> tuple[list[Integers | slice], list[Integers | slice]]:
        points, groups = self._point_materials, self._group_materials
        every = range(len(self.materials.materials))
        return [members_of(points, number) for number in every], [members_of(groups, number) for number in every]


def large_strain(
    space: Space, materials: CellMaterials[FiniteMaterial], depth: float, integration: Integration
) -> LargeStrain:
    """Return a body at large strain, of a depth [m]."""
    check_integration(space.element, integration)
    every = np.arange(space.mesh.nelements)
    weights = depth * np.ascontiguousarray(space.full.dx)
    volumes = None if integration == "full" else mean_volumes(space, materials, weights, integration)
    nodes = np.ascontiguousarray(space.full.element_dofs.T, dtype=np.int64)
    relaxation = relaxation_of(materials, weights.shape[1], volumes)
    return LargeStrain(space, materials, shape_gradients(space.full, every), nodes, weights, volumes, relaxation)
