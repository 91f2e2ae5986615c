"""Matrices of materials that relax, one set for all layers that relax alike.

With the displacement u and y = sum s_i z_i of dashpots z_i in the nodes (:mod:`fingerslip.materials.prony`) the
elastic force K u of such layers becomes K u - S y. In solids and plane strain S belongs to the deviator of the strain.

In plane stress the strain across the plane adjusts itself, so that it has a history of its own: it is -div w with a
displacement w of dashpots q_i, that of :class:`~fingerslip.materials.viscoelastic.Across` in every node. With R of a
field that field less sum s_i times its dashpots, the force is that of the stress along the plane less that across it,
A R[u] + B R[w]: S is A, and T, which is B, times w - c u - sum s_i q_i comes on top.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.fe.cell_materials import CellMaterials
from fingerslip.fe.forms import shear_matrices
from fingerslip.fe.integration import Integration
from fingerslip.fe.space import Space
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.material import Material
from fingerslip.materials.prony import Prony
from fingerslip.materials.viscoelastic import Across, across_of

__all__ = ["Relaxing", "relaxing_layers"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Relaxing:
    """The matrices of layers that relax alike."""

    prony: Prony  # their terms
    shape: sparse.csr_matrix  # S [N/m]
    thickness: sparse.csr_matrix | None = None  # T [N/m]
    across: Across | None = None  # of plane stress

    def belongs_to(self, material: Elastic) -> bool:
        """Tell whether layers of a material are among these."""
        alike = self.across is None or self.across == across_of(material.poisson_ratio)
        return alike and material.prony == self.prony

    def mapped(self, function: Callable[[sparse.csr_matrix], Any]) -> Relaxing:
        """Return the layers with a function of their matrices in place of these."""
        thickness = None if self.thickness is None else sparse.csr_matrix(function(self.thickness))
        return replace(self, shape=sparse.csr_matrix(function(self.shape)), thickness=thickness)


def relaxing_layers(
    space: Space, materials: CellMaterials[Material], depth: float, integration: Integration
) -> tuple[Relaxing, ...]:
    """Assemble the matrices of all layers that relax.

    Units: depth [m].
    """
    in_plane = materials.formulation == "plane_stress"
    groups: dict[tuple[Prony, float | None], Array] = {}
    for material, cells in materials:
        if not isinstance(material, Elastic) or not material.prony:
            continue
        key = (material.prony, material.poisson_ratio if in_plane else None)
        moduli = groups.setdefault(key, np.zeros(space.mesh.nelements))
        moduli[cells] = 2.0 * material.shear_modulus
    return tuple(_relaxing(*key, shear_matrices(space, moduli, depth, integration)) for key, moduli in groups.items())


def _relaxing(
    prony: Prony, poisson_ratio: float | None, parts: tuple[sparse.csr_matrix, sparse.csr_matrix]
) -> Relaxing:
    if poisson_ratio is None:
        return Relaxing(prony, sparse.csr_matrix(parts[0] - parts[1] / 3.0))
    return Relaxing(prony, *parts, across_of(poisson_ratio))
