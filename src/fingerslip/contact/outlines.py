"""Outlines of counterfaces, for pictures and other programs: points of their surfaces near the body at the start."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.contact.candidates import Candidates
from fingerslip.contact.counterfaces import Counterface, contact_frames, sliding_direction

# By dimensions, of a curved counterface: points along a side of its outline, how far these reach to each side over the
# largest extent of the body, and how much closer they are in the middle, as the exponent of a hyperbolic sine.
_POINTS, _REACH, _GRADING = {2: 121, 3: 25}, {2: 2.0, 3: 0.6}, {2: 5.0, 3: 2.0}
# Projections onto the surface; the first is exact where a gap is a distance.
_PROJECTIONS = 3


def counterface_outlines(shapes: Sequence[Counterface], candidates: Candidates, extent: float) -> Floats:
    """Return points of placed counterfaces, (n, rows, columns, dim) [m]; one column in 2D, the ends alone of flat ones.

    `extent` is the largest of the body [m].
    """
    dim = candidates.dim
    steps = np.array([-1.0, 1.0])
    if not all(shape.is_flat for shape in shapes):
        steps = np.sinh(_GRADING[dim] * np.linspace(-1.0, 1.0, _POINTS[dim])) / np.sinh(_GRADING[dim])
    outlines = [
        _outline(shape, candidates.positions[candidates.counterface == number], _REACH[dim] * extent * steps)
        for number, shape in enumerate(shapes)
    ]
    return np.reshape(outlines, (len(shapes), steps.size, steps.size if dim == 3 else 1, dim))


def _outline(shape: Counterface, near: Floats, steps: Floats) -> Floats:
    """Return what a tangent grid, of steps (n,) [m] around the middle of points (k, dim) [m], is projected to."""
    normal = shape.unit_normal
    tangents = contact_frames(normal[None], sliding_direction(normal))[0, 1:]
    sides = np.meshgrid(*[steps] * len(tangents), indexing="ij")
    middle = 0.5 * (near.min(axis=0) + near.max(axis=0))
    grid = _projected(shape, middle[None]) + np.stack([side.ravel() for side in sides], axis=1) @ tangents
    # From outside: points within a ball would go to its far side.
    return _projected(shape, grid - min(float(shape.gap(grid).min()), 0.0) * normal)


def _projected(shape: Counterface, points: Floats) -> Floats:
    """Return the points of a surface that are nearest to points (n, dim) [m]."""
    for _ in range(_PROJECTIONS):
        points = points - shape.gap(points)[:, None] * shape.normals(points)
    return points
