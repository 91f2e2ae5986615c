"""Rigid counter-surfaces: where they are, and how far a point is from them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.parameters import SignedLength, parameters

__all__ = ["Plane"]


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
        if len(self.normal) not in (2, 3) or not np.linalg.norm(self.normal) > 0:
            raise InputError("normal", f"got {self.normal}", "needs two or three components, not all zero")

    @property
    def unit_normal(self) -> NDArray[np.float64]:
        """Outward unit normal, shape (dim,)."""
        normal = np.asarray(self.normal, dtype=float)
        unit: NDArray[np.float64] = normal / np.linalg.norm(normal)
        return unit

    @property
    def tangent(self) -> NDArray[np.float64]:
        """Unit tangent of a plane in 2D: the normal turned clockwise, so (1, 0) for the normal (0, 1)."""
        normal = self.unit_normal
        return np.array([normal[1], -normal[0]])

    def touching_offset(self, points: NDArray[np.float64]) -> float:
        """Return the offset [m] at which the plane just touches `points`, shape (n_points, dim) [m]."""
        return float(np.min(points @ self.unit_normal))

    def gap(self, points: NDArray[np.float64], offset: float) -> NDArray[np.float64]:
        """Return the signed distance [m] of `points` (n_points, dim) [m] from the plane, negative inside it."""
        return points @ self.unit_normal - offset
