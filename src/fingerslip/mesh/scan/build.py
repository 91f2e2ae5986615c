"""From the files of a scan to a layered mesh, and how good it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from fingerslip.errors import InputError
from fingerslip.mesh.scan.layered import LayerSizes, build_from_surfaces
from fingerslip.mesh.scan.offset import decimate_surface, distances
from fingerslip.mesh.scan.placement import place_surface, placement_from_directions
from fingerslip.mesh.scan.repair import Repairs, repair_surface
from fingerslip.mesh.scan.surfaces import LengthUnit, Surface, outermost, read_surface
from fingerslip.parameters import Angle, PositiveLength, parameters

__all__ = [
    "Deviation",
    "LayerQuality",
    "ScanMesh",
    "SurfaceMesh",
    "deviation",
    "layer_quality",
    "mesh_scan",
    "scan_cells",
]

Floats = NDArray[np.float64]


@parameters
class SurfaceMesh:
    """A mesh that is built from the surfaces of a scan.

    Parameters
    ----------
    skin : str
        File of the skin's surface: STL, PLY, OBJ.
    tip : tuple of float
        Rough direction from the palm to the tip, in the scan's axes.
    pad : tuple of float
        Rough direction in which the pad faces, in the scan's axes.
    bone : str, optional
        File of the phalanx's surface, in the same axes.
    unit : {'mm', 'm', 'cm', 'um'}
        Unit of the lengths in both files.
    plate_angle : float
        Angle between the finger's axis and the plate [rad]; positive with the tip down.
    largest_hole : float
        Diameter up to which holes are closed [m].
    edge_length : float, optional
        Edge to which the triangles are decimated [m]; without it the contact size.
    layers : LayerSizes
        Thickness of the skin, element sizes, and what of the finger is meshed.
    """

    skin: str
    tip: tuple[float, float, float]
    pad: tuple[float, float, float]
    bone: str | None = None
    unit: LengthUnit = "mm"
    plate_angle: Angle = 0.0
    largest_hole: PositiveLength = 5e-3
    edge_length: PositiveLength | None = None
    layers: LayerSizes = LayerSizes()


@dataclass(frozen=True)
class LayerQuality:
    """Quality of the tetrahedra of one region.

    Parameters
    ----------
    region : str
        Name of the region.
    cells : int
        Number of cells.
    volume : float
        Volume [m^3].
    shortest_edge, mean_edge, longest_edge : float
        Edge lengths [m].
    least_radius_ratio, mean_radius_ratio : float
        Three times the inscribed over the circumscribed radius [-]: 1 for a regular tetrahedron, 0 for a flat one.
    """

    region: str
    cells: int
    volume: float
    shortest_edge: float
    mean_edge: float
    longest_edge: float
    least_radius_ratio: float
    mean_radius_ratio: float


@dataclass(frozen=True)
class Deviation:
    """How far a boundary of the mesh and the surface that it stands for are from each other.

    Parameters
    ----------
    boundary : str
        Name of the boundary.
    mean, largest : float
        Mean and largest distance [m] of the points of either from the other.
    """

    boundary: str
    mean: float
    largest: float


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


def mesh_scan(settings: SurfaceMesh) -> ScanMesh:
    """Read, repair, place, decimate and mesh the surfaces of a scan.

    Parameters
    ----------
    settings : SurfaceMesh
        The files, where the finger lies in them, and how it is meshed.

    Returns
    -------
    ScanMesh
        The mesh, what was repaired, the quality of its cells and its distance from the scan.

    Raises
    ------
    InputError
        Where settings are wrong.
    MeshError
        Where a file cannot be read, is of the wrong size for its unit or open beyond repair, the bone is not inside
        the skin, or no mesh comes out.
    """
    files = [settings.skin] + ([settings.bone] if settings.bone else [])
    if len(set(files)) < len(files):
        raise InputError("bone", f"got '{settings.bone}', the file of the skin", "needs a file of its own")
    done = {file: repair_surface(read_surface(file, settings.unit), settings.largest_hole) for file in files}
    placement = placement_from_directions(done[settings.skin][0], settings.tip, settings.pad, settings.plate_angle)
    placed = [place_surface(surface, placement) for surface, _ in done.values()]
    edge = settings.edge_length or settings.layers.contact_size
    skin, *bones = (decimate_surface(surface, edge) for surface in placed)
    mesh = build_from_surfaces(skin, bones[0] if bones else None, settings.layers)
    names = ("skin", "phalanx_surface")
    return ScanMesh(
        mesh,
        {file: repairs for file, (_, repairs) in done.items()},
        layer_quality(mesh),
        tuple(deviation(mesh, name, surface) for name, surface in zip(names, placed, strict=False)),
        _thickness(mesh, placed[0]),
    )


def scan_cells(settings: SurfaceMesh) -> float:
    """Return about how many tetrahedra the mesh of a scan will have, without making it.

    As many regular ones of the bulk's size as fill the convex hull of the skin, up to the cut along its longest side.
    """
    points = read_surface(settings.skin, settings.unit).points
    share = min(settings.layers.cut / float(np.ptp(points, axis=0).max()), 1.0) if settings.layers.cut else 1.0
    return 6.0 * float(np.sqrt(2.0)) * share * float(ConvexHull(points).volume) / settings.layers.bulk_size**3


def layer_quality(mesh: skfem.MeshTet1) -> tuple[LayerQuality, ...]:
    """Return the quality of each region of a mesh of tetrahedra.

    Parameters
    ----------
    mesh : skfem.MeshTet1
        The mesh.
    """
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
    """Measure how far a boundary and a surface are from each other, at the points of both and the facets' centres.

    Parameters
    ----------
    mesh : skfem.MeshTet1
        The mesh.
    boundary : str
        Name of the boundary.
    surface : Surface
        The surface; what of it is proximal of the boundary does not count.
    """
    facets = mesh.facets[:, mesh.boundaries[boundary]].T
    used, numbered = np.unique(facets, return_inverse=True)
    points = mesh.p.T[used]
    made = Surface(points, numbered.reshape(-1, 3), boundary)
    from_mesh = distances(surface, np.vstack([points, made.corners.mean(axis=1)]))
    bounding = surface.points[np.unique(outermost(surface).triangles)]
    scanned = bounding[bounding[:, 0] > points[:, 0].min() + from_mesh.max()]
    both = np.concatenate([from_mesh, distances(made, scanned)])
    return Deviation(boundary, float(both.mean()), float(both.max()))


def _volumes_and_ratios(corners: Floats) -> tuple[Floats, Floats]:
    """Return of each tetrahedron its volume and its radius ratio."""
    a, b, c = np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 0)
    cross = np.cross(b, c), np.cross(c, a), np.cross(a, b)
    volume = np.abs(np.sum(a * cross[0], axis=1)) / 6
    area = sum(np.linalg.norm(side, axis=1) for side in (*cross, sum(cross))) / 2
    weighted = sum(np.sum(edge**2, axis=1)[:, None] * side for edge, side in zip((a, b, c), cross, strict=True))
    circumscribed = np.linalg.norm(weighted, axis=1) / (12 * volume)
    return volume, 9 * volume / area / circumscribed


def _thickness(mesh: skfem.MeshTet1, skin: Surface) -> tuple[float, float, float]:
    if "skin_tissue" not in mesh.boundaries:
        return 0.0, 0.0, 0.0
    depth = distances(skin, mesh.p.T[np.unique(mesh.facets[:, mesh.boundaries["skin_tissue"]])])
    return float(depth.min()), float(depth.mean()), float(depth.max())
