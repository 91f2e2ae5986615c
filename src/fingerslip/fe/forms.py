"""Stiffness, mass and load of small-strain laws, assembled from the matrices of the cells.

Viscoelastic layers alike have one set of matrices. With the displacement u and y = sum s_i z_i of dashpots z_i in the
nodes (:mod:`fingerslip.materials.prony`) their elastic force K u becomes K u - S y. In solids and plane strain S
belongs to the deviator of the strain.

In plane stress the strain across the plane adjusts itself, so that it has a history of its own: it is -div w with a
displacement w of dashpots q_i, that of :class:`~fingerslip.materials.viscoelastic.OutOfPlane` in every node. With R of
a field that field less sum s_i times its dashpots, the force is that of the stress along the plane less that across it,
A R[u] + B R[w]: S is A, and T, which is B, times w - c u - sum s_i q_i comes on top.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.arrays import Floats, Integers
from fingerslip.errors import InputError
from fingerslip.fe.cell_materials import CellMaterials, Law
from fingerslip.fe.integration import Integration, check_integration, is_mean_of_cell
from fingerslip.fe.recovery import cell_dofs, divergence_operator, matrix_of_rows, strain_operator
from fingerslip.fe.space import Space, nodal_areas
from fingerslip.materials.elastic import Elastic, hooke_tangent
from fingerslip.materials.material import STRAIN_COMPONENTS, Material
from fingerslip.materials.prony import Prony
from fingerslip.materials.viscoelastic import OutOfPlane, across_of

# Cells whose matrices are computed at once: enough for the arithmetic, few enough for the processor's cache.
_CHUNK = 1024


def stiffness_matrix(
    space: Space, materials: CellMaterials[Material], depth: float, integration: Integration
) -> sparse.csr_matrix:
    """Assemble the stiffness matrix [N/m] at rest from the tangents of the material laws.

    Three ways to integrate the dilatational part of the tangent. 'selective': from the mean dilatation of each cell in
    Q4 and H8, which then do not lock near incompressibility (for Q4 that is the value at the centre, Malkus & Hughes
    1978; for H8 the mean also passes the patch test), fully in all others. 'full': fully, which locks.
    'nodal': from the mean dilatation of the cells around each node, material by material, so that linear
    triangles and tetrahedra do not lock either (Bonet & Burton 1998).
    """
    check_integration(space.element, integration)
    everywhere = np.arange(space.mesh.nelements)
    matrices = _stiffness_of_cells(space, materials, integration)
    stiffness = _sum_cells(matrices, cell_dofs(space.full, everywhere), space.n_dofs)
    if integration == "nodal":
        moduli = [material.dilatational_modulus(materials.formulation) for material in materials.materials]
        stiffness = stiffness + _nodal_dilatation(space, np.array(moduli)[materials.number])
    return sparse.csr_matrix(depth * stiffness)


def _stiffness_of_cells(space: Space, materials: CellMaterials[Material], integration: Integration) -> Floats:
    """Return the stiffness of every cell per unit depth, shape (n_cells, n_local, n_local) [Pa]."""
    size = space.dim * space.full.Nbfun
    matrices = np.empty((space.mesh.nelements, size, size))
    for material, element in materials:
        modulus = material.dilatational_modulus(materials.formulation)
        rest = np.zeros((1, STRAIN_COMPONENTS[space.dim]))
        tangent = np.array(material.tangent(rest, materials.formulation)[0])
        if integration == "nodal" or is_mean_of_cell(space.element, integration):
            tangent[: space.dim, : space.dim] -= modulus
        for cells in _chunks(element):
            matrices[cells] = _integrate(space, cells, tangent)
            if is_mean_of_cell(space.element, integration):
                matrices[cells] += _mean_dilatation(space, cells, modulus)
    return matrices


def shear_matrices(
    space: Space, moduli: Floats, depth: float, integration: Integration
) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Assemble both parts of the stiffness of shear [N/m]: of 2 G E:E, and of 2 G times the square of the dilatation.

    The first less a third of the second belongs to the deviator of the strain. `moduli` (n_cells,) [Pa] are 2 G.
    """
    element, components = np.flatnonzero(moduli), STRAIN_COMPONENTS[space.dim]
    unit, dilatation = hooke_tangent(components, 0.0, 0.5), hooke_tangent(components, 1.0, 0.0)
    size = space.dim * space.full.Nbfun
    matrices = np.zeros((2, element.size, size, size))
    for rows in _chunks(np.arange(element.size)):
        cells, weights = element[rows], moduli[element[rows], None, None]
        matrices[0, rows] = weights * _integrate(space, cells, unit)
        if is_mean_of_cell(space.element, integration):
            matrices[1, rows] = weights * _mean_dilatation(space, cells, 1.0)
        elif integration != "nodal":
            matrices[1, rows] = weights * _integrate(space, cells, dilatation)
    first, second = (_sum_cells(part, cell_dofs(space.full, element), space.n_dofs) for part in matrices)
    if integration == "nodal":
        second = _nodal_dilatation(space, moduli)
    return sparse.csr_matrix(depth * first), sparse.csr_matrix(depth * second)


def _chunks(cells: Integers) -> Iterator[Integers]:
    for start in range(0, len(cells), _CHUNK):
        yield cells[start : start + _CHUNK]


def _integrate(space: Space, cells: Integers, tangent: Floats) -> Floats:
    """Return the integral of B^T D B over each of the cells, shape (k, n_local, n_local)."""
    strain = strain_operator(space.full, cells)
    stress = (tangent @ strain) * space.full.dx[cells][:, :, None, None]
    # All quadrature points of a cell in one product.
    strain, stress = (part.reshape(len(cells), -1, part.shape[-1]) for part in (strain, stress))
    return np.asarray(strain.transpose(0, 2, 1) @ stress)


def _mean_dilatation(space: Space, cells: Integers, modulus: float) -> Floats:
    """Return the dilatational stiffness of the mean dilatation of each cell, shape (k, n_local, n_local)."""
    divergence = divergence_operator(space.full, cells)
    weights = modulus * space.full.dx[cells].sum(axis=1)
    return np.asarray(weights[:, None, None] * divergence[:, :, None] * divergence[:, None, :])


def _nodal_dilatation(space: Space, moduli: Floats) -> sparse.csr_matrix:
    """Return the dilatational stiffness of the cells' mean dilatation around each node, per unit depth.

    `moduli` (n_cells,) [Pa] are those of the dilatational part; the mean is taken over cells of the same modulus.
    """
    every = np.arange(space.mesh.nelements)
    divergence = matrix_of_rows(divergence_operator(space.full, every), cell_dofs(space.full, every), space.n_dofs)
    volumes, corners = space.full.dx.sum(axis=1), space.mesh.t.shape[0]
    stiffness = sparse.csr_matrix((space.n_dofs, space.n_dofs))
    for modulus in np.unique(moduli[moduli != 0.0]):
        cells = np.flatnonzero(moduli == modulus)
        nodes, local = np.unique(space.mesh.t[:, cells], return_inverse=True)
        share = np.tile(volumes[cells] / corners, corners)
        entries = (local.ravel(), np.tile(np.arange(cells.size), corners))
        spread = sparse.csr_matrix((share, entries), shape=(nodes.size, cells.size)) @ divergence[cells]
        volume_of_node = np.bincount(local.ravel(), weights=share)
        stiffness = stiffness + spread.T @ sparse.diags(modulus / volume_of_node) @ spread
    return stiffness


def mass_matrix(space: Space, materials: CellMaterials[Law], depth: float) -> sparse.csr_matrix:
    """Assemble the consistent mass matrix [kg]."""
    basis = space.mass
    shapes = np.stack([np.asarray(basis.basis[node][0])[0] for node in range(basis.Nbfun)], axis=-1)
    products = (shapes[:, :, None] * shapes[:, None, :]).reshape(len(shapes), -1)
    weights = depth * materials.density[:, None] * basis.dx
    matrices = (weights @ products).reshape(-1, basis.Nbfun, basis.Nbfun)
    of_one_component = _sum_cells(matrices, basis.element_dofs.T, len(space.positions))
    return sparse.kron(of_one_component, sparse.identity(space.dim), format="csr")


def _sum_cells(matrices: Floats, dofs: NDArray[np.int32], size: int) -> sparse.csr_matrix:
    """Sum the matrices of cells (k, n, n) on their degrees of freedom (k, n), shape (size, size)."""
    count = dofs.shape[1]
    entries = (np.repeat(dofs, count, axis=1).ravel(), np.tile(dofs, (1, count)).ravel())
    return sparse.coo_matrix((matrices.ravel(), entries), shape=(size, size)).tocsr()


def traction_load(space: Space, tractions: Mapping[str, tuple[float, ...]], depth: float) -> Floats:
    """Return the nodal forces (n_dofs,) [N] of uniform tractions [Pa] on named boundaries."""
    load = np.zeros((space.positions.shape[0], space.dim))
    for name, traction in tractions.items():
        if len(traction) != space.dim:
            raise InputError(f"tractions.{name}", f"got {len(traction)} components", f"needs {space.dim}")
        load += nodal_areas(space, name, depth, f"tractions.{name}")[:, None] * np.asarray(traction)
    return load.ravel()


@dataclass(frozen=True)
class ViscoelasticLayers:
    """The matrices of viscoelastic layers alike."""

    prony: Prony  # their terms
    shape: sparse.csr_matrix  # S [N/m]
    thickness: sparse.csr_matrix | None = None  # T [N/m]
    across: OutOfPlane | None = None  # of plane stress

    def belongs_to(self, material: Elastic) -> bool:
        """Tell whether layers of a material are among these."""
        alike = self.across is None or self.across == across_of(material.poisson_ratio)
        return alike and material.prony == self.prony

    def apply_map(self, function: Callable[[sparse.csr_matrix], Any]) -> ViscoelasticLayers:
        """Return the layers with a function of their matrices in place of these."""
        thickness = None if self.thickness is None else sparse.csr_matrix(function(self.thickness))
        return replace(self, shape=sparse.csr_matrix(function(self.shape)), thickness=thickness)


def viscoelastic_layers(
    space: Space, materials: CellMaterials[Material], depth: float, integration: Integration
) -> tuple[ViscoelasticLayers, ...]:
    """Assemble the matrices of all viscoelastic layers."""
    in_plane = materials.formulation == "plane_stress"
    groups: dict[tuple[Prony, float | None], Floats] = {}
    for material, cells in materials:
        if isinstance(material, Elastic) and material.prony:
            key = (material.prony, material.poisson_ratio if in_plane else None)
            groups.setdefault(key, np.zeros(space.mesh.nelements))[cells] = 2.0 * material.shear_modulus
    layers = []
    for (prony, ratio), moduli in groups.items():
        shear, dilatation = shear_matrices(space, moduli, depth, integration)
        if ratio is None:
            layers.append(ViscoelasticLayers(prony, sparse.csr_matrix(shear - dilatation / 3.0)))
        else:
            layers.append(ViscoelasticLayers(prony, shear, dilatation, across_of(ratio)))
    return tuple(layers)
