"""Strain between markers: the triangles of their rest positions, and how each deforms."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["green_strain", "larger_principal", "marker_means", "marker_triangles", "triangle_gradients"]

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

_FLAT = 0.1  # height over longest edge of a triangle that is left out


def marker_triangles(rest: Floats) -> Ints:
    """Return the Delaunay triangles of markers at rest, shape (n_triangles, 3), counter-clockwise from x to y.

    Flat ones along the edge, whose strain would be noise, are left out: those whose height is below a tenth of their
    longest edge.

    Arrays: rest (n_markers, 2).
    """
    known = np.flatnonzero(~np.isnan(rest).any(axis=1))
    if known.size < 3:
        return np.empty((0, 3), dtype=np.intp)
    # Slow to load, and needed only here: commands that read a detector or a data set start without it.
    from scipy.spatial import Delaunay, QhullError

    try:
        corners = Delaunay(rest[known]).simplices
    except QhullError:  # all on one line
        return np.empty((0, 3), dtype=np.intp)
    edges = rest[known][np.roll(corners, -1, axis=1)] - rest[known][corners]
    twice = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    corners = np.where(twice[:, None] < 0, corners[:, ::-1], corners)
    longest = (edges**2).sum(axis=2).max(axis=1)
    chosen: Ints = known[corners[np.abs(twice) > _FLAT * longest]]
    return chosen


def triangle_gradients(rest: Floats, position: Floats, triangles: Ints) -> Floats:
    """Return the gradients of the displacement in triangles, exact where the motion is affine.

    Arrays: rest (n_markers, 2); position (n_times, n_markers, 2); triangles (n_triangles, 3); returns (n_times,
    n_triangles, 2, 2) [-].
    """
    before = rest[triangles[:, 1:]] - rest[triangles[:, :1]]
    after = position[:, triangles[:, 1:]] - position[:, triangles[:, :1]]
    # Edges are rows: those after are those before times the transposed deformation gradient.
    inverse = np.linalg.inv(before) if triangles.size else np.empty((0, 2, 2))
    return np.swapaxes(inverse @ after, 2, 3) - np.eye(2)


def green_strain(gradients: Floats) -> Floats:
    """Return Green's strain xx, yy, xy [-], shape (..., 3), of displacement gradients (..., 2, 2); 0 for rotations."""
    transposed = np.swapaxes(gradients, -1, -2)
    strain = 0.5 * (gradients + transposed + transposed @ gradients)
    return np.stack([strain[..., 0, 0], strain[..., 1, 1], strain[..., 0, 1]], axis=-1)


def marker_means(values: Floats, rest: Floats, triangles: Ints) -> Floats:
    """Return the mean over the triangles around each marker, by their areas at rest.

    Arrays: values (n_times, n_triangles); rest (n_markers, 2); triangles (n_triangles, 3); returns (n_times,
    n_markers).
    """
    first, second = (rest[triangles[:, corner]] - rest[triangles[:, 0]] for corner in (1, 2))
    areas = 0.5 * np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    around = np.zeros((len(triangles), len(rest)))
    around[np.arange(len(triangles))[:, None], triangles] = areas[:, None]
    known = ~np.isnan(values)
    weights = known.astype(np.float64) @ around
    with np.errstate(divide="ignore", invalid="ignore"):
        means: Floats = np.where(weights > 0, np.nan_to_num(values) @ around / weights, np.nan)
    return means


def larger_principal(strain: Floats) -> Floats:
    """Return the principal strain of larger size, with its sign.

    Arrays: strain (..., 3) [-]; returns (...) [-].

    Examples
    --------
    >>> import numpy as np
    >>> larger_principal(np.array([[0.1, -0.3, 0.0]])).tolist()
    [-0.3]
    """
    middle, half = 0.5 * (strain[..., 0] + strain[..., 1]), 0.5 * (strain[..., 0] - strain[..., 1])
    radius = np.hypot(half, strain[..., 2])
    larger: Floats = np.where(middle >= 0, middle + radius, middle - radius)
    return larger
