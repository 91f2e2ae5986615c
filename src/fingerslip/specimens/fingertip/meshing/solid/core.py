"""The tissue and the phalanx in space, meshed by Gmsh between the skin and the proximal cut."""

from __future__ import annotations

from dataclasses import dataclass

import gmsh
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingerslip.errors import MeshError
from fingerslip.mesh.gmsh_session import gmsh_session, length_unit
from fingerslip.mesh.patches import Triangulation
from fingerslip.specimens.fingertip.meshing.section.core import CoreMesh, mesh_ring

__all__ = ["mesh_solid_core"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_TRIANGLE, _TETRAHEDRON = 2, 4
_HXT = 10


@dataclass(frozen=True)
class _Hull:
    """Closed surfaces of triangles that share nodes: skin, phalanx, and their caps on the proximal cut."""

    points: Floats
    skin: Integers
    phalanx: Integers
    caps: dict[str, Integers]


def mesh_solid_core(skin: Triangulation, phalanx: Triangulation, largest: float) -> CoreMesh:
    """Mesh what lies inside the skin.

    Units: largest [m].
    """
    hull, unit = _hull(skin, phalanx, largest), length_unit(largest)
    with gmsh_session():
        volumes = _draw(hull, unit)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1)
        gmsh.option.setNumber("Mesh.MeshSizeMax", largest / unit)
        gmsh.option.setNumber("Mesh.Algorithm3D", _HXT)
        try:
            gmsh.model.mesh.generate(3)
            gmsh.model.mesh.optimize("")
        except Exception as error:
            raise MeshError("tissue and phalanx", f"Gmsh says '{error}'", "needs one that Gmsh can mesh") from error
        return _read(hull, volumes, unit)


def rim(surface: Triangulation) -> Integers:
    """Return the nodes of the rim of a surface in turn, the surface on their left; none where it is closed."""
    edges = np.concatenate([surface.triangles[:, [0, 1]], surface.triangles[:, [1, 2]], surface.triangles[:, [2, 0]]])
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    outer = edges[first[count == 1]]
    if len(outer) == 0:
        return np.empty(0, dtype=np.int64)
    following = dict(outer.tolist())
    ring = [int(outer[0, 0])]
    while following[ring[-1]] != ring[0]:
        ring.append(following[ring[-1]])
    return np.array(ring)


def _hull(skin: Triangulation, phalanx: Triangulation, largest: float) -> _Hull:
    """Join skin and phalanx by flat caps on the proximal cut."""
    count = len(skin.points)
    points = np.vstack([skin.points, phalanx.points])
    outer, inner = rim(skin), rim(phalanx)
    cut = skin.points[outer[0], 0]
    core = mesh_ring(_flat(skin.points[outer]), _flat(phalanx.points[inner]) if len(inner) else None, largest)
    known = np.concatenate([outer, inner + count]) if len(inner) else outer
    distance, nearest = cKDTree(_flat(points[known])).query(core.points)
    on_ring = distance < 1e-9
    number = np.where(on_ring, known[nearest], 0)
    number[~on_ring] = len(points) + np.arange(np.count_nonzero(~on_ring))
    new = core.points[~on_ring]
    points = np.vstack([points, np.column_stack([np.full(len(new), cut), new[:, 1], new[:, 0]])])
    return _Hull(points, skin.triangles, phalanx.triangles + count, {n: number[c] for n, c in core.cells.items()})


def _flat(points: Floats) -> Floats:
    """Return the coordinates z and y of points on the proximal cut."""
    return points[:, [2, 1]]


def _draw(hull: _Hull, unit: float) -> dict[str, int]:
    """Draw the surfaces as they are; return the tags of the volumes between them."""
    surfaces = {"skin": hull.skin, "phalanx_surface": hull.phalanx, **hull.caps}
    tags = {name: gmsh.model.addDiscreteEntity(2) for name in surfaces}
    gmsh.model.mesh.addNodes(2, tags["skin"], np.arange(1, len(hull.points) + 1), hull.points.ravel() / unit)
    for name, triangles in surfaces.items():
        gmsh.model.mesh.addElementsByType(tags[name], _TRIANGLE, [], (triangles + 1).ravel())
    gmsh.model.mesh.reclassifyNodes()
    cut = [tags["phalanx"]] if "phalanx" in tags else []
    outer, phalanx = [tags["skin"], tags["tissue"]], [tags["phalanx_surface"]]
    volumes = {
        # A phalanx that does not reach the cut lies in a hole of the tissue.
        "tissue": _volume([outer + phalanx] if cut else [outer, phalanx]),
        "phalanx": _volume([phalanx + cut]),
    }
    gmsh.model.geo.synchronize()
    return volumes


def _volume(hulls: list[list[int]]) -> int:
    volume: int = gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop(hull) for hull in hulls])
    return volume


def _read(hull: _Hull, volumes: dict[str, int], unit: float) -> CoreMesh:
    """Read the cells out of Gmsh; nodes of the hull keep their numbers."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    cells = {name: gmsh.model.mesh.getElementsByType(_TETRAHEDRON, volume)[1] for name, volume in volumes.items()}
    used = np.unique(np.concatenate([np.arange(1, len(hull.points) + 1), *cells.values()]))
    order = np.argsort(tags)
    points = coordinates.reshape(-1, 3)[order[np.searchsorted(tags, used, sorter=order)]] * unit
    points[: len(hull.points)] = hull.points
    numbered = {name: np.searchsorted(used, nodes).reshape(-1, 4) for name, nodes in cells.items()}
    return CoreMesh(points, numbered)
