"""Which nodes of a boundary a plane can touch, those that grooves do not hide; and patches of such nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import ConvexHull, cKDTree

__all__ = ["depth_in_hull", "patches"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Facets of the hull that face the plane less than this (cosine) are the sides and the back of the body.
_FACING = 0.05
# Times that the middles of patches move to the middle of their nodes.
_ROUNDS = 4


def depth_in_hull(points: Floats, normal: Floats) -> Floats:
    """Return how deep points lie inside their convex hull, seen from a plane, shape (n,) [m].

    A plane touches a body at rest where this is zero. Where the body gives way, it comes to touch what lies a little
    deeper; the bottom of a groove is as deep as the groove.

    Arrays: points (n, dim) [m]; normal (dim,) [-].

    Examples
    --------
    A groove between two crowns, above a plane:

    >>> ridges = np.array([[-9.0, 9.0], [-5.0, 0.0], [0.0, 3.0], [5.0, 0.0], [9.0, 9.0]])
    >>> depth_in_hull(ridges, np.array([0.0, 1.0])).round(9).tolist()
    [0.0, 0.0, 3.0, 0.0, 0.0]
    """
    equations = ConvexHull(points).equations
    facing = equations[equations[:, :-1] @ normal < -_FACING]
    deep: Floats = (-(points @ facing[:, :-1].T) - facing[:, -1]).min(axis=1)
    return np.maximum(deep, 0.0)


def patches(points: Floats, area: Floats, distance: float) -> tuple[Integers, sparse.csr_matrix]:
    """Divide nodes into patches of about one size, those nearest to each of some middles.

    Arrays: points (n, dim) [m]; area (n,) [m^2]; distance [m]; returns middles (k,); means [-].

    Examples
    --------
    >>> line = np.column_stack([np.arange(4.0), np.zeros(4)])
    >>> middles, means = patches(line, np.array([1.0, 1.0, 1.0, 3.0]), 1.5)
    >>> means.toarray().round(2).tolist()
    [[0.5, 0.5, 0.0, 0.0], [0.0, 0.0, 0.25, 0.75]]
    """
    places = points[_apart(points, distance)]
    for _ in range(_ROUNDS):
        owner = cKDTree(places).query(points)[1]
        places = np.asarray(_means(owner, area) @ points)
    owner = cKDTree(places).query(points)[1]
    means = _means(owner, area)
    nearest: Integers = cKDTree(points).query(np.asarray(means @ points))[1].astype(np.int64)
    return nearest, means


def _apart(points: Floats, distance: float) -> Integers:
    """Return points in order of which each is at least a distance from all before it."""
    if distance <= 0.0:
        return np.arange(len(points))
    tree, free = cKDTree(points), np.ones(len(points), dtype=bool)
    chosen = []
    for number in range(len(points)):
        if free[number]:
            chosen.append(number)
            free[tree.query_ball_point(points[number], distance)] = False
    return np.array(chosen)


def _means(owner: NDArray[np.intp], area: Floats) -> sparse.csr_matrix:
    """Return the map (k, n) that takes the means of what belongs to each of k owners; those of nothing are left out."""
    number = np.unique(owner, return_inverse=True)[1]
    summed = sparse.csr_matrix((area, (number, np.arange(len(area)))))
    return sparse.csr_matrix(sparse.diags(1.0 / np.asarray(summed.sum(axis=1)).ravel()) @ summed)
