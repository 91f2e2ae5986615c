"""Facets and neighbours of a mesh: which facets lie between two regions, where they face, what hangs together."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import skfem

Floats = NDArray[np.float64]
Integers = NDArray[np.integer]
Flags = NDArray[np.bool_]
Mesh = TypeVar("Mesh", bound="skfem.Mesh")


def connected_pieces(count: int, pairs: Integers) -> NDArray[np.int64]:
    """Return the number (count,) of the connected piece of each of `count` things, of which `pairs` (2, k) touch."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(pairs.shape[1]), tuple(pairs)), shape=(count, count))
    pieces: NDArray[np.int64] = connected_components(graph, directed=False)[1]
    return pieces


def with_groups(mesh: Mesh, regions: Mapping[str, Flags], boundaries: Mapping[str, Flags]) -> Mesh:
    """Return a mesh with names for regions and boundaries, by flags of all cells or facets; empty ones get none."""
    tables = [
        {name: np.flatnonzero(flags).astype(np.int32) for name, flags in table.items() if flags.any()}
        for table in (regions, boundaries)
    ]
    return dataclasses.replace(mesh, _subdomains=tables[0], _boundaries=tables[1])


def are_between(mesh: skfem.Mesh, region: Integers, first: int, second: int) -> Flags:
    """Tell which facets (n_facets,) lie between cells of two regions, by each cell's number `region` (n_cells,)."""
    entry, other = region[mesh.f2t]
    between = ((entry == first) & (other == second)) | ((entry == second) & (other == first))
    return np.asarray(between & (mesh.f2t[1] >= 0))


def outward_normals(mesh: skfem.Mesh, facets: Integers, inside: Integers) -> Floats:
    """Return the unit normals (dim, k) of facets (k,), as if they were flat, away from a cell `inside` (k,) of each."""
    corners = mesh.p[:, mesh.facets[:, facets]]
    along = corners[:, 1] - corners[:, 0]
    if mesh.dim() == 2:
        normals = np.stack([along[1], -along[0]])
    else:
        normals = np.cross(along, corners[:, 2] - corners[:, 0], axis=0)
    outward = corners.mean(axis=1) - mesh.p[:, mesh.t[:, inside]].mean(axis=1)
    turned: Floats = normals * np.sign(np.sum(normals * outward, axis=0)) / np.linalg.norm(normals, axis=0)
    return turned
