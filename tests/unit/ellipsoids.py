"""Closed surfaces whose volume and depth are known."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from fingerslip.mesh.scan.surfaces import Surface


def ellipsoid(
    half_axes: tuple[float, float, float] = (12e-3, 8e-3, 7e-3),
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0),
    points: int = 500,
    name: str = "ellipsoid",
) -> Surface:
    """Return an ellipsoid with its normals outwards, its points on a spiral."""
    place = (np.arange(points) + 0.5) / points
    height, turn = 1 - 2 * place, np.pi * (1 + 5**0.5) * np.arange(points)
    ring = np.sqrt(1 - height**2)
    sphere = np.column_stack([ring * np.cos(turn), ring * np.sin(turn), height])
    triangles = ConvexHull(sphere).simplices.astype(np.int64)
    a, b, c = np.moveaxis(sphere[triangles], 1, 0)
    inwards = np.sum(np.cross(b - a, c - a) * a, axis=1) < 0
    triangles[inwards] = triangles[inwards][:, ::-1]
    return Surface(sphere * half_axes + centre, triangles, name)


def together(*surfaces: Surface) -> Surface:
    """Return surfaces as one, without joining them."""
    first = np.cumsum([0, *(len(surface.points) for surface in surfaces)])
    triangles = [surface.triangles + start for surface, start in zip(surfaces, first, strict=False)]
    return Surface(np.vstack([s.points for s in surfaces]), np.vstack(triangles), "together")


def with_hole(surface: Surface, centre: tuple[float, float, float], radius: float) -> Surface:
    """Drop the triangles near a point."""
    off = np.linalg.norm(surface.corners.mean(axis=1) - centre, axis=1)
    return Surface(surface.points, surface.triangles[off > radius], "holed")
