"""Mean volumes, from which the volumetric part of a law is integrated so that elements do not lock.

The ratio of current to reference volume is averaged over groups of quadrature points: over each cell in quadrilaterals
and hexahedra (Nagtegaal, Parks & Rice 1974), over the cells around each node in linear triangles and tetrahedra (Bonet
& Burton 1998), material by material. With the volumetric energy U(ln J), a group of volume V and mean ratio Jm has the
energy V U(ln Jm), and what its points feel is the pressure U'(ln Jm)/Jm. In plane stress J is the ratio of areas.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from fingerslip.arrays import Floats, Integers
from fingerslip.fe.cell_materials import CellMaterials
from fingerslip.fe.integration import Integration, is_mean_of_cell
from fingerslip.fe.space import Space
from fingerslip.materials.large_strain import FiniteMaterial
from fingerslip.materials.material import Formulation


@dataclass(frozen=True)
class Volumes:
    """Groups of quadrature points over which volumes are averaged."""

    mean: sparse.csr_matrix  # the mean over each group [-]
    size: Floats  # (n_groups,), reference volumes of the groups [m^3]
    material: Integers  # (n_groups,), index of their material


def mean_volumes(
    space: Space, materials: CellMaterials[FiniteMaterial], weights: Floats, integration: Integration
) -> Volumes | None:
    """Return the groups of points of weights (n_cells, n_q) [m^3]; None where every point stands for itself."""
    cells = np.arange(weights.shape[0])
    if is_mean_of_cell(space.element, integration):
        return _groups(cells[:, None], weights, np.ones(cells.size), materials.number)
    if integration == "nodal":
        nodes = np.asarray(space.mesh.t.T, dtype=np.int64)
        marks = nodes + len(space.positions) * materials.number[:, None]
        group, number = np.unique(marks, return_inverse=True)
        share = np.full(cells.size, 1.0 / nodes.shape[1])
        return _groups(number.reshape(marks.shape), weights, share, group // len(space.positions))
    return None


def _groups(group: Integers, weights: Floats, share: Floats, material: Integers) -> Volumes:
    """Return groups from those of every cell (n_cells, k), in which it takes part with a share of its volume."""
    cells, points = weights.shape
    members = group.shape[1]
    rows = np.repeat(group, points, axis=1).ravel()
    columns = np.tile(np.arange(cells * points).reshape(cells, points), (1, members)).ravel()
    values = np.tile(share[:, None] * weights, (1, members)).ravel()
    spread = sparse.csr_matrix((values, (rows, columns)), shape=(material.size, cells * points))
    size = np.asarray(spread.sum(axis=1)).ravel()
    return Volumes(sparse.csr_matrix(sparse.diags(1.0 / size) @ spread), size, material)


def selective_energy(
    material: FiniteMaterial, formulation: Formulation, log_volume: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return the energy that is integrated from mean volumes, and its two derivatives, each (n,) [Pa], at ln J (n,).

    At rest its modulus is that of the part which is integrated selectively at small strain, so that both agree there.
    """
    modulus = material.at_rest().dilatational_modulus(formulation)
    if formulation == "plane_stress":
        return 0.5 * modulus * log_volume**2, modulus * log_volume, np.full_like(log_volume, modulus)
    # Without lateral contraction a law may have no energy of volume, and nothing is integrated from mean volumes.
    share = modulus / float(material.volumetric(np.zeros(1))[2][0]) if modulus else 0.0
    energy, slope, curvature = material.volumetric(log_volume)
    return share * energy, share * slope, share * curvature
