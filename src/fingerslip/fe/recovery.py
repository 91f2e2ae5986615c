"""Strain, stress and strain energy density from displacements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.errors import MeshError
from fingerslip.fe.forms import CellConstants
from fingerslip.fe.space import Space

__all__ = [
    "Recovery",
    "cell_recovery",
    "site_recovery",
    "strain_energy_density",
    "stress",
    "stress_components",
    "von_mises",
]

Array = NDArray[np.float64]

_SHEARS = {2: ((0, 1),), 3: ((0, 1), (1, 2), (0, 2))}


def stress_components(dim: int) -> tuple[str, ...]:
    """Return the names of the stress components in two or three dimensions; zz is there in both."""
    return ("xx", "yy", "zz", *("xyz"[i] + "xyz"[j] for i, j in _SHEARS[dim]))


@dataclass(frozen=True)
class Recovery:
    """The strain at some places as a linear map of the displacement, with the material there.

    Parameters
    ----------
    strain : sparse matrix, shape (n_components * n_places, n_dofs)
        Rows of the first place, then of the second, and so on [1/m]: the normal strains, then the engineering
        shears xy (and yz, xz in space).
    constants : CellConstants
        Material constants of the places.
    components : int
        Number of strain components: 3 in the plane, 6 in space.
    """

    strain: sparse.csr_matrix
    constants: CellConstants
    components: int

    def strains(self, displacement: Array) -> Array:
        """Return the strains [-], shape (n_places, n_components): xx, yy, xy, or xx, yy, zz, xy, yz, xz."""
        values: Array = (self.strain @ displacement).reshape(-1, self.components)
        return values


def cell_recovery(space: Space, constants: CellConstants, chosen: NDArray[np.int64] | None = None) -> Recovery:
    """Recover at the centres of all or `chosen` (n,) cells, where low-order elements are most accurate."""
    basis, cells = space.centre, np.arange(space.mesh.nelements if chosen is None else chosen.size)
    which = slice(None) if chosen is None else chosen
    count = space.dim + len(_SHEARS[space.dim])
    rows, columns, values = [], [], []
    for local in range(basis.Nbfun):
        gradient = np.asarray(basis.basis[local][0].grad)[:, :, which, 0]
        normals = [gradient[i, i] for i in range(space.dim)]
        shears = [gradient[i, j] + gradient[j, i] for i, j in _SHEARS[space.dim]]
        for component, strain in enumerate([*normals, *shears]):
            rows.append(count * cells + component)
            columns.append(basis.element_dofs[local][which])
            values.append(strain)
    triplets = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    own = CellConstants(*(values[which] for values in vars(constants).values()))
    return Recovery(sparse.csr_matrix(triplets, shape=(count * len(cells), space.n_dofs)), own, count)


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
    chosen = np.unique(around.indices).astype(np.int64)
    cells, around = cell_recovery(space, constants, chosen), around[:, chosen]
    per_site = sparse.kron(around, sparse.identity(cells.components), format="csr") @ cells.strain
    means = [around @ values for values in vars(cells.constants).values()]
    return Recovery(sparse.csr_matrix(per_site), CellConstants(*means), cells.components)


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
    """Return the stress [Pa] of strains (n_places, 3 or 6) in their material.

    Returns
    -------
    (n_places, 4 or 6) array
        Components as named by :func:`stress_components`.
    """
    dim = 2 if strains.shape[1] == 3 else 3
    normal, shear = strains[:, :dim], strains[:, dim:]
    dilatation = known.first_lame * normal.sum(axis=1)
    direct = dilatation[:, None] + 2.0 * known.shear_modulus[:, None] * normal
    across = known.out_of_plane_ratio[:, None] * direct.sum(axis=1, keepdims=True)
    return np.hstack([direct, *([across] if dim == 2 else []), known.shear_modulus[:, None] * shear])


def strain_energy_density(strains: Array, known: CellConstants) -> Array:
    """Return the strain energy density [J/m^3], shape (n_places,), of strains (n_places, 3 or 6) in their material."""
    dim = 2 if strains.shape[1] == 3 else 3
    normal, shear = strains[:, :dim], strains[:, dim:]
    distortion = np.sum(normal**2, axis=1) + 0.5 * np.sum(shear**2, axis=1)
    density: Array = 0.5 * known.first_lame * normal.sum(axis=1) ** 2 + known.shear_modulus * distortion
    return density


def von_mises(stresses: Array) -> Array:
    """Return the von Mises stress [Pa], shape (n,), of stresses (n, 4 or 6) as :func:`stress` gives them."""
    xx, yy, zz = stresses[:, :3].T
    shear = np.sum(stresses[:, 3:] ** 2, axis=1)
    deviation: Array = np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * shear)
    return deviation
