"""Cauchy stress and strain energy density of a body at large strain, as means over quadrature points.

At the points they are those that the elements feel, with the pressure of mean volumes. Stresses from a mean deformation
gradient would not do: its determinant is not the mean of the determinants, and the bulk modulus of a nearly
incompressible layer multiplies the difference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from fingerslip.arrays import Floats, Integers
from fingerslip.fe.finite.bulk import LargeStrain
from fingerslip.fe.finite.history import Deformed
from fingerslip.fe.finite.kernels import along_axes
from fingerslip.fe.recovery import cells_around
from fingerslip.materials.material import SHEARS


@dataclass(frozen=True)
class FiniteRecovery:
    """Means of stress and energy over some quadrature points of a body."""

    bulk: LargeStrain  # the body
    points: Integers  # (k,), its quadrature points that count
    mean: sparse.csr_matrix  # the mean over them at each of n places [-]

    def stresses(self, state: Deformed) -> Floats:
        """Return the Cauchy stresses [Pa], shape (n, 4 or 6), of a deformed body.

        Components are named by :func:`fingerslip.fe.recovery.stress_components`.
        """
        points, dim = self.points, self.bulk.space.dim
        shrunk = np.exp(-state.log_strain[points].sum(axis=1))
        components = self._along_axes(state, state.stress[points] * shrunk[:, None])
        if state.pulled is not None:
            # The deviators of packed tensors, in the order of stress components.
            deviator = state.pulled[points][:, [0, 1, 3, 2]] if dim == 2 else state.pulled[points]
            deviator[:, :3] -= deviator[:, :3].mean(axis=1, keepdims=True)
            components -= shrunk[:, None] * deviator
        return np.asarray(self.mean @ components)

    def tensors(self, state: Deformed) -> Floats:
        """Return the logarithmic strain tensors [-], shape (n, 4 or 6), along the axes of space."""
        return np.asarray(self.mean @ self._along_axes(state, state.log_strain[self.points]))

    def _along_axes(self, state: Deformed, principal: Floats) -> Floats:
        """Return the components (k, 4 or 6) of tensors with given values (k, 3) along the stretched directions."""
        dim = self.bulk.space.dim
        pairs = np.array([(0, 0), (1, 1), (2, 2), *SHEARS[dim]])
        tensors = np.empty((len(principal), len(pairs)))
        along_axes(self.points, state.deformation, state.squared, state.directions, principal, pairs, tensors)
        return tensors

    def energy_densities(self, state: Deformed) -> Floats:
        """Return the strain energy per reference volume [J/m^3], shape (n,), of a deformed body."""
        return np.asarray(self.mean @ self.bulk.energy_densities(state, self.points))


def finite_cell_recovery(bulk: LargeStrain) -> FiniteRecovery:
    """Recover in all cells, the mean over each."""
    return _over_cells(bulk, sparse.identity(len(bulk.nodes), format="csr"))


def finite_site_recovery(bulk: LargeStrain, nodes: Integers, regions: Sequence[str | None]) -> FiniteRecovery:
    """Recover at nodes (n_sites,): the mean over the cells around each, weighted by size, on a given region's side."""
    return _over_cells(bulk, cells_around(bulk.space, nodes, regions))


def _over_cells(bulk: LargeStrain, cells: sparse.csr_matrix) -> FiniteRecovery:
    """Return the recovery of means over cells (n, n_cells)."""
    count = bulk.weights.shape[1]
    shares = bulk.weights / bulk.weights.sum(axis=1, keepdims=True)
    rows = np.repeat(np.arange(len(shares)), count)
    of_cells = sparse.csr_matrix((shares.ravel(), (rows, np.arange(shares.size))), shape=(len(shares), shares.size))
    chosen = np.unique(cells.indices)
    points = (chosen[:, None] * count + np.arange(count)).ravel().astype(np.int64)
    return FiniteRecovery(bulk, points, sparse.csr_matrix((cells @ of_cells)[:, points]))
