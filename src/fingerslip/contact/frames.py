"""Local frames of contact nodes: the normal, then the tangents."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def contact_frames(normals: Array, direction: Array) -> Array:
    """Return orthonormal frames with the normal in the first row.

    Arrays: normals (n, dim) [-]; direction (dim,) [-]; returns (n, dim, dim) [-].
    """
    if normals.shape[1] == 2:
        return np.stack([normals, np.column_stack([normals[:, 1], -normals[:, 0]])], axis=1)
    along = direction - (normals @ direction)[:, None] * normals
    length = np.linalg.norm(along, axis=1)
    # Where the surface is perpendicular to the direction, any tangent will do.
    lost = length < 1e-6 * np.linalg.norm(direction)
    along[lost] = np.cross(normals[lost], np.roll(direction, 1))
    first = along / np.linalg.norm(along, axis=1, keepdims=True)
    return np.stack([normals, first, np.cross(normals, first)], axis=1)


def in_frames(frames: Array, forces: Array) -> Array:
    """Return forces in global components in frames whose tangents may have any length, both (n, dim).

    Examples
    --------
    >>> in_frames(np.array([[[0.0, 1.0], [2.0, 0.0]]]), np.array([[3.0, 5.0]])).tolist()
    [[5.0, 1.5]]
    """
    return np.asarray(np.einsum("cij,cj->ci", frames, forces) / np.einsum("cij,cij->ci", frames, frames))


def tangent_lengths(frames: Array) -> Array:
    """Return the lengths of the tangents of frames (n, dim, dim), shape (n, dim - 1) [-]."""
    return np.asarray(np.linalg.norm(frames[:, 1:], axis=2))


def sliding_direction(normal: Array) -> Array:
    """Return the unit tangent along which a counterface slides by default, shape (dim,) [-].

    In 2D, it is the unit normal (dim,) rotated clockwise; in 3D the x axis, or the z axis where the
    counterface faces x.
    """
    if normal.size == 2:
        return np.array([normal[1], -normal[0]])
    axis = np.eye(3)[0 if abs(normal[0]) < 0.9 else 2]
    along = axis - (axis @ normal) * normal
    return np.asarray(along / np.linalg.norm(along))


def rotate_compliance(compliance: Array, frames: Array) -> Array:
    """Return a compliance in the nodes' frames, shape (n * dim, n * dim) [m/N].

    Arrays: compliance (n * dim, n * dim) [m/N]; frames (n, dim, dim) [-].
    """
    count, dim = frames.shape[:2]
    blocks = compliance.reshape(count, dim, count, dim)
    rotated = np.einsum("aij,ajbk,blk->aibl", frames, blocks, frames, optimize=True)
    return np.ascontiguousarray(rotated.reshape(count * dim, count * dim))
