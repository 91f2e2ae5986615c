"""Triangles of wanted sizes on a surface that is given by rows of points."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import gmsh
import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import MeshError
from fingerslip.mesh.gmsh_session import gmsh_session, length_unit

__all__ = ["Triangulation", "mesh_surface"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_POINT, _LINE, _TRIANGLE = 15, 1, 2
_FRONTAL = 6


@dataclass(frozen=True)
class Triangulation:
    """Triangles on a surface in 3D."""

    points: Floats  # (n, 3), node positions [m]
    triangles: Integers  # (m, 3), nodes of the triangles, counter-clockwise as seen from outside


def mesh_surface(grid: Floats, is_open: bool, divide_at: int, sizes: Floats) -> Triangulation:
    """Mesh a surface that closes at its last row, with nodes along the lines that quarter it and along one row.

    The quarters, divided at one row, are the patches that Gmsh parametrises and meshes.

    Arrays: grid (rows, columns, 3) [m]; sizes (rows, columns) [m].
    """
    number, unit = _numbers(grid, is_open), length_unit(float(sizes.max()))
    with gmsh_session():
        patches = _draw(number, grid / unit, (0, divide_at, len(grid) - 1))
        _set_sizes(number, grid / unit, sizes / unit)
        try:
            gmsh.model.mesh.createGeometry()
            gmsh.model.mesh.generate(2)
        except Exception as error:
            raise MeshError("surface", f"Gmsh says '{error}'", "needs a surface that Gmsh can mesh") from error
        return _read_triangles(patches, unit)


def _numbers(grid: Floats, is_open: bool) -> Integers:
    """Return the node number from one of every point of the grid, the same for the points of a closed row."""
    number = np.arange(1, grid.shape[0] * grid.shape[1] + 1).reshape(grid.shape[:2])
    number[-1] = number[-1, 0]
    if not is_open:
        number[0] = number[0, 0]
    return number


def _draw(number: Integers, grid: Floats, levels: tuple[int, ...]) -> list[int]:
    """Draw points, lines and patches with the lines and triangles of the grid; return the tags of the patches."""
    quarter = number.shape[1] // 4
    wrapped = np.column_stack([number, number[:, 0]])
    corners = np.unique(number[levels, :][:, ::quarter])
    points = {int(node): gmsh.model.addDiscreteEntity(0) for node in corners}
    lines = _lines(wrapped, levels, quarter)
    ends = {name: [points[int(line[end])] for end in (0, -1)] for name, line in lines.items()}
    tags = {name: gmsh.model.addDiscreteEntity(1, -1, pair) for name, pair in ends.items()}
    spans = [(first, last, k) for first, last in itertools.pairwise(levels) for k in range(4)]
    patches = [gmsh.model.addDiscreteEntity(2, -1, _border(tags, *part)) for part in spans]
    _add_nodes(patches[0], number, grid)
    for node, tag in points.items():
        gmsh.model.mesh.addElementsByType(tag, _POINT, [], [node])
    for name, line in lines.items():
        gmsh.model.mesh.addElementsByType(tags[name], _LINE, [], np.column_stack([line[:-1], line[1:]]).ravel())
    for tag, (first, last, k) in zip(patches, spans, strict=True):
        part = wrapped[first : last + 1, k * quarter : (k + 1) * quarter + 1]
        gmsh.model.mesh.addElementsByType(tag, _TRIANGLE, [], _triangles(part).ravel())
    gmsh.model.mesh.reclassifyNodes()
    return patches


_Name = tuple[str, int, int]


def _lines(wrapped: Integers, levels: tuple[int, ...], quarter: int) -> dict[_Name, Integers]:
    """Return the nodes of the lines between patches, by direction, first row and quarter."""
    lines = {}
    for k in range(4):
        for row in levels:
            if wrapped[row, 0] != wrapped[row, 1]:
                lines["across", row, k] = wrapped[row, k * quarter : (k + 1) * quarter + 1]
        for first, last in itertools.pairwise(levels):
            lines["along", first, k] = wrapped[first : last + 1, k * quarter]
    return lines


def _border(tags: dict[_Name, int], first: int, last: int, k: int) -> list[int]:
    names = [("along", first, k), ("along", first, (k + 1) % 4), ("across", first, k), ("across", last, k)]
    return [tags[name] for name in names if name in tags]


def _add_nodes(patch: int, number: Integers, grid: Floats) -> None:
    node, first = np.unique(number, return_index=True)
    gmsh.model.mesh.addNodes(2, patch, node, grid.reshape(-1, 3)[first].ravel())


def _triangles(number: Integers) -> Integers:
    """Return the triangles of a part of the grid, without those that a closed row makes flat."""
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    both = np.concatenate([np.stack([a, c, b], axis=-1), np.stack([a, d, c], axis=-1)]).reshape(-1, 3)
    whole = (both[:, 0] != both[:, 1]) & (both[:, 1] != both[:, 2]) & (both[:, 2] != both[:, 0])
    triangles: Integers = both[whole]
    return triangles


def _set_sizes(number: Integers, grid: Floats, sizes: Floats) -> None:
    """Take the size at the nearest point of the grid."""
    _, first = np.unique(number, return_index=True)
    view = gmsh.view.add("size")
    rows = np.column_stack([grid.reshape(-1, 3)[first], sizes.ravel()[first]])
    gmsh.view.addListData(view, "SP", len(rows), rows.ravel())
    field = gmsh.model.mesh.field.add("PostView")
    gmsh.model.mesh.field.setNumber(field, "ViewTag", view)
    gmsh.model.mesh.field.setNumber(field, "UseClosest", 1)
    gmsh.model.mesh.field.setAsBackgroundMesh(field)
    for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)
    gmsh.option.setNumber("Mesh.Algorithm", _FRONTAL)


def _read_triangles(patches: list[int], unit: float) -> Triangulation:
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    nodes = np.concatenate([gmsh.model.mesh.getElementsByType(_TRIANGLE, patch)[1] for patch in patches])
    used, triangles = np.unique(nodes, return_inverse=True)
    order = np.argsort(tags)
    rows = order[np.searchsorted(tags, used, sorter=order)]
    return Triangulation(coordinates.reshape(-1, 3)[rows] * unit, triangles.reshape(-1, 3))
