"""Local frames of contact nodes: the normal, then the tangents."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["contact_frames", "rotate_compliance", "sliding_direction"]

Array = NDArray[np.float64]


def contact_frames(normals: Array, direction: Array) -> Array:
    """Return orthonormal frames with the normal in the first row.

    Parameters
    ----------
    normals : (n, dim) array
        Unit normals.
    direction : (dim,) array
        In space, the first tangent is as near to this direction as the surface allows. In the plane the tangent
        is the normal turned clockwise: (1, 0) for the normal (0, 1).

    Returns
    -------
    (n, dim, dim) array
        Rows normal, first tangent and, in space, second tangent.
    """
    if normals.shape[1] == 2:
        return np.stack([normals, np.column_stack([normals[:, 1], -normals[:, 0]])], axis=1)
    along = direction - (normals @ direction)[:, None] * normals
    length = np.linalg.norm(along, axis=1)
    # Where the surface stands across the wanted direction, any tangent is as good.
    lost = length < 1e-6 * np.linalg.norm(direction)
    along[lost] = np.cross(normals[lost], np.roll(direction, 1))
    first = along / np.linalg.norm(along, axis=1, keepdims=True)
    return np.stack([normals, first, np.cross(normals, first)], axis=1)


def sliding_direction(normal: Array) -> Array:
    """Return the tangent along which a counterface slides where no direction is said, unit and shape (dim,).

    In the plane the normal turned clockwise; in space the x axis, or the z axis where the counterface faces x.
    """
    if normal.size == 2:
        return np.array([normal[1], -normal[0]])
    axis = np.eye(3)[0 if abs(normal[0]) < 0.9 else 2]
    along = axis - (axis @ normal) * normal
    unit: Array = along / np.linalg.norm(along)
    return unit


def rotate_compliance(compliance: Array, frames: Array) -> Array:
    """Turn a compliance (n * dim, n * dim) in global components into the nodes' frames (n, dim, dim)."""
    count, dim = frames.shape[:2]
    blocks = compliance.reshape(count, dim, count, dim)
    turned = np.einsum("aij,ajbk,blk->aibl", frames, blocks, frames, optimize=True)
    return np.ascontiguousarray(turned.reshape(count * dim, count * dim))
