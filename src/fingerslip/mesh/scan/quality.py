"""How good the mesh of a scan is: its cells, and how far it lies off the scan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.mesh.scan.offset import distances
from fingerslip.mesh.scan.repair import Repairs
from fingerslip.mesh.scan.surfaces import Surface, outermost

if TYPE_CHECKING:
    import skfem

__all__ = ["Deviation", "LayerQuality", "ScanMesh", "deviation", "layer_quality", "skin_range"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class LayerQuality:
    """Quality of the tetrahedra of one region."""

    region: str  # name of the region
    cells: int  # number of cells
    volume: float  # volume [m^3]
    shortest_edge: float  # edge lengths [m]
    mean_edge: float  # edge lengths [m]
    longest_edge: float  # edge lengths [m]
    least_radius_ratio: float  # [-]
    mean_radius_ratio: float  # [-]


@dataclass(frozen=True)
class Deviation:
    """How far a boundary of the mesh and the surface that it stands for are from each other."""

    boundary: str  # name of the boundary
    mean: float  # mean and largest distance [m] of the points of either from the other
    largest: float  # mean and largest distance [m] of the points of either from the other


@dataclass(frozen=True)
class ScanMesh:
    """The mesh of a scan, and what is to be known of it.

    Parameters
    ----------
    mesh : skfem.MeshTet1
        The mesh with its regions and boundaries.
    repairs : mapping of str to Repairs
        What was repaired, for each file.
    layers : tuple of LayerQuality
        Quality of each region.
    deviations : tuple of Deviation
        Distance of the mesh from the repaired scan.
    thickness : tuple of float
        Least, mean and largest distance of the inside of the skin from the scanned skin [m].
    """

    mesh: skfem.MeshTet1
    repairs: dict[str, Repairs]
    layers: tuple[LayerQuality, ...]
    deviations: tuple[Deviation, ...]
    thickness: tuple[float, float, float]


def layer_quality(mesh: skfem.MeshTet1) -> tuple[LayerQuality, ...]:
    """Return the quality of each region of a mesh of tetrahedra."""
    corners = np.moveaxis(mesh.p[:, mesh.t], 0, -1).transpose(1, 0, 2)
    pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    edges = np.stack([np.linalg.norm(corners[:, a] - corners[:, b], axis=1) for a, b in pairs], axis=1)
    volumes, ratios = _volumes_and_ratios(corners)
    regions = mesh.subdomains or {"mesh": np.arange(mesh.t.shape[1])}
    return tuple(
        LayerQuality(
            name,
            len(cells),
            float(volumes[cells].sum()),
            float(edges[cells].min()),
            float(edges[cells].mean()),
            float(edges[cells].max()),
            float(ratios[cells].min()),
            float(ratios[cells].mean()),
        )
        for name, cells in regions.items()
    )


def deviation(mesh: skfem.MeshTet1, boundary: str, surface: Surface) -> Deviation:
    """Measure how far a boundary and a surface are from each other, at the points of both and the facets' centres."""
    facets = mesh.facets[:, mesh.boundaries[boundary]].T
    used, numbered = np.unique(facets, return_inverse=True)
    points = mesh.p.T[used]
    boundary_surface = Surface(points, numbered.reshape(-1, 3), boundary)
    from_mesh = distances(surface, np.vstack([points, boundary_surface.corners.mean(axis=1)]))
    bounding = surface.points[np.unique(outermost(surface).triangles)]
    scanned = bounding[bounding[:, 0] > points[:, 0].min() + from_mesh.max()]
    both = np.concatenate([from_mesh, distances(boundary_surface, scanned)])
    return Deviation(boundary, float(both.mean()), float(both.max()))


def skin_range(mesh: skfem.MeshTet1, skin: Surface) -> tuple[float, float, float]:
    """Return the least, mean and largest distance [m] of the inside of the skin from the scanned skin."""
    if "skin_tissue" not in mesh.boundaries:
        return 0.0, 0.0, 0.0
    depth = distances(skin, mesh.p.T[np.unique(mesh.facets[:, mesh.boundaries["skin_tissue"]])])
    return float(depth.min()), float(depth.mean()), float(depth.max())


def _volumes_and_ratios(corners: Floats) -> tuple[Floats, Floats]:
    """Return of each tetrahedron its volume and its radius ratio."""
    a, b, c = np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 0)
    cross = np.cross(b, c), np.cross(c, a), np.cross(a, b)
    volume = np.abs(np.sum(a * cross[0], axis=1)) / 6
    area = sum(np.linalg.norm(side, axis=1) for side in (*cross, sum(cross))) / 2
    weighted = sum(np.sum(edge**2, axis=1)[:, None] * side for edge, side in zip((a, b, c), cross, strict=True))
    circumscribed = np.linalg.norm(weighted, axis=1) / (12 * volume)
    return volume, 9 * volume / area / circumscribed
