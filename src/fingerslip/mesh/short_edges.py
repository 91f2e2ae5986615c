"""Nodes that lie much closer together than elements are large are made one."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fingerslip.mesh.fragments import Fragments

__all__ = ["without_short_edges"]


def without_short_edges(found: Fragments, shortest: float) -> Fragments:
    """Return cells in which the ends of short edges are one node; cells with such an edge vanish.

    Where solids are cut along each other, edges may end a little beside others. The nodes of regions move by no more
    than a few times `shortest`.

    Parameters
    ----------
    found : Fragments
        Cells.
    shortest : float
        Edges that are shorter go [m].
    """
    corners = itertools.combinations(range(found.cells.shape[1]), 2)
    edges = np.vstack([found.cells[:, pair] for pair in corners])
    length = np.linalg.norm(found.points[edges[:, 0]] - found.points[edges[:, 1]], axis=1)
    first, second = edges[length < shortest].T
    count = len(found.points)
    links = coo_array((np.ones(len(first)), (first, second)), shape=(count, count))
    group: NDArray[np.int64] = connected_components(links, directed=False)[1]
    kept = np.unique(group, return_index=True)[1]
    cells = group[found.cells]
    ordered = np.sort(cells, axis=1)
    whole = (np.diff(ordered, axis=1) > 0).all(axis=1)
    return Fragments(found.points[kept], cells[whole], found.region[whole])
