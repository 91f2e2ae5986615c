"""Rigid counter-surfaces: where they are, how far points are from them, and which way they face."""

from __future__ import annotations

import dataclasses
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.parameters import PositiveLength, SignedLength, parameters

__all__ = ["Counterface", "Cylinder", "Plane", "Sphere"]

Array = NDArray[np.float64]


@parameters
class Plane:
    """A rigid half-space below a plane, which may move without turning.

    Parameters
    ----------
    normal : tuple of float
        Outward normal, towards the deformable body; any length but zero [-].
    offset : float, optional
        Signed distance of the plane from the origin along `normal` at the start [m].
        Without it the plane starts where it just touches the boundary.
    """

    normal: tuple[float, ...] = (0.0, 1.0)
    offset: SignedLength | None = None

    def __post_init__(self) -> None:
        _unit(self.normal, "normal")

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return len(self.normal)

    @property
    def unit_normal(self) -> Array:
        """Direction in which the counterface presses: the outward unit normal, shape (dim,)."""
        return _unit(self.normal, "normal")

    def placed(self, points: Array) -> Plane:
        """Return the plane with its offset, the touching one of `points` (n_points, dim) [m] where none was given."""
        if self.offset is not None:
            return self
        return dataclasses.replace(self, offset=float(np.min(points @ self.unit_normal)))

    def gap(self, points: Array) -> Array:
        """Return the signed distance [m] of `points` (n_points, dim) [m] from a placed plane, negative inside it."""
        height: Array = points @ self.unit_normal - (self.offset or 0.0)
        return height

    def normals(self, points: Array) -> Array:
        """Return the outward unit normal nearest to each of `points` (n_points, dim), same shape."""
        return np.broadcast_to(self.unit_normal, points.shape).copy()


@parameters
class Sphere:
    """A rigid ball.

    Parameters
    ----------
    radius : float
        [m].
    normal : tuple of float
        Direction in which it presses, towards the deformable body; any length but zero [-].
    centre : tuple of float, optional
        Where its centre starts [m]. Without it the ball is below the middle of the boundary and just touches it.
    """

    radius: PositiveLength
    normal: tuple[float, ...] = (0.0, 0.0, 1.0)
    centre: tuple[SignedLength, ...] | None = None

    def __post_init__(self) -> None:
        _unit(self.normal, "normal")
        _check_centre(self.centre, self.normal)

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return len(self.normal)

    @property
    def unit_normal(self) -> Array:
        """Direction in which the counterface presses, shape (dim,)."""
        return _unit(self.normal, "normal")

    def placed(self, points: Array) -> Sphere:
        """Return the ball with its centre, touching `points` (n_points, dim) [m] where none was given."""
        return _placed(self, points)

    def gap(self, points: Array) -> Array:
        """Return the signed distance [m] of `points` (n_points, dim) [m] from a placed ball, negative inside it."""
        return _round_gap(self, points)

    def normals(self, points: Array) -> Array:
        """Return the outward unit normal nearest to each of `points` (n_points, dim), same shape."""
        return _round_normals(self, points)

    def across(self, vectors: Array) -> Array:
        """Return the part of vectors (n, dim) that counts as distance from the centre: all of it."""
        return vectors


@parameters
class Cylinder:
    """A rigid cylinder: a disc in the plane, infinitely long in space.

    Parameters
    ----------
    radius : float
        [m].
    normal : tuple of float
        Direction in which it presses, towards the deformable body; any length but zero [-].
    centre : tuple of float, optional
        Where a point of its axis starts [m]. Without it the cylinder is below the middle of the boundary and just
        touches it.
    axis : tuple of float, optional
        Direction of its axis in space, square to `normal` [-]; not in the plane.
    """

    radius: PositiveLength
    normal: tuple[float, ...] = (0.0, 1.0)
    centre: tuple[SignedLength, ...] | None = None
    axis: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        normal = _unit(self.normal, "normal")
        _check_centre(self.centre, self.normal)
        if (self.axis is None) != (len(self.normal) == 2):
            raise InputError("axis", f"got {self.axis}", "needs a direction in space and none in the plane")
        if self.axis is not None and (len(self.axis) != 3 or abs(_unit(self.axis, "axis") @ normal) > 1e-9):
            raise InputError("axis", f"got {self.axis}", "needs three components, square to the normal")

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return len(self.normal)

    @property
    def unit_normal(self) -> Array:
        """Direction in which the counterface presses, shape (dim,)."""
        return _unit(self.normal, "normal")

    def placed(self, points: Array) -> Cylinder:
        """Return the cylinder with its centre, touching `points` (n_points, dim) [m] where none was given."""
        return _placed(self, points)

    def gap(self, points: Array) -> Array:
        """Return the signed distance [m] of `points` (n_points, dim) [m] from a placed cylinder, negative inside it."""
        return _round_gap(self, points)

    def normals(self, points: Array) -> Array:
        """Return the outward unit normal nearest to each of `points` (n_points, dim), same shape."""
        return _round_normals(self, points)

    def across(self, vectors: Array) -> Array:
        """Return the part of vectors (n, dim) that counts as distance from the axis: that across it."""
        if self.axis is None:
            return vectors
        axis = _unit(self.axis, "axis")
        return vectors - np.outer(vectors @ axis, axis)


Counterface = Plane | Cylinder | Sphere

Round = TypeVar("Round", Cylinder, Sphere)


def _unit(vector: tuple[float, ...], where: str) -> Array:
    length = float(np.linalg.norm(vector))
    if len(vector) not in (2, 3) or not length > 0.0:
        raise InputError(where, f"got {vector}", "needs two or three components, not all zero")
    return np.asarray(vector, dtype=np.float64) / length


def _check_centre(centre: tuple[float, ...] | None, normal: tuple[float, ...]) -> None:
    if centre is not None and len(centre) != len(normal):
        raise InputError("centre", f"got {len(centre)} components", f"needs {len(normal)}")


def _placed(counterface: Round, points: Array) -> Round:
    """Return a round counterface with its centre, below the middle of `points` (n, dim) [m] where none was given."""
    if counterface.centre is not None:
        return counterface
    middle: Array = 0.5 * (points.min(axis=0) + points.max(axis=0))
    relative = counterface.across(points - middle)
    return dataclasses.replace(
        counterface, centre=_touching_centre(relative, middle, counterface.unit_normal, counterface.radius)
    )


def _round_gap(counterface: Sphere | Cylinder, points: Array) -> Array:
    """Return the signed distance [m] of `points` (n, dim) [m] from a placed round counterface."""
    distance: Array = (
        np.linalg.norm(counterface.across(points - np.asarray(counterface.centre)), axis=1) - counterface.radius
    )
    return distance


def _round_normals(counterface: Sphere | Cylinder, points: Array) -> Array:
    """Return the outward unit normals of a placed round counterface nearest to `points` (n, dim)."""
    outward = counterface.across(points - np.asarray(counterface.centre))
    unit: Array = outward / np.linalg.norm(outward, axis=1, keepdims=True)
    return unit


def _touching_centre(relative: Array, middle: Array, normal: Array, radius: float) -> tuple[float, ...]:
    """Return the centre below `middle` at which a ball just touches points at `relative` (n, dim) to it.

    A point at height h along the normal and distance d beside the line of centres is touched by a centre at
    h - sqrt(radius^2 - d^2); the lowest of these counts.
    """
    height = relative @ normal
    beside = np.linalg.norm(relative - np.outer(height, normal), axis=1)
    near = beside < radius
    lowest = float(np.min(height[near] - np.sqrt(radius**2 - beside[near] ** 2)))
    return tuple(float(value) for value in middle + lowest * normal)
