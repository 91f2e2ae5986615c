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
from fingerslip.materials import Elastic

__all__ = ["CellConstants", "cell_constants", "mass_matrix", "stiffness_matrix", "traction_load"]

Array = NDArray[np.float64]
Formulation = Literal["plane_strain", "plane_stress"]


@dataclass(frozen=True)
class CellConstants:
    """Material constants of every cell.

    Parameters
    ----------
    first_lame : (n_cells,) array
        Factor of the in-plane dilatation in the in-plane stress [Pa]: Lame's first constant in plane
        strain, E nu / (1 - nu^2) in plane stress.
    shear_modulus, density : (n_cells,) array
        [Pa], [kg/m^3].
    out_of_plane_ratio : (n_cells,) array
        Out-of-plane stress over the sum of the in-plane normal stresses [-]: nu or 0.
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
        For a region without material, a material without region, cells in no region, and Poisson's
        ratio 0.5 in plane strain, which displacement elements cannot represent.
    """
    regions: Mapping[str, Any] = space.mesh.subdomains or {}
    values = np.full((4, space.mesh.nelements), np.nan)
    for name, material in materials.items():
        if name not in regions:
            raise InputError(f"materials.{name}", "no such region in the mesh", f"it has: {', '.join(sorted(regions))}")
        first_lame, ratio = _plane_constants(name, material, formulation, space.element)
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


def _plane_constants(name: str, material: Elastic, formulation: Formulation, element: str) -> tuple[float, float]:
    modulus, ratio = material.youngs_modulus, material.poisson_ratio
    if formulation == "plane_stress":
        return modulus * ratio / (1.0 - ratio**2), 0.0
    if ratio == 0.5:
        allowed = "plane strain with displacement elements needs < 0.5"
        mend = "write 0.4999" if element != "T3" else "write 0.4999, and take Q4 or T6 because T3 locks"
        raise InputError(f"materials.{name}.poisson_ratio", "got 0.5", allowed, mend)
    return modulus * ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio)), ratio


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
    space: Space, constants: CellConstants, depth: float, integration: Literal["selective", "full"]
) -> sparse.csr_matrix:
    """Assemble the stiffness matrix [N/m], shape (n_dofs, n_dofs).

    The dilatational part is integrated at the cells' centres where `integration` is 'selective' and the
    element is Q4, which then does not lock near incompressibility (Malkus & Hughes 1978); elsewhere fully.

    Parameters
    ----------
    space : Space
        Displacement space.
    constants : CellConstants
        Material of every cell.
    depth : float
        Out-of-plane depth [m].
    integration : {'selective', 'full'}
        Quadrature of the dilatational part.
    """
    volumetric = space.centre if integration == "selective" and space.element == "Q4" else space.full
    shear = _shear_form.assemble(space.full, shear_modulus=_at_points(space.full, constants.shear_modulus))
    dilatation = _dilatation_form.assemble(volumetric, first_lame=_at_points(volumetric, constants.first_lame))
    return sparse.csr_matrix(depth * (shear + dilatation))


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
