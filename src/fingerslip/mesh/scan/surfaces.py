"""Triangulated surfaces of skin and phalanx, as scanners and segmented images give them, and operations on them."""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fingerslip.arrays import Flags, Floats, Integers
from fingerslip.errors import InputError, MeshError
from fingerslip.libraries import pyvista
from fingerslip.mesh.formats import read_file, write_file
from fingerslip.units import METRES, LengthUnit, coordinates, metres, millimetres

# What is scanned for this program: from a small phalanx to a hand with its forearm.
_SMALLEST, _LARGEST = 2e-3, 0.6
_MERGED = 1e-7
_EQUILATERAL = np.sqrt(3.0) / 4.0
_FINE = 1 / 25
_GRID_LIMIT = 20_000_000


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

    Examples
    --------
    A corner of a cube:

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> corners = np.vstack([np.zeros(3), 10e-3 * np.eye(3)])
    >>> corner = fs.Surface(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    >>> f"{corner.volume * 1e9:.1f} mm^3"
    '166.7 mm^3'
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
        return np.asarray(np.linalg.norm(self.normals, axis=1) / 2)

    @property
    def normals(self) -> Floats:
        """Normals of the triangles, twice as long as their area, shape (m, 3) [m^2]."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.cross(b - a, c - a)

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

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> import fingerslip as fs
    >>> triangle = fs.Surface(10e-3 * np.eye(3), np.array([[0, 1, 2]]))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     fs.write_surface(triangle, f"{folder}/skin.stl", unit="mm")
    ...     skin = fs.read_surface(f"{folder}/skin.stl", unit="mm")
    >>> skin.name, float(skin.points.max())
    ('skin.stl', 0.01)
    """
    scale, file = metres(unit), Path(path)
    data = read_file(file, "needs a surface such as .stl, .ply or .obj").data
    blocks = [block.data for block in data.cells if block.type == "triangle"]
    quadrilaterals = [block.data for block in data.cells if block.type == "quad"]
    blocks += [nodes[:, half] for nodes in quadrilaterals for half in ([0, 1, 2], [0, 2, 3])]
    if not sum(map(len, blocks)):
        kinds = ", ".join(sorted({str(block.type) for block in data.cells})) or "no cells"
        raise MeshError(str(file), f"has {kinds}", "needs triangles")
    triangles, points = np.vstack(blocks).astype(np.int64), np.asarray(data.points, dtype=float)
    # A size that no finger has is that of another unit.
    extent = float(np.ptp(points[np.unique(triangles)], axis=0).max())
    fitting = [other for other, factor in METRES.items() if _SMALLEST <= extent * factor <= _LARGEST]
    if unit not in fitting:
        repair = f"is its unit '{fitting[-1]}'?" if fitting else ""
        fault = f"is {extent * scale:.3g} m long when its unit is '{unit}'"
        raise MeshError(str(file), fault, f"needs {_SMALLEST * 1e3:g} mm to {_LARGEST * 1e3:g} mm", repair)
    surface = Surface(*join_points(points * scale, triangles), file.name)
    check_area(surface)
    return surface


def write_surface(surface: Surface, path: str | Path, unit: LengthUnit = "mm") -> None:
    """Write a surface, in the format that the file's suffix names.

    Parameters
    ----------
    surface : Surface
        The surface.
    path : str or Path
        The file, such as ``skin.ply`` or ``skin.stl``; see :func:`read_surface`.
    unit : {'mm', 'm', 'cm', 'um'}
        Unit of the lengths in the file.

    Raises
    ------
    MeshError
        Where the suffix is unknown or the folder does not exist.
    """
    import meshio

    data = meshio.Mesh(surface.points / METRES[unit], [("triangle", surface.triangles)])
    write_file(Path(path), data, ".stl, .ply, .obj")


def join_points(points: Floats, triangles: Integers) -> tuple[Floats, Integers]:
    """Join points (n, 3) [m] at the same place, and drop unused ones and triangles (m, 3) that shrink to a line."""
    used, triangles = np.unique(triangles, return_inverse=True)
    points, triangles = points[used], triangles.reshape(-1, 3)
    grain = _MERGED * max(float(np.ptp(points, axis=0).max()), np.finfo(float).tiny)
    _, first, same = np.unique(np.round(points / grain), axis=0, return_index=True, return_inverse=True)
    triangles = same.ravel()[triangles]
    a, b, c = triangles.T
    unique, numbered = np.unique(triangles[(a != b) & (b != c) & (c != a)], return_inverse=True)
    return points[first][unique], numbered.reshape(-1, 3).astype(np.int64)


def boundary_loops(surface: Surface) -> tuple[Integers, ...]:
    """Return the points around each hole of consistent triangles, in the order of the edges that a lid would have."""
    edges = edges_of(surface.triangles)
    sign = np.where(edges[:, 0] < edges[:, 1], 1, -1)
    unique, number = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    balance = np.bincount(number.ravel(), weights=sign, minlength=len(unique)).astype(int)
    directed = np.where(balance[:, None] < 0, unique[:, ::-1], unique)
    following: dict[int, list[int]] = {}
    # The edges that no triangle has the other way round.
    for start, end in np.repeat(directed, np.abs(balance), axis=0).tolist():
        following.setdefault(end, []).append(start)
    loops = []
    while following:
        loops.append(_walk(following))
    return tuple(loops)


def edges_of(triangles: Integers) -> Integers:
    """Return the directed edges of triangles (m, 3): all first ones, all second ones, all third ones, (3 m, 2)."""
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])


def _walk(following: dict[int, list[int]]) -> Integers:
    """Take one loop out of the open edges."""
    node = start = next(iter(following))
    order = {start: 0}
    while True:
        ahead = following[node].pop()
        if not following[node]:
            del following[node]
        if ahead in order or ahead not in following:
            break
        order[ahead] = len(order)
        node = ahead
    loop, knot = list(order), order.get(ahead, 0)
    # Where two holes meet in a point, the way to it goes back.
    for before, after in itertools.pairwise(loop[: knot + 1]):
        following.setdefault(before, []).append(after)
    return np.array(loop[knot:])


def check_enclosure(surface: Surface) -> None:
    """Refuse a surface that does not enclose a body from outside: open, or with normals that face inwards."""
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
    """Refuse a surface whose triangles are all lines and points."""
    if not (len(surface.triangles) and surface.area > 0):
        raise MeshError(surface.name, "has no triangle with an area", "needs the surface of a body")


def contains(surface: Surface, points: Floats) -> Flags:
    """Tell which points (n, 3) [m] are inside a surface, by the winding number, which small defects do not upset."""
    # Compiled code is loaded where it is needed and nowhere else.
    from fingerslip.mesh.scan.winding import winding_numbers

    return np.asarray(winding_numbers(surface.corners, points) > 0.5)


def outermost(surface: Surface) -> Surface:
    """Return the triangles that somewhere have the inside on one side and the outside on the other.

    Where a surface crosses itself or a piece lies inside another, the rest bounds nothing.
    """
    from fingerslip.mesh.scan.winding import winding_numbers

    across = surface.normals
    # A hundredth of the triangle's size off it: near enough to be beside it.
    step = 0.01 * across / np.maximum(np.linalg.norm(across, axis=1), np.finfo(float).tiny)[:, None] ** 0.5
    centre = surface.corners.mean(axis=1)
    bounds = np.zeros(len(centre), dtype=bool)
    for point in (centre, *(0.1 * centre + 0.9 * corner for corner in np.moveaxis(surface.corners, 1, 0))):
        asked = np.flatnonzero(~bounds)
        # Through the triangle the winding number grows by one.
        bounds[asked] = np.abs(winding_numbers(surface.corners, (point + step)[asked])) < 0.5
    return dataclasses.replace(surface, triangles=surface.triangles[bounds])


def distances(surface: Surface, points: Floats) -> Floats:
    """Return how far points (n, 3) [m] are from a surface, shape (n,) [m]."""
    # The arithmetic of VTK keeps points in single precision, which suits lengths near one.
    scale = 1.0 / max(float(np.ptp(surface.points, axis=0).max()), np.finfo(float).tiny)
    measured = pyvista.PolyData(points * scale).compute_implicit_distance(_polydata(surface, scale))
    return np.asarray(np.abs(np.asarray(measured["implicit_distance"], dtype=float)) / scale)


def clip_surface(surface: Surface, lowest: float) -> Surface:
    """Return what of a surface lies above a value of x [m]; triangles that cross it are cut there."""
    clipped = _polydata(surface).clip(normal="-x", origin=(lowest, 0.0, 0.0)).triangulate().clean()
    return _surface(clipped, surface.name)


def decimate_surface(surface: Surface, edge_length: float) -> Surface:
    """Return a surface of fewer triangles, about as long as wanted, by quadric error (Garland & Heckbert 1997).

    Flat places lose most of them. A surface that is as coarse already stays as it is.

    See :func:`offset_inwards`.

    Parameters
    ----------
    surface : Surface
        The surface.
    edge_length : float
        Edge of the equilateral triangles that would cover the area [m].

    Raises
    ------
    InputError
        Where the edge length is not positive.
    """
    if not edge_length > 0:
        raise InputError("edge_length", f"got {edge_length}", "needs a length > 0")
    wanted = surface.area / (_EQUILATERAL * edge_length**2)
    if wanted >= len(surface.triangles):
        return surface
    reduced = _polydata(surface).decimate(1.0 - wanted / len(surface.triangles), volume_preservation=True)
    return _outwards(_surface(reduced, surface.name))


def offset_inwards(surface: Surface, thickness: float) -> Surface:
    """Return the surface at a depth below another: all points inside it that are `thickness` away from it.

    It is a level set of the distance on a grid, closed and with its normals outwards, so it cannot fold where the
    surface is curved more than its depth.

    Parameters
    ----------
    surface : Surface
        A closed surface with its normals outwards.
    thickness : float
        The depth [m].

    Raises
    ------
    InputError
        Where the thickness is not positive.
    MeshError
        Where nothing is as deep, or the thickness is too small against the size of the surface.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.spatial import ConvexHull
    >>> import fingerslip as fs
    >>> corners = 10e-3 * np.array(list(np.ndindex(2, 2, 2)))
    >>> cube, _ = fs.repair_surface(fs.Surface(corners, ConvexHull(corners).simplices))
    >>> inner = fs.offset_inwards(cube, 2e-3)
    >>> float(np.ptp(inner.points[:, 0]).round(4))
    0.006
    >>> coarse = fs.decimate_surface(inner, 2e-3)
    >>> len(coarse.triangles) < len(inner.triangles)
    True
    """
    if not thickness > 0:
        raise InputError("thickness", f"got {thickness}", "needs a length > 0")

    spacing = thickness / 3
    low, extent = surface.points.min(axis=0) - spacing, np.ptp(surface.points, axis=0) + 2 * spacing
    count = np.ceil(extent / spacing).astype(int) + 1
    if count.prod() > _GRID_LIMIT:
        fault = f"got {3e3 * spacing:.3g} mm on a body {millimetres(extent.max(), 3)} long"
        raise MeshError(surface.name, fault, "needs a thicker skin", "or cut the finger shorter")
    grid = pyvista.ImageData(dimensions=tuple(count), spacing=(spacing,) * 3, origin=tuple(low))
    grid["level"] = _depth(surface, grid, thickness) - thickness
    if grid["level"].max() <= 0:
        problem = f"is nowhere {millimetres(thickness)} deep"
        raise MeshError(surface.name, problem, "needs tissue below the skin", "write a smaller skin_thickness")
    inner = _outwards(_surface(grid.contour([0.0], "level"), f"{surface.name} offset"))
    return decimate_surface(inner, min(thickness, _FINE * float(np.ptp(inner.points, axis=0).max())))


def _depth(surface: Surface, grid: pyvista.ImageData, thickness: float) -> Floats:
    """Return the distance from the surface at the nodes of a grid: its negative outside, unsigned within a cell of it.

    Nodes that are joined without coming near the surface are on the same side, so one of them is asked.
    """
    from scipy import ndimage

    points = np.asarray(grid.points, dtype=float)
    depth = distances(outermost(surface), points)
    shape = tuple(reversed(grid.dimensions))
    region = ndimage.label((depth > thickness / 3).reshape(shape))[0].ravel()
    numbers, asked = np.unique(region, return_index=True)
    outside = numbers[~contains(surface, points[asked]) & (numbers > 0)]
    return np.where(np.isin(region, outside), -depth, depth)


def _polydata(surface: Surface, scale: float = 1.0) -> pyvista.PolyData:
    faces: Any = surface.triangles
    data: pyvista.PolyData = pyvista.PolyData.from_regular_faces(surface.points * scale, faces)
    return data


def _surface(data: pyvista.PolyData, name: str) -> Surface:
    return Surface(np.asarray(data.points, dtype=float), np.asarray(data.regular_faces, dtype=np.int64), name)


def _outwards(surface: Surface) -> Surface:
    """Return a surface turned outwards as a whole."""
    check_area(surface)
    return surface if surface.volume >= 0 else dataclasses.replace(surface, triangles=surface.triangles[:, ::-1])
