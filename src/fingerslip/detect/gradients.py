"""What the motion of all markers together says: rigid motion and what is left of it, and gradients in the skin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError

__all__ = ["entropy", "gradient_operators", "rigid_residual", "strains"]

Floats = NDArray[np.float64]


def rigid_residual(rest: Floats, displacement: Floats) -> Floats:
    """Return what is left of a displacement when the best small rigid motion is taken away.

    The motion is a translation and a small rotation, fitted by least squares. A contact that sticks moves its markers
    like a rigid body, one that slips in part does not: Dong et al. 2019.

    Parameters
    ----------
    rest : (n_markers, 2) array
        Positions at rest.
    displacement : (n_times, n_markers, 2) array
        Displacements.

    Returns
    -------
    (n_times, n_markers, 2) array
        The residual.

    Examples
    --------
    >>> rest = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    >>> turned = 0.01 * np.stack([-rest[:, 1], rest[:, 0]], axis=1) + 3.0
    >>> bool(np.allclose(rigid_residual(rest, turned[None]), 0.0))
    True
    """
    arm = rest - rest.mean(axis=0)
    across = np.stack([-arm[:, 1], arm[:, 0]], axis=1)
    left = displacement - displacement.mean(axis=1, keepdims=True)
    inertia = (across**2).sum()
    turn = np.einsum("tmd,md->t", left, across) / inertia if inertia > 0 else np.zeros(len(left))
    residual: Floats = left - turn[:, None, None] * across
    return residual


def gradient_operators(rest: Floats, neighbours: int = 7) -> Floats:
    """Return the operators that give the gradient of a quantity at each marker, shape (2, n_markers, n_markers).

    At each marker a plane is fitted by least squares through it and its nearest neighbours.

    Parameters
    ----------
    rest : (n_markers, 2) array
        Positions at rest.
    neighbours : int, optional
        Markers in each fit, itself included.

    Raises
    ------
    InputError
        Where markers are fewer than three, or those of a fit lie on a line.
    """
    count = len(rest)
    if count < 3:
        raise InputError("markers", f"got {count}", "needs at least three for gradients", "choose other features")
    operators = np.zeros((2, count, count))
    for marker in range(count):
        nearest = np.argsort(((rest - rest[marker]) ** 2).sum(axis=1), kind="stable")[:neighbours]
        arm = rest[nearest] - rest[nearest].mean(axis=0)
        if np.linalg.matrix_rank(arm, tol=1e-6 * np.abs(arm).max()) < 2:
            raise InputError(f"marker {marker}", "lies on a line with its neighbours", "needs some beside it")
        operators[:, marker, nearest] = np.linalg.pinv(arm)
    return operators


def strains(operators: Floats, displacement: Floats) -> tuple[Floats, Floats]:
    """Return divergence and largest shear strain at each marker, each of shape (n_times, n_markers) [-].

    Parameters
    ----------
    operators : (2, n_markers, n_markers) array
        Those of :func:`gradient_operators`.
    displacement : (n_times, n_markers, 2) array
        Displacements, in the unit of the positions.
    """
    along_x, along_y = (displacement.transpose(2, 0, 1) @ one.T for one in operators)
    normal_x, normal_y = along_x[0], along_y[1]
    shear = 0.5 * (along_y[0] + along_x[1])
    return normal_x + normal_y, np.hypot(0.5 * (normal_x - normal_y), shear)


def entropy(displacement: Floats, bins: int = 16) -> Floats:
    """Return the Shannon entropy of the lengths of displacements at each time, shape (n_times,) [bit].

    It is 0 where all markers move alike, log2(bins) where their shares of the largest are even.

    Parameters
    ----------
    displacement : (n_times, n_markers, 2) array
        Displacements.
    bins : int, optional
        Equal parts of the largest length into which the lengths are counted.
    """
    length = np.linalg.norm(displacement, axis=2)
    largest = length.max(axis=1, keepdims=True)
    share = np.divide(length, largest, out=np.zeros_like(length), where=largest > 0)
    part = np.minimum((share * bins).astype(np.intp), bins - 1)
    counts = (part[:, :, None] == np.arange(bins)).sum(axis=1) / length.shape[1]
    logarithm = np.log2(counts, out=np.zeros_like(counts), where=counts > 0)
    found: Floats = -(counts * logarithm).sum(axis=1)
    return found + 0.0
