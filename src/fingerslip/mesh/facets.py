"""Facets of a mesh: which ones lie between two regions, and where they face."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import skfem

__all__ = ["facets_between", "outward_normals"]

Floats = NDArray[np.float64]
Integers = NDArray[np.integer]


def facets_between(mesh: skfem.Mesh, region: Integers, first: int, second: int) -> NDArray[np.int32]:
    """Return the facets between cells of two regions.

    Arrays: region (n_cells,); returns (k,).
    """
    entry, other = mesh.f2t
    pair = np.where(other >= 0, np.sort([region[entry], region[other]], axis=0), -1)
    low, high = sorted((first, second))
    return np.flatnonzero((pair[0] == low) & (pair[1] == high)).astype(np.int32)


def outward_normals(mesh: skfem.Mesh, facets: Integers, inside: Integers) -> Floats:
    """Return the unit normals of facets, as if they were flat, away from a cell of each.

    Arrays: facets (k,); inside (k,); returns (dim, k) [-].
    """
    corners = mesh.p[:, mesh.facets[:, facets]]
    along = corners[:, 1] - corners[:, 0]
    if mesh.dim() == 2:
        normals = np.stack([along[1], -along[0]])
    else:
        normals = np.cross(along, corners[:, 2] - corners[:, 0], axis=0)
    outward = corners.mean(axis=1) - mesh.p[:, mesh.t[:, inside]].mean(axis=1)
    turned: Floats = normals * np.sign(np.sum(normals * outward, axis=0)) / np.linalg.norm(normals, axis=0)
    return turned
