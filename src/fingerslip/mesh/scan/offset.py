"""Operations on surfaces: fewer triangles, distances, the part distal of a plane, the surface at a depth below."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError, MeshError
from fingerslip.mesh.scan.surfaces import Surface, check_area, contains, outermost
from fingerslip.units import millimetres

if TYPE_CHECKING:
    import pyvista

__all__ = ["clip_surface", "decimate_surface", "distances", "offset_inwards"]

Floats = NDArray[np.float64]

_EQUILATERAL = np.sqrt(3.0) / 4.0
_FINE = 1 / 25
_GRID_LIMIT = 20_000_000


def decimate_surface(surface: Surface, edge_length: float) -> Surface:
    """Take triangles away until they are about as long as wanted, by quadric error (Garland & Heckbert 1997).

    Flat places lose most of them. A surface that is as coarse already stays as it is.

    Parameters
    ----------
    surface : Surface
        The surface.
    edge_length : float
        Edge of the equilateral triangles that would cover the area [m].

    Returns
    -------
    Surface
        The surface with fewer triangles.

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
    return _surface(reduced, surface.name)


def clip_surface(surface: Surface, lowest: float) -> Surface:
    """Return what of a surface lies above a value of x; triangles that cross it are cut there.

    Units: lowest [m].
    """
    clipped = _polydata(surface).clip(normal="-x", origin=(lowest, 0.0, 0.0)).triangulate().clean()
    triangles = np.asarray(clipped.regular_faces, dtype=np.int64)
    return Surface(np.asarray(clipped.points, dtype=float), triangles, surface.name)


def distances(surface: Surface, points: Floats) -> Floats:
    """Return how far points are from a surface.

    Arrays: points (n, 3) [m]; returns (n,) [m].
    """
    import pyvista

    # The arithmetic of VTK keeps points in single precision, which suits lengths near one.
    scale = 1.0 / max(float(np.ptp(surface.points, axis=0).max()), np.finfo(float).tiny)
    measured = pyvista.PolyData(points * scale).compute_implicit_distance(_polydata(surface, scale))
    lengths: Floats = np.abs(np.asarray(measured["implicit_distance"], dtype=float)) / scale
    return lengths


def offset_inwards(surface: Surface, thickness: float) -> Surface:
    """Return the surface at a depth below another: all points inside it that are `thickness` away from it.

    It is a level set of the distance on a grid, so it cannot fold where the surface is curved more than its depth.

    Parameters
    ----------
    surface : Surface
        A closed surface with its normals outwards.
    thickness : float
        The depth [m].

    Returns
    -------
    Surface
        The closed inner surface, its normals outwards.

    Raises
    ------
    InputError
        Where the thickness is not positive.
    MeshError
        Where nothing is as deep, or the thickness is too small against the size of the surface.
    """
    import pyvista

    if not thickness > 0:
        raise InputError("thickness", f"got {thickness}", "needs a length > 0")
    grid = _grid(surface, thickness / 3)
    level = _depth(surface, grid, thickness) - thickness
    if level.max() <= 0:
        problem = f"is nowhere {millimetres(thickness)} deep"
        raise MeshError(surface.name, problem, "needs tissue below the skin", "write a smaller skin_thickness")
    inner = pyvista.ImageData(dimensions=grid.dimensions, spacing=grid.spacing, origin=grid.origin)
    inner["level"] = level
    surface_inside = _surface(inner.contour([0.0], "level"), f"{surface.name} offset")
    return decimate_surface(surface_inside, min(thickness, _FINE * float(np.ptp(surface_inside.points, axis=0).max())))


def _grid(surface: Surface, spacing: float) -> pyvista.ImageData:
    """Return a grid around a surface."""
    import pyvista

    low, extent = surface.points.min(axis=0) - spacing, np.ptp(surface.points, axis=0) + 2 * spacing
    count = np.ceil(extent / spacing).astype(int) + 1
    if count.prod() > _GRID_LIMIT:
        fault = f"got {3e3 * spacing:.3g} mm on a body {millimetres(extent.max(), 3)} long"
        raise MeshError(surface.name, fault, "needs a thicker skin", "or cut the finger shorter")
    return pyvista.ImageData(dimensions=tuple(count), spacing=(spacing,) * 3, origin=tuple(low))


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
    signed: Floats = np.where(np.isin(region, outside), -depth, depth)
    return signed


def _polydata(surface: Surface, scale: float = 1.0) -> pyvista.PolyData:
    import pyvista

    faces: Any = surface.triangles
    data: pyvista.PolyData = pyvista.PolyData.from_regular_faces(surface.points * scale, faces)
    return data


def _surface(data: pyvista.PolyData, name: str) -> Surface:
    """Return the triangles, turned outwards as a whole."""
    triangles = np.asarray(data.regular_faces, dtype=np.int64)
    surface = Surface(np.asarray(data.points, dtype=float), triangles, name)
    check_area(surface)
    return surface if surface.volume >= 0 else Surface(surface.points, triangles[:, ::-1], name)
