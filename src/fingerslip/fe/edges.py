"""Free edges of a boundary: where it meets another part of the surface that no support holds.

A body that is cut off there may lack what would touch next. An edge at a plane of symmetry, or at a clamped face, is no
free edge.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingerslip.fe.space import Space, boundary_nodes

__all__ = ["free_edge_distances", "free_edge_nodes"]


def free_edge_nodes(space: Space, boundary: str, held: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the nodes of a boundary that also lie on another outer facet that is free.

    Arrays: held (n_nodes, dim); returns (n,).
    """
    own = np.asarray(space.mesh.boundaries[boundary])
    others = np.setdiff1d(space.mesh.boundary_facets(), own)
    if not others.size:
        return np.zeros(0, dtype=np.int64)
    others = others[~held[space.mesh.facets[:, others]].all(axis=0).any(axis=1)]
    free = space.full.get_dofs(facets=others).all() if others.size else np.zeros(0, dtype=np.int64)
    return np.intersect1d(boundary_nodes(space, boundary), free).astype(np.int64)


def free_edge_distances(
    space: Space, boundary: str, held: NDArray[np.bool_], nodes: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return how far nodes are from the nearest free edge of a boundary.

    Arrays: held (n_nodes, dim); nodes (n,); returns (n,) [m].
    """
    edge = free_edge_nodes(space, boundary, held)
    if not edge.size:
        return np.full(nodes.shape, np.inf)
    distances, _ = cKDTree(space.positions[edge]).query(space.positions[nodes])
    return np.asarray(distances, dtype=float)
