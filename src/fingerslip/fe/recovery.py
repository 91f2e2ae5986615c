"""Strain, stress and strain energy density from displacements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.errors import MeshError
from fingerslip.fe.assembly import CellConstants
from fingerslip.fe.space import Space

__all__ = [
    "STRESS_COMPONENTS",
    "Recovery",
    "cell_recovery",
    "site_recovery",
    "strain_energy_density",
    "stress",
    "von_mises",
]

Array = NDArray[np.float64]

STRESS_COMPONENTS = ("xx", "yy", "zz", "xy")


@dataclass(frozen=True)
class Recovery:
    """The strain at some places as a linear map of the displacement, with the material there.

    Parameters
    ----------
    strain : sparse matrix, shape (3 n_places, n_dofs)
        Rows xx, yy and engineering xy of the first place, then of the second, and so on [1/m].
    constants : CellConstants
        Material constants of the places.
    """

    strain: sparse.csr_matrix
    constants: CellConstants

    def strains(self, displacement: Array) -> Array:
        """Return the strains [-], shape (n_places, 3): xx, yy and engineering xy."""
        values: Array = (self.strain @ displacement).reshape(-1, 3)
        return values


def cell_recovery(space: Space, constants: CellConstants) -> Recovery:
    """Recover at the cells' centres, where low-order elements are most accurate."""
    basis, cells = space.centre, np.arange(space.mesh.nelements)
    rows, columns, values = [], [], []
    for local in range(basis.Nbfun):
        gradient = np.asarray(basis.basis[local][0].grad)[..., 0]
        strains = (gradient[0, 0], gradient[1, 1], gradient[0, 1] + gradient[1, 0])
        for component, strain in enumerate(strains):
            rows.append(3 * cells + component)
            columns.append(basis.element_dofs[local])
            values.append(strain)
    triplets = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return Recovery(sparse.csr_matrix(triplets, shape=(3 * len(cells), space.n_dofs)), constants)


def site_recovery(
    space: Space, constants: CellConstants, nodes: NDArray[np.int64], regions: Sequence[str | None]
) -> Recovery:
    """Recover at nodes: the area-weighted mean of the cells around each, on the given region's side.

    Parameters
    ----------
    space : Space
        Displacement space.
    constants : CellConstants
        Material of every cell.
    nodes : (n_sites,) array
        Mesh node of every site.
    regions : sequence of str or None
        Region in which to recover; None takes all cells around the node and the mean of their constants.

    Raises
    ------
    MeshError
        Where no cell of the region touches the node.
    """
    around = _cells_around(space, nodes, regions)
    per_site = sparse.kron(around, sparse.identity(3), format="csr") @ cell_recovery(space, constants).strain
    means = [around @ values for values in vars(constants).values()]
    return Recovery(sparse.csr_matrix(per_site), CellConstants(*means))


def _cells_around(space: Space, nodes: NDArray[np.int64], regions: Sequence[str | None]) -> sparse.csr_matrix:
    """Return the weights (n_sites, n_cells) of the cells around each site, each row summing to one."""
    cell_nodes = space.full.element_dofs[:: space.dim] // space.dim
    areas = space.full.dx.sum(axis=1)
    rows, columns, values = [], [], []
    for site, (node, region) in enumerate(zip(nodes, regions, strict=True)):
        cells = np.flatnonzero((cell_nodes == node).any(axis=0))
        if region is not None:
            cells = np.intersect1d(cells, space.mesh.subdomains[region])
        if not cells.size:
            found = f"no cell of region '{region}' at node {node}"
            raise MeshError(f"site {site}", found, "needs a node of that region")
        rows.append(np.full(cells.size, site))
        columns.append(cells)
        values.append(areas[cells] / areas[cells].sum())
    shape = (len(nodes), space.mesh.nelements)
    if not rows:
        return sparse.csr_matrix(shape)
    return sparse.csr_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape)


def stress(strains: Array, known: CellConstants) -> Array:
    """Return the stress [Pa], shape (n_places, 4) as xx, yy, zz, xy, of strains (n_places, 3) in their material."""
    dilatation = known.first_lame * (strains[:, 0] + strains[:, 1])
    xx = dilatation + 2.0 * known.shear_modulus * strains[:, 0]
    yy = dilatation + 2.0 * known.shear_modulus * strains[:, 1]
    return np.column_stack([xx, yy, known.out_of_plane_ratio * (xx + yy), known.shear_modulus * strains[:, 2]])


def strain_energy_density(strains: Array, known: CellConstants) -> Array:
    """Return the strain energy density [J/m^3], shape (n_places,), of strains (n_places, 3) in their material."""
    dilatation = strains[:, 0] + strains[:, 1]
    distortion = strains[:, 0] ** 2 + strains[:, 1] ** 2 + 0.5 * strains[:, 2] ** 2
    return 0.5 * known.first_lame * dilatation**2 + known.shear_modulus * distortion


def von_mises(stresses: Array) -> Array:
    """Return the von Mises stress [Pa], shape (n,), of stresses (n, 4) as xx, yy, zz, xy."""
    xx, yy, zz, xy = stresses.T
    deviation: Array = np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * xy**2)
    return deviation
