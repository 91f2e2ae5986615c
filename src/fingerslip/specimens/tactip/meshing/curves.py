"""Curves and surfaces of Gmsh's OpenCASCADE kernel, drawn in the plane z = 0."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import gmsh
import numpy as np
from numpy.typing import NDArray

from fingerslip.mesh.gmsh_session import MILLIMETRES

__all__ = ["SmoothCurves", "polygon", "smooth_curves"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class SmoothCurves:
    """A line drawn in pieces."""

    points: list[int]  # tags of the points between pieces, and of both ends
    curves: list[int]  # tags of the pieces


def smooth_curves(line: Floats, corners: Integers, first: int | None = None) -> SmoothCurves:
    """Draw a line as cubic splines through its points, one for each piece.

    Arrays: line (n, 2) [m]; corners (k,).
    """
    tags = [_point(point) for point in line[1:]]
    tags = [_point(line[0]) if first is None else first, *tags]
    pieces = [tags[start : end + 1] for start, end in itertools.pairwise(corners)]
    return SmoothCurves([tags[row] for row in corners], [gmsh.model.occ.addSpline(piece) for piece in pieces])


def polygon(corners: Floats) -> int:
    """Draw the surface inside a polygon of (n, 2) corners [m]; return its tag."""
    points = [_point(corner) for corner in corners]
    lines = [gmsh.model.occ.addLine(a, b) for a, b in zip(points, [*points[1:], points[0]], strict=True)]
    surface: int = gmsh.model.occ.addPlaneSurface([gmsh.model.occ.addCurveLoop(lines)])
    return surface


def _point(point: Floats) -> int:
    tag: int = gmsh.model.occ.addPoint(*(point * MILLIMETRES), 0.0)
    return tag
