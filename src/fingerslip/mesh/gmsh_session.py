"""Gmsh opened for one mesh at a time, and closed whatever happens."""

from __future__ import annotations

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
from scipy.sparse.csgraph import connected_components

from fingerslip.errors import MeshError

__all__ = [
    "MILLIMETRES",
    "Fragments",
    "fragment",
    "generate",
    "gmsh_session",
    "length_unit",
    "read_fragments",
]


MILLIMETRES = 1e3
"""Gmsh's tolerances suit lengths near one, so it works in millimetres."""

_GMSH_IN_USE = threading.Lock()


def length_unit(largest: float) -> float:
    """Return the length [m] that Gmsh takes as one where the largest element size is `largest` [m].

    On surfaces that are given as triangles Gmsh makes no element larger than one, whatever size it is told.
    """
    return 2.0 * largest


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


Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
#: Wanted element size [m] at a point x, y, z [m].
SizeAt = Callable[[float, float, float], float]

_Entity = tuple[int, int]

# Kinds of cells in Gmsh by their corners.
_KINDS = {(2, 3): 2, (2, 4): 3, (3, 4): 4}
# Straight edges in place of a circle, at least, in 2D.
_SEGMENTS_OF_A_CIRCLE = 20
_QUADRILATERALS_ONLY = 2
_PLANE = 2
_FRONTAL, _DELAUNAY = 6, 5


@dataclass(frozen=True)
class Fragments:
    """Cells of the regions of a mesh."""

    points: Floats  # (n, dim), node positions [m]
    cells: Integers  # (m, corners), nodes of all cells, region after region
    region: Integers  # (m,), number of the region of each cell, in the order in which they were named


def fragment(shapes: Mapping[str, Sequence[int]], points: Floats, dim: int) -> dict[str, list[int]]:
    """Cut shapes of Gmsh's OpenCASCADE kernel along each other.

    Arrays: points (k, dim) [m].
    """
    nodes = [(0, gmsh.model.occ.addPoint(*_three(point * MILLIMETRES))) for point in points]
    drawn = {name: [(dim, tag) for tag in tags] for name, tags in shapes.items()}
    try:
        # In 3D cutting first takes many times as long; the faces inside covered solids are taken out afterwards.
        element = _without_overlap(drawn) if dim == _PLANE else drawn
        every = [piece for pieces in element.values() for piece in pieces]
        _, pieces = gmsh.model.occ.fragment(every[:1], [*every[1:], *nodes])
    except Exception as error:
        raise MeshError("shapes", f"Gmsh says '{error}'", "needs shapes that can be cut") from error
    gmsh.model.occ.synchronize()
    names = [name for name, own_pieces in element.items() for _ in own_pieces]
    owner = {tag: name for name, pieces_of_shape in zip(names, pieces, strict=False) for _, tag in pieces_of_shape}
    result = {name: sorted(tag for tag, owner_name in owner.items() if owner_name == name) for name in shapes}
    empty = next((name for name, tags in result.items() if shapes[name] and not tags), None)
    if empty is not None:
        raise MeshError(empty, "is covered by other regions", "needs some room of its own")
    return result if dim == _PLANE else {name: _without_inner_faces(tags) for name, tags in result.items()}


def _without_inner_faces(volumes: Sequence[int]) -> list[int]:
    """Make one volume of those that touch, as faces between them would leave slivers; return the tags."""
    faces = [[face for _, face in gmsh.model.getBoundary([(3, tag)], oriented=False)] for tag in volumes]
    joined = [_join([(volumes[row], faces[row]) for row in group]) for group in _touching(faces)]
    gmsh.model.occ.synchronize()
    return sorted(joined)


def _join(pieces: Sequence[tuple[int, list[int]]]) -> int:
    """Make one volume of pieces and their faces; it keeps the faces that it shares with others, as they are."""
    if len(pieces) == 1:
        return pieces[0][0]
    faces, uses = np.unique(np.concatenate([element for _, element in pieces]), return_counts=True)
    gmsh.model.occ.remove([(3, tag) for tag, _ in pieces])
    joined: int = gmsh.model.occ.addVolume([gmsh.model.occ.addSurfaceLoop(faces[uses == 1].tolist())])
    gmsh.model.occ.remove([(2, face) for face in faces[uses > 1].tolist()], recursive=True)
    return joined


def _touching(faces: Sequence[Sequence[int]]) -> list[list[int]]:
    """Return rows in groups, each of which hangs together by common faces."""
    count = len(faces)
    face, row = np.concatenate(faces), np.repeat(np.arange(count), [len(element) for element in faces])
    of_face = coo_array((np.ones(len(face)), (row, np.unique(face, return_inverse=True)[1]))).tocsr()
    number, group = connected_components(of_face @ of_face.T, directed=False)
    return [np.flatnonzero(group == element).tolist() for element in range(number)]


def _without_overlap(shapes: Mapping[str, list[_Entity]]) -> dict[str, list[_Entity]]:
    """Cut from every region what later ones cover, so that these keep no lines of what they cover."""
    separate: dict[str, list[_Entity]] = {}
    later: list[_Entity] = []
    for name, shape in reversed(list(shapes.items())):
        remainder = gmsh.model.occ.cut(shape, later, removeTool=False)[0] if later and shape else shape
        separate[name] = list(remainder)
        later += separate[name]
    return dict(reversed(list(separate.items())))


def generate(dim: int, size: SizeAt, *, quadrilaterals: bool = False, segments: float = _SEGMENTS_OF_A_CIRCLE) -> None:
    """Mesh what was cut, with element sizes given point by point.

    Units: size [m].
    """
    # Gmsh passes the size that bends need.
    gmsh.model.mesh.setSizeCallback(
        lambda _dim, _tag, x, y, z, bend: min(
            bend, MILLIMETRES * size(x / MILLIMETRES, y / MILLIMETRES, z / MILLIMETRES)
        )
    )
    for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)
    gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", segments)
    gmsh.option.setNumber("Mesh.RecombineAll", int(quadrilaterals))
    gmsh.option.setNumber("Mesh.RecombinationAlgorithm", _QUADRILATERALS_ONLY)
    gmsh.option.setNumber("Mesh.Algorithm", _DELAUNAY if quadrilaterals else _FRONTAL)
    try:
        gmsh.model.mesh.generate(dim)
    except Exception as error:
        raise MeshError("shapes", f"Gmsh says '{error}'", "needs shapes that Gmsh can mesh") from error


def read_fragments(pieces: Mapping[str, Sequence[int]], dim: int, corners: int) -> Fragments:
    """Read the cells of all regions out of Gmsh, and the points that they use."""
    kind = _KINDS[dim, corners]
    tags, positions, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    result = {
        name: np.concatenate([gmsh.model.mesh.getElementsByType(kind, tag)[1] for tag in piece]).astype(np.int64)
        for name, piece in pieces.items()
        if piece
    }
    empty = next((name for name, nodes in result.items() if not len(nodes)), None)
    if empty is not None:
        raise MeshError(empty, f"Gmsh made no cells of {corners} corners", "needs some")
    used = np.unique(np.concatenate(list(result.values())))
    points = positions.reshape(-1, 3)[order[np.searchsorted(tags, used, sorter=order)], :dim] / MILLIMETRES
    cells = [np.searchsorted(used, nodes).reshape(-1, corners) for nodes in result.values()]
    region = np.repeat([list(pieces).index(name) for name in result], [len(cell) for cell in cells])
    return Fragments(points, np.vstack(cells), region)


def _three(point: Floats) -> tuple[float, float, float]:
    x, y, z = (*map(float, point), 0.0)[:3]
    return x, y, z
