"""Rigid counterfaces: where they start, how far points are from them, their normals, and the frames of nodes on them.

A counterface moves without turning. All points are given relative to its motion: a node at x, with a counterface that
has moved by s since the start, has the gap of the point x - s.
Small rotations of a rigid body that it is on are added to its gaps; see :mod:`fingerslip.dynamics.system.bodies`.
"""

from __future__ import annotations

import dataclasses
from typing import ClassVar, Protocol, Self

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.parameters import Length, PositiveLength, parameters


class Counterface(Protocol):
    """A rigid body that the deformable one may touch."""

    @property
    def dim(self) -> int:
        """Number of space dimensions, 2 or 3."""

    @property
    def unit_normal(self) -> Floats:
        """Direction in which the counterface presses, towards the deformable body, shape (dim,) [-]."""

    @property
    def is_flat(self) -> bool:
        """Whether its normal is the same everywhere, so that the frames of contact nodes never turn."""

    def at_start(self, points: Floats) -> Counterface:
        """Return the counterface at its start.

        Without a given position it just touches `points` (n, dim) [m], the boundary that it may touch.
        """

    def gap(self, points: Floats) -> Floats:
        """Return the distance of `points` (n, dim) [m] from the placed counterface, shape (n,) [m], negative inside."""

    def normals(self, points: Floats) -> Floats:
        """Return the outward unit normals nearest to `points` (n, dim) [m], same shape [-]."""

    def start_hint(self, gap: float) -> tuple[str, str]:
        """Return the field that says where the counterface starts, and what it needs, for a start inside the body.

        Both are parts of an error; `gap` is the least gap at the start [m], negative.
        """


class _Directed:
    """A counterface with the direction `normal` in which it presses."""

    normal: tuple[float, ...]

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return len(self.normal)

    @property
    def unit_normal(self) -> Floats:
        """Direction in which it presses, shape (dim,) [-]."""
        return _unit(self.normal, "normal")


@parameters
class Plane(_Directed):
    """A rigid half-space below a plane.

    Parameters
    ----------
    normal : tuple of float
        Outward normal, towards the deformable body; any length but zero [-].
    offset : float, optional
        Signed distance of the plane from the origin along `normal` at the start [m].
        Without it the plane starts where it just touches the boundary.

    Examples
    --------
    A level plate 8 mm below the origin, and how far two points are from it:

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> plate = fs.Plane(normal=(0.0, 1.0), offset=-8e-3)
    >>> plate.gap(np.array([[0.0, -7.5e-3], [1e-3, -8.1e-3]])).round(9).tolist()
    [0.0005, -0.0001]
    """

    is_flat: ClassVar[bool] = True

    normal: tuple[float, ...] = (0.0, 1.0)
    offset: Length | None = None

    def __post_init__(self) -> None:
        _unit(self.normal, "normal")

    def at_start(self, points: Floats) -> Plane:
        """Return the plane with its offset; it touches `points` (n, dim) [m] where none was given."""
        if self.offset is not None:
            return self
        return dataclasses.replace(self, offset=float(np.min(points @ self.unit_normal)))

    def gap(self, points: Floats) -> Floats:
        """Return the signed distance of `points` (n, dim) [m] from the placed plane, shape (n,) [m]."""
        return np.asarray(points @ self.unit_normal - (self.offset or 0.0))

    def normals(self, points: Floats) -> Floats:
        """Return the outward unit normal for each of `points` (n, dim) [m], same shape [-]."""
        return np.broadcast_to(self.unit_normal, points.shape).copy()

    def start_hint(self, gap: float) -> tuple[str, str]:
        """Return 'offset' and what it needs where the plane starts inside the body by -`gap` [m]."""
        return "offset", f"needs an offset <= {((self.offset or 0.0) + gap) * 1e3:.6g} mm"


@parameters
class _Round(_Directed):
    """What a sphere and a cylinder share: the points at a distance `radius` from a centre or an axis."""

    is_flat: ClassVar[bool] = False

    radius: PositiveLength
    normal: tuple[float, ...] = (0.0, 1.0)
    centre: tuple[Length, ...] | None = None

    def __post_init__(self) -> None:
        _unit(self.normal, "normal")
        if self.centre is not None and len(self.centre) != len(self.normal):
            raise InputError("centre", f"got {len(self.centre)} components", f"needs {len(self.normal)}")

    def at_start(self, points: Floats) -> Self:
        """Return the counterface with its centre; it touches `points` (n, dim) [m] where none was given."""
        if self.centre is not None:
            return self
        middle: Floats = 0.5 * (points.min(axis=0) + points.max(axis=0))
        relative, normal = self.across(points - middle), self.unit_normal
        height = relative @ normal
        beside = np.linalg.norm(relative - np.outer(height, normal), axis=1)
        near = beside < self.radius
        if not near.any():
            allowed = f"needs more than the {1e3 * beside.min():.3g} mm to the nearest node of the boundary"
            repair = "refine the mesh there, or give a centre"
            raise InputError("radius", f"got {1e3 * self.radius:.3g} mm", allowed, repair)
        # A point at height h that is d beside the line of centres is touched by a centre at h - sqrt(radius^2 - d^2).
        lowest = float(np.min(height[near] - np.sqrt(self.radius**2 - beside[near] ** 2)))
        return dataclasses.replace(self, centre=tuple(float(value) for value in middle + lowest * normal))

    def gap(self, points: Floats) -> Floats:
        """Return the signed distance of `points` (n, dim) [m] from the placed counterface, shape (n,) [m]."""
        return np.asarray(np.linalg.norm(self.across(points - np.asarray(self.centre)), axis=1) - self.radius)

    def normals(self, points: Floats) -> Floats:
        """Return the outward unit normals nearest to `points` (n, dim) [m], same shape [-]."""
        outward = self.across(points - np.asarray(self.centre))
        return np.asarray(outward / np.linalg.norm(outward, axis=1, keepdims=True))

    def start_hint(self, gap: float) -> tuple[str, str]:
        """Return 'centre' and what it needs where the counterface starts inside the body by -`gap` [m]."""
        return "centre", f"needs a centre at least {-gap * 1e3:.4g} mm further away"

    def across(self, vectors: Floats) -> Floats:
        """Return the part of `vectors` (n, dim) [m] that counts as distance; here all of it."""
        return vectors


@parameters
class Sphere(_Round):
    """A rigid ball.

    Parameters
    ----------
    radius : float
        Radius [m].
    normal : tuple of float
        Direction in which it presses, towards the deformable body; any length but zero [-].
    centre : tuple of float, optional
        Its centre at the start [m]. Without it the ball is below the middle of the boundary and just touches it.

    Examples
    --------
    A ball that presses upwards, 1 mm below a point:

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> ball = fs.Sphere(radius=5e-3, normal=(0.0, 1.0, 0.0), centre=(0.0, -6e-3, 0.0))
    >>> ball.gap(np.zeros((1, 3))).round(9).tolist()
    [0.001]
    """

    normal: tuple[float, ...] = (0.0, 0.0, 1.0)


@parameters
class Cylinder(_Round):
    """A rigid cylinder: a disc in 2D, infinitely long in 3D.

    Parameters
    ----------
    radius : float
        Radius [m].
    normal : tuple of float
        Direction in which it presses, towards the deformable body; any length but zero [-]. Without it y.
    centre : tuple of float, optional
        A point of its axis at the start [m]. Without it the cylinder is below the middle of the boundary and just
        touches it.
    axis : tuple of float, optional
        Direction of its axis in 3D, perpendicular to `normal` [-]; not in 2D.

    Examples
    --------
    A rod along z, and how far two points are from it:

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> rod = fs.Cylinder(radius=5e-3, centre=(0.0, -6e-3, 0.0), axis=(0.0, 0.0, 1.0))
    >>> rod.gap(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 7e-3]])).round(9).tolist()
    [0.001, 0.001]
    """

    axis: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if self.axis is not None and len(self.axis) == 3 and self.normal == (0.0, 1.0):
            object.__setattr__(self, "normal", (0.0, 1.0, 0.0))  # the default in 3D
        super().__post_init__()
        if (self.axis is None) != (self.dim == 2):
            raise InputError("axis", f"got {self.axis}", "needs a direction in 3D and none in 2D")
        if self.axis is not None and (len(self.axis) != 3 or abs(_unit(self.axis, "axis") @ self.unit_normal) > 1e-9):
            raise InputError("axis", f"got {self.axis}", "needs three components, perpendicular to the normal")

    def across(self, vectors: Floats) -> Floats:
        """Return the part of `vectors` (n, dim) [m] that is perpendicular to the axis."""
        if self.axis is None:
            return vectors
        axis = _unit(self.axis, "axis")
        return vectors - np.outer(vectors @ axis, axis)


# What study files can name, each by its class in snake case.
BuiltInCounterface = Plane | Cylinder | Sphere


def _unit(vector: tuple[float, ...], where: str) -> Floats:
    length = float(np.linalg.norm(vector))
    if len(vector) not in (2, 3) or not length > 0.0:
        raise InputError(where, f"got {vector}", "needs two or three components, not all zero")
    return np.asarray(vector, dtype=np.float64) / length


def contact_frames(normals: Floats, direction: Floats) -> Floats:
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


def in_frames(frames: Floats, forces: Floats) -> Floats:
    """Return forces in global components in frames whose tangents may have any length, both (n, dim)."""
    return np.asarray(np.einsum("cij,cj->ci", frames, forces) / np.einsum("cij,cij->ci", frames, frames))


def tangent_lengths(frames: Floats) -> Floats:
    """Return the lengths of the tangents of frames (n, dim, dim), shape (n, dim - 1) [-]."""
    return np.asarray(np.linalg.norm(frames[:, 1:], axis=2))


def sliding_direction(normal: Floats) -> Floats:
    """Return the unit tangent along which a counterface slides by default, shape (dim,) [-].

    In 2D, it is the unit normal (dim,) rotated clockwise; in 3D the x axis, or the z axis where the
    counterface faces x.
    """
    if normal.size == 2:
        return np.array([normal[1], -normal[0]])
    axis = np.eye(3)[0 if abs(normal[0]) < 0.9 else 2]
    along = axis - (axis @ normal) * normal
    return np.asarray(along / np.linalg.norm(along))


def rotate_compliance(compliance: Floats, frames: Floats) -> Floats:
    """Return a compliance in the nodes' frames, shape (n * dim, n * dim) [m/N].

    Arrays: compliance (n * dim, n * dim) [m/N]; frames (n, dim, dim) [-].
    """
    count, dim = frames.shape[:2]
    blocks = compliance.reshape(count, dim, count, dim)
    rotated = np.einsum("aij,ajbk,blk->aibl", frames, blocks, frames, optimize=True)
    return np.ascontiguousarray(rotated.reshape(count * dim, count * dim))
