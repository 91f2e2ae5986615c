"""Gmsh opened for one mesh at a time: shapes cut along each other, and surfaces given by rows of points, are meshed."""

from __future__ import annotations

import itertools
import signal
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import gmsh
import numpy as np
import pygmsh
from numpy.typing import NDArray
from scipy.sparse import coo_array

from fingerslip.arrays import Floats, Integers
from fingerslip.errors import MeshError
from fingerslip.mesh.facets import connected_pieces
from fingerslip.mesh.scan.surfaces import Surface

MILLIMETRES = 1e3
"""Gmsh's tolerances suit lengths near one, so it works in millimetres."""

#: Wanted element size [m] at a point x, y, z [m].
SizeAt = Callable[[float, float, float], float]

_GMSH_IN_USE = threading.Lock()
_Entity = tuple[int, int]
# Kinds of cells in Gmsh by their corners.
_KINDS = {(2, 3): 2, (2, 4): 3, (3, 4): 4}
# Straight edges in place of a circle, at least, in 2D.
_SEGMENTS_OF_A_CIRCLE = 20
_QUADRILATERALS_ONLY = 2
_PLANE = 2
#: Kinds of cells in Gmsh.
_POINT, _LINE, TRIANGLE, TETRAHEDRON = 15, 1, 2, 4
_FRONTAL, _DELAUNAY = 6, 5


class _QuietGeometry(pygmsh.geo.Geometry):  # type: ignore[misc]
    """Geometry that leaves Python's handling of Ctrl-C alone and reads no configuration of the user's."""

    def __enter__(self) -> _QuietGeometry:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
        for option, value in (("General.Terminal", 0), ("General.NumThreads", 1), ("Mesh.RandomSeed", 1)):
            gmsh.option.setNumber(option, value)
        gmsh.model.add("fingertip")
        return self


@contextmanager
def gmsh_session() -> Iterator[pygmsh.geo.Geometry]:
    """Open Gmsh for one mesh, one at a time, and close it whatever happens."""
    with _GMSH_IN_USE, _broken_pipes_as_before():
        if gmsh.isInitialized():
            raise MeshError("gmsh", "is already initialised", "needs a Gmsh of its own", "call gmsh.finalize() first")
        with _QuietGeometry() as geometry:
            yield geometry


@contextmanager
def _broken_pipes_as_before() -> Iterator[None]:
    """Keep the handling of broken pipes: Gmsh has them end the process, also where only a worker is lost."""
    in_main_thread = threading.current_thread() is threading.main_thread()
    if not in_main_thread or not hasattr(signal, "SIGPIPE"):
        yield
        return
    before = signal.getsignal(signal.SIGPIPE)
    try:
        yield
    finally:
        signal.signal(signal.SIGPIPE, before)


@contextmanager
def gmsh_errors(where: str, allowed: str) -> Iterator[None]:
    """Turn what Gmsh raises in the block into a :class:`MeshError`."""
    try:
        yield
    except Exception as error:
        raise MeshError(where, f"Gmsh says '{error}'", allowed) from error


def length_unit(largest: float) -> float:
    """Return the length [m] that Gmsh takes as one where the largest element size is `largest` [m].

    On surfaces that are given as triangles Gmsh makes no element larger than one, whatever size it is told.
    """
    return 2.0 * largest


def sizes_from_fields_alone() -> None:
    """Have Gmsh take no sizes from boundaries, points and curvature."""
    for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)


def node_positions(tags: NDArray[np.integer]) -> Floats:
    """Return the positions (k, 3) of Gmsh's nodes with some tags (k,), in its unit."""
    known_tags, positions, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(known_tags)
    return np.asarray(positions.reshape(-1, 3)[order[np.searchsorted(known_tags, tags, sorter=order)]])


@dataclass(frozen=True)
class Fragments:
    """Cells of the regions of a mesh."""

    points: Floats  # (n, dim), node positions [m]
    cells: Integers  # (m, corners), nodes of all cells, region after region
    region: Integers  # (m,), number of the region of each cell, in the order in which they were named


def fragment(shapes: Mapping[str, Sequence[int]], points: Floats, dim: int) -> dict[str, list[int]]:
    """Cut shapes of Gmsh's OpenCASCADE kernel along each other, with nodes at points (k, dim) [m]."""
    nodes = [(0, gmsh.model.occ.addPoint(*point * MILLIMETRES, *[0.0] * (3 - dim))) for point in points]
    drawn = {name: [(dim, tag) for tag in tags] for name, tags in shapes.items()}
    with gmsh_errors("shapes", "needs shapes that can be cut"):
        # Later regions keep no lines of what they cover. In 3D cutting first takes many times as long; there the faces
        # inside covered solids are taken out afterwards.
        separate: dict[str, list[_Entity]] = {}
        for name, shape in reversed(drawn.items()):
            over = [piece for pieces in separate.values() for piece in pieces] if dim == _PLANE else []
            separate[name] = list(gmsh.model.occ.cut(shape, over, removeTool=False)[0]) if over and shape else shape
        separate = {name: separate[name] for name in drawn}
        every = [piece for pieces in separate.values() for piece in pieces]
        _, pieces = gmsh.model.occ.fragment(every[:1], [*every[1:], *nodes])
    gmsh.model.occ.synchronize()
    names = [name for name, shape_pieces in separate.items() for _ in shape_pieces]
    owner = {tag: name for name, of_shape in zip(names, pieces, strict=False) for _, tag in of_shape}
    result = {name: sorted(tag for tag, other in owner.items() if other == name) for name in shapes}
    empty = next((name for name, tags in result.items() if shapes[name] and not tags), None)
    if empty is not None:
        raise MeshError(empty, "is covered by other regions", "needs some room of its own")
    return result if dim == _PLANE else {name: _without_inner_faces(tags) for name, tags in result.items()}


def _without_inner_faces(volumes: Sequence[int]) -> list[int]:
    """Make one volume of those that touch, as faces between them would leave slivers; return the tags."""
    faces = [[face for _, face in gmsh.model.getBoundary([(3, tag)], oriented=False)] for tag in volumes]
    face, row = np.concatenate(faces), np.repeat(np.arange(len(faces)), [len(of_volume) for of_volume in faces])
    of_face = coo_array((np.ones(len(face)), (row, np.unique(face, return_inverse=True)[1]))).tocsr()
    group = connected_pieces(len(faces), np.stack((of_face @ of_face.T).nonzero()))
    joined = [
        _join([(volumes[row], faces[row]) for row in np.flatnonzero(group == number).tolist()])
        for number in np.unique(group)
    ]
    gmsh.model.occ.synchronize()
    return sorted(joined)


def _join(pieces: Sequence[tuple[int, list[int]]]) -> int:
    """Make one volume of pieces and their faces; it keeps the faces that it shares with others, as they are."""
    if len(pieces) == 1:
        return pieces[0][0]
    faces, uses = np.unique(np.concatenate([of_piece for _, of_piece in pieces]), return_counts=True)
    gmsh.model.occ.remove([(3, tag) for tag, _ in pieces])
    joined: int = gmsh.model.occ.addVolume([gmsh.model.occ.addSurfaceLoop(faces[uses == 1].tolist())])
    gmsh.model.occ.remove([(2, face) for face in faces[uses > 1].tolist()], recursive=True)
    return joined


def generate(dim: int, size: SizeAt, *, quadrilaterals: bool = False, segments: float = _SEGMENTS_OF_A_CIRCLE) -> None:
    """Mesh what was cut, with element sizes [m] given point by point."""

    # Gmsh passes the size that bends need.
    def callback(_dim: int, _tag: int, x: float, y: float, z: float, bend: float) -> float:
        return min(bend, MILLIMETRES * size(x / MILLIMETRES, y / MILLIMETRES, z / MILLIMETRES))

    gmsh.model.mesh.setSizeCallback(callback)
    sizes_from_fields_alone()
    gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", segments)
    gmsh.option.setNumber("Mesh.RecombineAll", int(quadrilaterals))
    gmsh.option.setNumber("Mesh.RecombinationAlgorithm", _QUADRILATERALS_ONLY)
    gmsh.option.setNumber("Mesh.Algorithm", _DELAUNAY if quadrilaterals else _FRONTAL)
    with gmsh_errors("shapes", "needs shapes that Gmsh can mesh"):
        gmsh.model.mesh.generate(dim)


def read_fragments(pieces: Mapping[str, Sequence[int]], dim: int, corners: int) -> Fragments:
    """Read the cells of all regions out of Gmsh, and the points that they use."""
    kind, nodes, region = _KINDS[dim, corners], [], []
    for number, (name, tags) in enumerate(pieces.items()):
        of_region = [gmsh.model.mesh.getElementsByType(kind, tag)[1] for tag in tags]
        if tags and not sum(map(len, of_region)):
            raise MeshError(name, f"Gmsh made no cells of {corners} corners", "needs some")
        nodes += of_region
        region += [number] * (sum(map(len, of_region)) // corners)
    used, cells = np.unique(np.concatenate(nodes).astype(np.int64), return_inverse=True)
    return Fragments(node_positions(used)[:, :dim] / MILLIMETRES, cells.reshape(-1, corners), np.array(region))


def mesh_surface(grid: Floats, is_open: bool, divide_at: int, sizes: Floats) -> Surface:
    """Mesh a surface that closes at its last row, with nodes along the lines that quarter it and along one row.

    The quarters, divided at one row, are the patches that Gmsh parametrises and meshes. The surface is given by points
    `grid` (rows, columns, 3) [m] and the wanted `sizes` (rows, columns) [m] there.
    """
    unit = length_unit(float(sizes.max()))
    # The node number from one of every point of the grid, the same for the points of a closed row.
    number = np.arange(1, grid.shape[0] * grid.shape[1] + 1).reshape(grid.shape[:2])
    for row in (-1,) if is_open else (-1, 0):
        number[row] = number[row, 0]
    with gmsh_session():
        patches = _draw(number, grid / unit, (0, divide_at, len(grid) - 1))
        # The size is that at the nearest point of the grid.
        first = np.unique(number, return_index=True)[1]
        rows = np.column_stack([(grid / unit).reshape(-1, 3)[first], (sizes / unit).ravel()[first]])
        view, field = gmsh.view.add("size"), gmsh.model.mesh.field.add("PostView")
        gmsh.view.addListData(view, "SP", len(rows), rows.ravel())
        gmsh.model.mesh.field.setNumber(field, "ViewTag", view)
        gmsh.model.mesh.field.setNumber(field, "UseClosest", 1)
        gmsh.model.mesh.field.setAsBackgroundMesh(field)
        sizes_from_fields_alone()
        gmsh.option.setNumber("Mesh.Algorithm", _FRONTAL)
        with gmsh_errors("surface", "needs a surface that Gmsh can mesh"):
            gmsh.model.mesh.createGeometry()
            gmsh.model.mesh.generate(2)
        nodes = np.concatenate([gmsh.model.mesh.getElementsByType(TRIANGLE, patch)[1] for patch in patches])
        used, triangles = np.unique(nodes, return_inverse=True)
        return Surface(node_positions(used) * unit, triangles.reshape(-1, 3))


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
    patches = []
    for first, last, k in spans:
        border = [("along", first, k), ("along", first, (k + 1) % 4), ("across", first, k), ("across", last, k)]
        patches.append(gmsh.model.addDiscreteEntity(2, -1, [tags[name] for name in border if name in tags]))
    nodes, rows = np.unique(number, return_index=True)
    gmsh.model.mesh.addNodes(2, patches[0], nodes, grid.reshape(-1, 3)[rows].ravel())
    for node, tag in points.items():
        gmsh.model.mesh.addElementsByType(tag, _POINT, [], [node])
    for name, line in lines.items():
        gmsh.model.mesh.addElementsByType(tags[name], _LINE, [], np.column_stack([line[:-1], line[1:]]).ravel())
    for tag, (first, last, k) in zip(patches, spans, strict=True):
        part = wrapped[first : last + 1, k * quarter : (k + 1) * quarter + 1]
        gmsh.model.mesh.addElementsByType(tag, TRIANGLE, [], _triangles(part).ravel())
    gmsh.model.mesh.reclassifyNodes()
    return patches


def _lines(wrapped: Integers, levels: tuple[int, ...], quarter: int) -> dict[tuple[str, int, int], Integers]:
    """Return the nodes of the lines between patches, by direction, first row and quarter."""
    lines = {}
    for k in range(4):
        for row in levels:
            if wrapped[row, 0] != wrapped[row, 1]:
                lines["across", row, k] = wrapped[row, k * quarter : (k + 1) * quarter + 1]
        for first, last in itertools.pairwise(levels):
            lines["along", first, k] = wrapped[first : last + 1, k * quarter]
    return lines


def _triangles(number: Integers) -> Integers:
    """Return the triangles of a part of the grid, without those that a closed row makes flat."""
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    both: Integers = np.concatenate([np.stack([a, c, b], axis=-1), np.stack([a, d, c], axis=-1)]).reshape(-1, 3)
    whole = (both[:, 0] != both[:, 1]) & (both[:, 1] != both[:, 2]) & (both[:, 2] != both[:, 0])
    return np.asarray(both[whole])
