"""Triangulated surfaces of skin and phalanx, as scanners and segmented images give them."""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import MeshError
from fingerslip.mesh.formats import read_file, write_file
from fingerslip.units import METRES, LengthUnit, coordinates, metres, millimetres

if TYPE_CHECKING:
    import meshio

__all__ = [
    "Surface",
    "boundary_loops",
    "check_area",
    "check_enclosure",
    "contains",
    "join_points",
    "outermost",
    "read_surface",
    "write_surface",
]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# What is scanned for this program: from a small phalanx to a hand with its forearm.
_SMALLEST, _LARGEST = 2e-3, 0.6
_MERGED = 1e-7


@dataclass(frozen=True)
class Surface:
    """A triangulated surface.

    Parameters
    ----------
    points : (n, 3) array
        Positions [m].
    triangles : (m, 3) array
        Points of the triangles, counter-clockwise seen from outside.
    name : str
        What errors call it, such as its file.
    """

    points: Floats
    triangles: Integers
    name: str = "surface"

    @property
    def corners(self) -> Floats:
        """Corners of the triangles, shape (m, 3, 3) [m]."""
        return self.points[self.triangles]

    @property
    def area(self) -> float:
        """Area [m^2]."""
        return float(self.areas.sum())

    @property
    def areas(self) -> Floats:
        """Area of each triangle, shape (m,) [m^2]."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        areas: Floats = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
        return areas

    @property
    def volume(self) -> float:
        """Enclosed volume [m^3], negative where the triangles face inwards; about the mean point where it is open."""
        a, b, c = np.moveaxis(self.corners - self.points[np.unique(self.triangles)].mean(axis=0), 1, 0)
        return float(np.sum(a * np.cross(b, c)) / 6)


def read_surface(path: str | Path, unit: LengthUnit = "mm") -> Surface:
    """Read a surface from STL, PLY, OBJ or any other format of triangles that meshio reads.

    Points at the same place are joined, since STL repeats them for every triangle; quadrilaterals are cut in two.

    Parameters
    ----------
    path : str or Path
        The file.
    unit : {'mm', 'm', 'cm', 'um'}
        Unit of its lengths; the formats do not say it.

    Returns
    -------
    Surface
        The surface in metres, as dirty as the file.

    Raises
    ------
    MeshError
        Where the file is missing, unreadable or without triangles, has coordinates that are no numbers, or has a size
        that no scan of a finger or hand has in this unit.
    InputError
        Where the unit is unknown.
    """
    scale, file = metres(unit), Path(path)
    data = read_file(file, "needs a surface such as .stl, .ply or .obj")
    triangles = _triangles(file, data)
    points = np.asarray(data.points, dtype=float)
    _check_size(file, points[np.unique(triangles)], unit)
    points, triangles = join_points(points * scale, triangles)
    surface = Surface(points, triangles, file.name)
    check_area(surface)
    return surface


def write_surface(surface: Surface, path: str | Path, unit: LengthUnit = "mm") -> None:
    """Write a surface, in the format that the file's suffix names.

    Parameters
    ----------
    surface : Surface
        The surface.
    path : str or Path
        The file, such as ``skin.ply`` or ``skin.stl``.
    unit : {'mm', 'm', 'cm', 'um'}
        Unit of the lengths in the file.

    Raises
    ------
    MeshError
        Where the suffix is unknown or the folder does not exist.
    """
    import meshio

    file = Path(path)
    data = meshio.Mesh(surface.points / METRES[unit], [("triangle", surface.triangles)])
    write_file(file, data, ".stl, .ply, .obj")


def join_points(points: Floats, triangles: Integers) -> tuple[Floats, Integers]:
    """Join points at the same place, and drop unused ones and triangles that shrink to a line.

    Parameters
    ----------
    points : (n, 3) array
        Positions [m].
    triangles : (m, 3) array
        Points of the triangles.

    Returns
    -------
    tuple
        The points that are left, and the triangles on them.
    """
    used, triangles = np.unique(triangles, return_inverse=True)
    points, triangles = points[used], triangles.reshape(-1, 3)
    grain = _MERGED * max(float(np.ptp(points, axis=0).max()), np.finfo(float).tiny)
    _, first, same = np.unique(np.round(points / grain), axis=0, return_index=True, return_inverse=True)
    triangles = same.ravel()[triangles]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    unique, numbered = np.unique(triangles, return_inverse=True)
    return points[first][unique], numbered.reshape(-1, 3).astype(np.int64)


def boundary_loops(surface: Surface) -> tuple[Integers, ...]:
    """Return the points around each hole, in the order of the edges that a lid would have.

    The triangles must be consistently oriented.

    Parameters
    ----------
    surface : Surface
        The surface.
    """
    following: dict[int, list[int]] = {}
    for start, end in _open_edges(surface.triangles):
        following.setdefault(int(end), []).append(int(start))
    loops = []
    while following:
        loops.append(_walk(following))
    return tuple(loops)


def check_enclosure(surface: Surface) -> None:
    """Refuse a surface that does not enclose a body from outside.

    Raises
    ------
    MeshError
        That names the largest hole, or says that the normals face inwards.
    """
    loops = boundary_loops(surface)
    if loops:
        sizes = [float(np.linalg.norm(np.ptp(surface.points[loop], axis=0))) for loop in loops]
        middle = surface.points[loops[int(np.argmax(sizes))]].mean(axis=0)
        largest = f"the largest {millimetres(max(sizes), 3)} wide at {coordinates(middle, 3)}"
        fault = f"is open: {len(loops)} hole{'s'[: len(loops) != 1]}, {largest}"
        repair = "repair it with a larger largest_hole, cut the finger distal of it, or scan it again"
        raise MeshError(surface.name, fault, "needs a closed surface", repair)
    if surface.volume <= 0:
        raise MeshError(surface.name, "is inside out", "needs normals that face outwards", "repair_surface turns it")


def check_area(surface: Surface) -> None:
    """Refuse a surface whose triangles are all lines and points; raise MeshError."""
    if not (len(surface.triangles) and surface.area > 0):
        raise MeshError(surface.name, "has no triangle with an area", "needs the surface of a body")


def contains(surface: Surface, points: Floats) -> NDArray[np.bool_]:
    """Tell which points are inside a surface, by the winding number, which small defects do not upset.

    Parameters
    ----------
    surface : Surface
        A surface that is closed up to small defects, its normals outwards.
    points : (n, 3) array
        Positions [m].
    """
    # Compiled code is loaded where it is needed and nowhere else.
    from fingerslip.mesh.scan.winding import winding_numbers

    inside: NDArray[np.bool_] = winding_numbers(surface.corners, points) > 0.5
    return inside


def outermost(surface: Surface) -> Surface:
    """Return the triangles that somewhere have the inside on one side and the outside on the other.

    Where a surface crosses itself or a piece lies inside another, the rest bounds nothing.

    Parameters
    ----------
    surface : Surface
        A surface that is closed up to small defects, its normals outwards.
    """
    from fingerslip.mesh.scan.winding import winding_numbers

    a, b, c = np.moveaxis(surface.corners, 1, 0)
    across = np.cross(b - a, c - a)
    # A hundredth of the triangle's size off it: near enough to be beside it.
    step = 0.01 * across / np.maximum(np.linalg.norm(across, axis=1), np.finfo(float).tiny)[:, None] ** 0.5
    centre = surface.corners.mean(axis=1)
    bounds = np.zeros(len(centre), dtype=bool)
    for point in (centre, *(0.1 * centre + 0.9 * corner for corner in (a, b, c))):
        asked = np.flatnonzero(~bounds)
        # Through the triangle the winding number grows by one.
        bounds[asked] = np.abs(winding_numbers(surface.corners, (point + step)[asked])) < 0.5
    return dataclasses.replace(surface, triangles=surface.triangles[bounds])


def _walk(following: dict[int, list[int]]) -> Integers:
    """Take one loop out of the open edges."""
    node = start = next(iter(following))
    places = {start: 0}
    while True:
        ahead = following[node].pop()
        if not following[node]:
            del following[node]
        if ahead in places or ahead not in following:
            break
        places[ahead] = len(places)
        node = ahead
    loop, knot = list(places), places.get(ahead, 0)
    # Where two holes meet in a point, the way to it goes back.
    for before, after in itertools.pairwise(loop[: knot + 1]):
        following.setdefault(before, []).append(after)
    return np.array(loop[knot:])


def _open_edges(triangles: Integers) -> Integers:
    """Return the directed edges that no triangle has the other way round, shape (k, 2)."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    count = int(triangles.max()) + 1
    sign = np.where(edges[:, 0] < edges[:, 1], 1, -1)
    low, high = np.sort(edges, axis=1).T
    keys, first, edge_number = np.unique(low * count + high, return_index=True, return_inverse=True)
    balance = np.bincount(edge_number.ravel(), weights=sign, minlength=len(keys)).astype(int)
    directed = np.sort(edges[first], axis=1)
    directed[balance < 0] = directed[balance < 0][:, ::-1]
    return np.repeat(directed, np.abs(balance), axis=0)


def _triangles(file: Path, data: meshio.Mesh) -> Integers:
    blocks = [block.data for block in data.cells if block.type == "triangle"]
    for block in data.cells:
        if block.type == "quad":
            blocks += [block.data[:, [0, 1, 2]], block.data[:, [0, 2, 3]]]
    if not sum(map(len, blocks)):
        kinds = ", ".join(sorted({str(block.type) for block in data.cells})) or "no cells"
        raise MeshError(str(file), f"has {kinds}", "needs triangles")
    return np.vstack(blocks).astype(np.int64)


def _check_size(file: Path, points: Floats, unit: str) -> None:
    """Refuse a surface of a size that no finger has, and name the unit in which it would have one."""
    extent = float(np.ptp(points, axis=0).max())
    if _SMALLEST <= extent * METRES[unit] <= _LARGEST:
        return
    others = [other for other, factor in METRES.items() if _SMALLEST <= extent * factor <= _LARGEST]
    repair = f"is its unit '{others[-1]}'?" if others else ""
    fault = f"is {extent * METRES[unit]:.3g} m long when its unit is '{unit}'"
    raise MeshError(str(file), fault, f"needs {_SMALLEST * 1e3:g} mm to {_LARGEST * 1e3:g} mm", repair)
