"""What the motion of all markers together says: rigid motion and what is left of it, strain, and entropy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.vision.fields.rigid import fit_rigid_motions
from fingerslip.vision.fields.triangles import green_strain, marker_means, marker_triangles, triangle_gradients

__all__ = ["entropy", "rigid_residual", "strains"]

Floats = NDArray[np.float64]


def rigid_residual(rest: Floats, displacement: Floats) -> Floats:
    """Return what is left of a displacement when the best rigid motion is taken away, shape (n_times, n_markers, 2).

    A contact that sticks moves its markers like a rigid body, one that slips in part does not: Dong et al. 2019.

    Arrays: rest (n_markers, 2); displacement (n_times, n_markers, 2).
    """
    return fit_rigid_motions(rest, rest + displacement).residual


def strains(rest: Floats, displacement: Floats) -> tuple[Floats, Floats]:
    """Return divergence and largest shear strain around each marker, each of shape (n_times, n_markers) [-].

    They are means over the triangles around it: of the trace of the displacement's gradient, and of half the difference
    of the principal values of Green's strain.

    Parameters
    ----------
    rest : (n_markers, 2) array
        Positions at rest.
    displacement : (n_times, n_markers, 2) array
        Displacements without gaps.

    Raises
    ------
    InputError
        Where a marker is in no triangle, as when all lie on a line.
    """
    triangles = marker_triangles(rest)
    alone = np.setdiff1d(np.arange(len(rest)), triangles)
    if alone.size:
        raise InputError(f"marker {alone[0]}", "is in no triangle of markers", "needs others on two sides of it")
    gradients = triangle_gradients(rest, rest + displacement, triangles)
    along_x, along_y, across = np.moveaxis(green_strain(gradients), -1, 0)
    divergence = gradients[..., 0, 0] + gradients[..., 1, 1]
    shear = np.hypot(0.5 * (along_x - along_y), across)
    return marker_means(divergence, rest, triangles), marker_means(shear, rest, triangles)


def entropy(displacement: Floats, bins: int = 16) -> Floats:
    """Return the Shannon entropy of the lengths of displacements at each time, shape (n_times,) [bit].

    It is 0 where all markers move alike, log2(bins) where their shares of the largest are even.

    Arrays: displacement (n_times, n_markers, 2).
    """
    length = np.linalg.norm(displacement, axis=2)
    largest = length.max(axis=1, keepdims=True)
    share = np.divide(length, largest, out=np.zeros_like(length), where=largest > 0)
    part = np.minimum((share * bins).astype(np.intp), bins - 1)
    counts = (part[:, :, None] == np.arange(bins)).sum(axis=1) / length.shape[1]
    logarithm = np.log2(counts, out=np.zeros_like(counts), where=counts > 0)
    found: Floats = -(counts * logarithm).sum(axis=1)
    return found + 0.0
