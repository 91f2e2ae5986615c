"""Strain, stress and strain energy density from displacements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.arrays import Floats, Integers
from fingerslip.errors import MeshError
from fingerslip.fe.cell_materials import CellMaterials
from fingerslip.fe.space import Space
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.material import SHEARS, STRAIN_COMPONENTS, Formulation, Material
from fingerslip.materials.viscoelastic import Relaxed, across_of, stored_energy, stress, with_across


def strain_operator(basis: skfem.CellBasis, cells: Integers) -> Floats:
    """Return the strains (k, n_points, m, n_local) [1/m] at the points of cells (k,) for unit displacements."""
    gradients = shape_gradients(basis, cells)
    count, points, nodes, dim = gradients.shape
    operator = np.zeros((count, points, STRAIN_COMPONENTS[dim], nodes, dim))
    for axis in range(dim):
        operator[:, :, axis, :, axis] = gradients[..., axis]
    for row, (first, second) in enumerate(SHEARS[dim], start=dim):
        operator[:, :, row, :, first] = gradients[..., second]
        operator[:, :, row, :, second] = gradients[..., first]
    return operator.reshape(count, points, STRAIN_COMPONENTS[dim], nodes * dim)


def divergence_operator(basis: skfem.CellBasis, cells: Integers) -> Floats:
    """Return the mean divergence of cells [1/m], shape (k, n_local), for unit displacements of their nodes."""
    weights = basis.dx[cells] / basis.dx[cells].sum(axis=1, keepdims=True)
    gradients = shape_gradients(basis, cells)
    return np.asarray(np.einsum("kqad,kq->kad", gradients, weights)).reshape(
        len(cells), gradients.shape[2] * gradients.shape[3]
    )


def matrix_of_rows(values: Floats, columns: NDArray[np.int32], width: int) -> sparse.csr_matrix:
    """Return the sparse matrix with the given values in the given columns of its rows, both (k, n); no zeros."""
    rows = np.repeat(np.arange(len(columns)), columns.shape[1])
    matrix = sparse.csr_matrix((values.ravel(), (rows, columns.ravel())), shape=(len(columns), width))
    matrix.eliminate_zeros()
    return matrix


def cell_dofs(basis: skfem.CellBasis, cells: Integers) -> NDArray[np.int32]:
    """Return the degrees of freedom of cells, shape (k, n_local): node by node, all components of a node together."""
    nodes, dim = basis.element_dofs[:, cells].T, basis.mesh.dim()
    dofs = dim * nodes[..., None] + np.arange(dim)
    return np.asarray(dofs.reshape(len(cells), nodes.shape[1] * dim), dtype=np.int32)


def shape_gradients(basis: skfem.CellBasis, cells: Integers) -> Floats:
    """Return the gradients of the shape functions of cells (k,) [1/m], shape (k, n_points, n_nodes, dim)."""
    by_node = [np.asarray(basis.basis[node][0].grad)[:, cells] for node in range(basis.Nbfun)]
    return np.ascontiguousarray(np.stack(by_node).transpose(2, 3, 0, 1))


#: Gives the dashpots of a material that relaxes, from strains (..., k, m) [-] at some points (k,).
Relax = Callable[[Elastic, Floats, Integers], Relaxed]
_Law = Callable[[Material, Floats], Floats]
_RelaxedLaw = Callable[[Elastic, Relaxed], Floats]


def stress_components(dim: int) -> tuple[str, ...]:
    """Return the names of the stress components in two or three dimensions; zz is there in both."""
    return ("xx", "yy", "zz", *("xyz"[i] + "xyz"[j] for i, j in SHEARS[dim]))


@dataclass(frozen=True)
class Share:
    """The share of one material in the points of a recovery."""

    material: Material
    points: Integers  # (k,), numbers of the points that have it
    weights: Floats  # (k,), its share at each [-]

    @cached_property
    def rows(self) -> Integers | slice:
        """The points, as a slice where they follow each other: what it takes need not be copied."""
        follow = self.points.size > 0 and bool((np.diff(self.points) == 1).all())
        return slice(self.points[0], self.points[-1] + 1) if follow else self.points


@dataclass(frozen=True)
class Recovery:
    """The strain at some points as a linear map of the displacement, with the materials there."""

    strain: sparse.csr_matrix  # rows of the first point, then of the second, and so on [1/m]
    shares: tuple[Share, ...]  # the materials at the points
    formulation: Formulation  # the two-dimensional assumption, or `solid`
    relax: Relax | None = None  # gives the dashpots of materials with Prony terms

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return 3 if self.formulation == "solid" else 2

    @property
    def components(self) -> int:
        """Number of strain components."""
        return STRAIN_COMPONENTS[self.dim]

    def strains(self, displacement: Floats) -> Floats:
        """Return the strains [-], shape (..., n_points, m), of a displacement (n_dofs,) [m] or of some (k, n_dofs).

        Components are xx, yy, xy or xx, yy, zz, xy, yz, xz.
        """
        result = [self.strain @ field for field in displacement.reshape(-1, displacement.shape[-1])]
        return np.stack(result).reshape(*displacement.shape[:-1], -1, self.components)

    def stresses(self, strains: Floats) -> Floats:
        """Return the stresses [Pa], shape (..., n_points, 4 or 6), of strains (..., n_points, m) [-].

        Components are named by :func:`stress_components`.
        """
        return self._mean(strains, len(stress_components(self.dim)), self._stress, stress)

    def tensors(self, strains: Floats) -> Floats:
        """Return the tensors [-], shape (..., n_points, 4 or 6), of strains (..., n_points, m) [-].

        Components are named by :func:`stress_components`; shears are those of the tensor, half the engineering ones.
        In plane stress the strain across the plane is NaN where a law does not say what it is.
        """
        if self.formulation == "plane_stress":
            result = self._mean(strains, 4, _with_thickness_strain, lambda _, relaxed: relaxed.strains)
        else:
            result = with_across(strains).copy()
        result[..., 3:] *= 0.5
        return result

    def energy_densities(self, strains: Floats) -> Floats:
        """Return the strain energy densities [J/m^3], shape (..., n_points), of strains (..., n_points, m) [-]."""

        def energy(material: Material, strains: Floats) -> Floats:
            return material.energy(strains, self.formulation)[:, None]

        return self._mean(strains, 1, energy, lambda *relaxed: stored_energy(*relaxed)[..., None])[..., 0]

    def _stress(self, material: Material, strains: Floats) -> Floats:
        stress = material.stress(strains, self.formulation)
        if self.dim == 3:
            return stress
        return np.stack([*stress[:, :2].T, material.stress_across(strains, self.formulation), *stress[:, 2:].T]).T

    def _mean(self, strains: Floats, components: int, law: _Law, relaxed_law: _RelaxedLaw) -> Floats:
        """Return the mean of what a law gives, shape (..., n_points, components), over the materials at each point."""
        relax = self.relax
        # Laws work on components: where each is a row in memory, they take a fraction of the time.
        rows = np.zeros((components, *strains.shape[:-1]))
        for share in self.shares:
            if relax is not None and getattr(share.material, "prony", None):
                continue
            strains_of_share = np.ascontiguousarray(np.moveaxis(strains[..., share.rows, :], -1, 0))
            values = law(share.material, strains_of_share.reshape(len(strains_of_share), -1).T).T
            values = values.reshape(components, *strains_of_share.shape[1:])
            # Where no other material has a share, nothing is added up.
            if (share.weights == 1.0).all():
                rows[..., share.rows] = values
            else:
                rows[..., share.rows] += share.weights * values
        mean = np.moveaxis(rows, 0, -1)
        for share in self.shares:
            if relax is not None and isinstance(share.material, Elastic) and share.material.prony:
                relaxed = relax(share.material, strains[..., share.points, :], share.points)
                mean[..., share.points, :] += share.weights[:, None] * relaxed_law(share.material, relaxed)
        return mean


def _with_thickness_strain(material: Material, strains: Floats) -> Floats:
    """Return strains in plane stress (k, 3) [-] with the one across the plane, shape (k, 4)."""
    along = across_of(material.poisson_ratio).along if isinstance(material, Elastic) else np.nan
    return with_across(strains, -along * strains[:, :2].sum(axis=1))


def cell_recovery(space: Space, materials: CellMaterials[Material]) -> Recovery:
    """Recover at the centres of all cells, where low-order elements are most accurate."""
    every = np.arange(space.mesh.nelements)
    shares = tuple(Share(material, cells, np.ones(len(cells))) for material, cells in materials)
    return Recovery(_strain_map(space, every), shares, materials.formulation)


def site_recovery(
    space: Space, materials: CellMaterials[Material], nodes: Integers, regions: Sequence[str | None]
) -> Recovery:
    """Recover at nodes (n_sites,): the mean strain of cells around each, weighted by size, on a given region's side."""
    around = cells_around(space, nodes, regions)
    chosen = np.unique(around.indices).astype(np.int64)
    components = sparse.identity(STRAIN_COMPONENTS[space.dim])
    mean = sparse.kron(around[:, chosen], components, format="csr") @ _strain_map(space, chosen)
    shares = []
    for material, cells in materials:
        weights = np.asarray(around[:, cells].sum(axis=1)).ravel()
        points = np.flatnonzero(weights)
        shares += [Share(material, points, weights[points])] if points.size else []
    return Recovery(sparse.csr_matrix(mean), tuple(shares), materials.formulation)


def _strain_map(space: Space, cells: Integers) -> sparse.csr_matrix:
    """Return the strains at the centres of cells as a map of the displacement, shape (m * n_cells, n_dofs) [1/m]."""
    values = strain_operator(space.centre, cells)[:, 0]
    components = values.shape[1]
    columns = np.repeat(cell_dofs(space.centre, cells), components, axis=0)
    return matrix_of_rows(values.reshape(columns.shape), columns, space.n_dofs)


def cells_around(space: Space, nodes: Integers, regions: Sequence[str | None]) -> sparse.csr_matrix:
    """Return the weights (n_sites, n_cells) of the cells around nodes (n_sites,), each row summing to one."""
    all_nodes = space.full.element_dofs
    columns = np.broadcast_to(np.arange(all_nodes.shape[1]), all_nodes.shape).ravel()
    entries = (np.ones(columns.size), (all_nodes.ravel(), columns))
    incidence = sparse.csr_matrix(entries, (len(space.positions), all_nodes.shape[1]))
    incidence.data[:] = 1.0  # of a cell with two corners in a node, too
    # The sizes of the cells [m^2 or m^3] that have a node.
    cells = sparse.csr_matrix(incidence[np.asarray(nodes)] @ sparse.diags(space.full.dx.sum(axis=1)))
    for region in {element for element in regions if element is not None}:
        inside = np.zeros(space.mesh.nelements)
        inside[space.mesh.subdomains[region]] = 1.0
        asked = np.repeat([element == region for element in regions], np.diff(cells.indptr))
        cells.data[asked] *= inside[cells.indices[asked]]
    cells.eliminate_zeros()
    empty = np.flatnonzero(np.diff(cells.indptr) == 0)
    if empty.size:
        fault = f"no cell of region '{regions[empty[0]]}' at node {nodes[empty[0]]}"
        raise MeshError(f"site {empty[0]}", fault, "needs a node of that region")
    cells.data /= np.repeat(np.asarray(cells.sum(axis=1)).ravel(), np.diff(cells.indptr))
    return cells


def von_mises(stresses: Floats) -> Floats:
    """Return the von Mises stress [Pa], shape (...), of stresses (..., 4 or 6) as :class:`Recovery` gives them."""
    xx, yy, zz, *shears = np.moveaxis(stresses, -1, 0)
    squares = sum(shear**2 for shear in shears)
    return np.asarray(np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * squares))
