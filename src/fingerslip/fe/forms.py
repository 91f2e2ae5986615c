"""Stiffness, mass and load of small-strain elasticity, assembled with scikit-fem."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy import sparse
from skfem.helpers import ddot, div, dot, sym_grad

from fingerslip.errors import InputError
from fingerslip.fe.space import Space, nodal_areas
from fingerslip.materials.elastic import Elastic

__all__ = ["CellConstants", "cell_constants", "mass_matrix", "stiffness_matrix", "traction_load"]

Array = NDArray[np.float64]
Formulation = Literal["plane_strain", "plane_stress", "solid"]
Integration = Literal["selective", "full", "nodal"]


@dataclass(frozen=True)
class CellConstants:
    """Material constants of every cell.

    Parameters
    ----------
    first_lame : (n_cells,) array
        Factor of the dilatation in the stress [Pa]: Lame's first constant in solids and plane strain,
        E nu / (1 - nu^2) of the in-plane dilatation in plane stress.
    shear_modulus, density : (n_cells,) array
        [Pa], [kg/m^3].
    out_of_plane_ratio : (n_cells,) array
        Out-of-plane stress over the sum of the in-plane normal stresses [-]: nu in plane strain, else 0.
    """

    first_lame: Array
    shear_modulus: Array
    density: Array
    out_of_plane_ratio: Array


def cell_constants(space: Space, materials: Mapping[str, Elastic], formulation: Formulation) -> CellConstants:
    """Look up the material of every cell.

    Raises
    ------
    InputError
        For a formulation of the wrong dimension, a region without material, a material without region, cells in
        no or in several regions, and Poisson's ratio 0.5 in solids and plane strain, which displacement elements
        cannot represent.
    """
    if (formulation == "solid") != (space.dim == 3):
        allowed = "needs solid" if space.dim == 3 else "needs plane_strain or plane_stress"
        raise InputError("formulation", f"got {formulation} for a mesh in {space.dim} dimensions", allowed)
    regions: Mapping[str, Any] = space.mesh.subdomains or {}
    values = np.full((4, space.mesh.nelements), np.nan)
    for name, material in materials.items():
        if name not in regions:
            raise InputError(f"materials.{name}", "no such region in the mesh", f"it has: {', '.join(sorted(regions))}")
        first_lame, ratio = _material_constants(name, material, formulation, space.element)
        cells = regions[name]
        if not np.isnan(values[0, cells]).all():
            raise InputError("mesh", f"region '{name}' shares cells with another", "a cell has one material")
        values[:, cells] = np.array([first_lame, material.shear_modulus, material.density, ratio])[:, None]
    bare = sorted(name for name, cells in regions.items() if np.isnan(values[0, cells]).any())
    if bare:
        raise InputError("materials", f"region '{bare[0]}' has no material", "every region needs one")
    if np.isnan(values).any():
        raise InputError("mesh", "some cells are in no region", "every cell needs a region, which gives its material")
    return CellConstants(*values)


_LOCKING = {
    "T3": ", and take Q4, T6 or integration 'nodal' because T3 locks",
    "T4": ", and take H8, T10 or integration 'nodal' because T4 locks",
}


def _material_constants(name: str, material: Elastic, formulation: Formulation, element: str) -> tuple[float, float]:
    modulus, ratio = material.youngs_modulus, material.poisson_ratio
    if formulation == "plane_stress":
        return modulus * ratio / (1.0 - ratio**2), 0.0
    if ratio == 0.5:
        allowed = f"{formulation.replace('_', ' ')} with displacement elements needs < 0.5"
        repair = f"write 0.4999{_LOCKING.get(element, '')}"
        raise InputError(f"materials.{name}.poisson_ratio", "got 0.5", allowed, repair)
    return modulus * ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio)), ratio if formulation == "plane_strain" else 0.0


@skfem.BilinearForm
def _shear_form(u: Any, v: Any, w: Any) -> Any:
    return 2.0 * w.shear_modulus * ddot(sym_grad(u), sym_grad(v))


@skfem.BilinearForm
def _dilatation_form(u: Any, v: Any, w: Any) -> Any:
    return w.first_lame * div(u) * div(v)


@skfem.BilinearForm
def _mass_form(u: Any, v: Any, w: Any) -> Any:
    return w.density * dot(u, v)


def stiffness_matrix(
    space: Space, constants: CellConstants, depth: float, integration: Integration
) -> sparse.csr_matrix:
    """Assemble the stiffness matrix [N/m], shape (n_dofs, n_dofs).

    Three ways to integrate the dilatational part. 'selective': from the mean dilatation of each cell in Q4 and H8,
    which then do not lock near incompressibility (for Q4 that is the value at the centre, Malkus & Hughes 1978;
    for H8 the mean also passes the patch test), fully in all others. 'full': fully, which locks.
    'nodal': from the mean dilatation of the cells around each node, material by material, so that linear
    triangles and tetrahedra do not lock either (Bonet & Burton 1998).

    Parameters
    ----------
    space : Space
        Displacement space.
    constants : CellConstants
        Material of every cell.
    depth : float
        Out-of-plane depth [m].
    integration : {'selective', 'full', 'nodal'}
        How the dilatational part is integrated.

    Raises
    ------
    InputError
        For nodal integration of cells that are no linear triangles or tetrahedra.
    """
    shear = _shear_form.assemble(space.full, shear_modulus=_at_points(space.full, constants.shear_modulus))
    if integration == "nodal":
        return sparse.csr_matrix(depth * (shear + _nodal_dilatation(space, constants)))
    if integration == "selective" and space.element in {"Q4", "H8"}:
        return sparse.csr_matrix(depth * (shear + _mean_dilatation(space, constants)))
    dilatation = _dilatation_form.assemble(space.full, first_lame=_at_points(space.full, constants.first_lame))
    return sparse.csr_matrix(depth * (shear + dilatation))


def _mean_dilatation(space: Space, constants: CellConstants) -> sparse.csr_matrix:
    """Return the dilatational stiffness of the mean dilatation of each cell, per unit depth."""
    divergence = _cell_divergence(space)
    return divergence.T @ sparse.diags(constants.first_lame * space.full.dx.sum(axis=1)) @ divergence


def _nodal_dilatation(space: Space, constants: CellConstants) -> sparse.csr_matrix:
    """Return the dilatational stiffness of the cells' mean dilatation around each node, per unit depth."""
    if space.element not in {"T3", "T4"}:
        found = f"got 'nodal' for {space.element}"
        raise InputError("integration", found, "needs linear triangles or tetrahedra", "write 'selective'")
    divergence = _cell_divergence(space)
    volumes = space.full.dx.sum(axis=1)
    stiffness = sparse.csr_matrix((space.n_dofs, space.n_dofs))
    for modulus in np.unique(constants.first_lame):
        cells = np.flatnonzero(constants.first_lame == modulus)
        nodes, local = np.unique(space.mesh.t[:, cells], return_inverse=True)
        share = np.tile(volumes[cells] / space.mesh.t.shape[0], space.mesh.t.shape[0])
        places = (local.ravel(), np.tile(np.arange(cells.size), space.mesh.t.shape[0]))
        spread = sparse.csr_matrix((share, places), shape=(nodes.size, cells.size)) @ divergence[cells]
        volume_of_node = np.bincount(local.ravel(), weights=share)
        stiffness = stiffness + spread.T @ sparse.diags(modulus / volume_of_node) @ spread
    return stiffness


def _cell_divergence(space: Space) -> sparse.csr_matrix:
    """Return the map from displacements to the cells' mean divergence, shape (n_cells, n_dofs) [1/m]."""
    basis = space.full
    weights = basis.dx / basis.dx.sum(axis=1, keepdims=True)
    values = [np.einsum("iicq,cq->c", np.asarray(basis.basis[i][0].grad), weights) for i in range(basis.Nbfun)]
    columns = [basis.element_dofs[i] for i in range(basis.Nbfun)]
    rows = np.tile(np.arange(space.mesh.nelements), basis.Nbfun)
    shape = (space.mesh.nelements, space.n_dofs)
    return sparse.csr_matrix((np.concatenate(values), (rows, np.concatenate(columns))), shape=shape)


def mass_matrix(space: Space, constants: CellConstants, depth: float) -> sparse.csr_matrix:
    """Assemble the consistent mass matrix [kg], shape (n_dofs, n_dofs)."""
    density = _at_points(space.mass, constants.density)
    return sparse.csr_matrix(depth * _mass_form.assemble(space.mass, density=density))


def traction_load(space: Space, tractions: Mapping[str, tuple[float, ...]], depth: float) -> Array:
    """Return the nodal forces [N] of uniform tractions [Pa] on named boundaries, shape (n_dofs,)."""
    load = np.zeros((space.positions.shape[0], space.dim))
    for name, traction in tractions.items():
        if len(traction) != space.dim:
            raise InputError(f"tractions.{name}", f"got {len(traction)} components", f"needs {space.dim}")
        load += nodal_areas(space, name, depth)[:, None] * np.asarray(traction)
    return load.ravel()


def _at_points(basis: skfem.CellBasis, per_cell: Array) -> Array:
    """Spread a constant per cell over the cell's quadrature points."""
    return np.broadcast_to(per_cell[:, None], basis.dx.shape).copy()
