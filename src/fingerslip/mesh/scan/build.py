"""From the files of a scan to a layered mesh, and how good the mesh is: its cells, and how far it lies off the scan."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import numpy as np

from fingerslip.errors import InputError, MeshError
from fingerslip.libraries import pyvista
from fingerslip.mesh.scan.layered import LayerSizes, build_from_surfaces
from fingerslip.mesh.scan.placement import place_surface, placement_from_directions
from fingerslip.mesh.scan.repair import Repairs, repair_surface
from fingerslip.mesh.scan.surfaces import Surface, decimate_surface, distances, outermost, read_surface
from fingerslip.mesh.source import InspectedMesh, MeshSource, content_hash, mesh_size_note
from fingerslip.parameters import Angle, FileName, PositiveLength, as_mapping, parameters
from fingerslip.storage.files import digest
from fingerslip.units import LengthUnit

if TYPE_CHECKING:
    import skfem

    from fingerslip.tables.table import Table


@dataclass(frozen=True)
class LayerQuality:
    """Quality of the tetrahedra of one region; lengths in metres."""

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
    """Mean and largest distance [m] of a boundary of the mesh and the surface that it stands for from each other."""

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


@parameters
class SurfaceMesh(MeshSource):
    """A mesh that is built from the surfaces of a scan."""

    dim: ClassVar[int] = 3
    element: ClassVar[str] = "T4"

    skin: Annotated[FileName, "File of the skin's surface: STL, PLY, OBJ."]
    tip: Annotated[tuple[float, float, float], "Rough direction from the palm to the tip, in the scan's axes."]
    pad: Annotated[tuple[float, float, float], "Rough direction in which the pad faces, in the scan's axes."]
    phalanx: Annotated[FileName | None, "File of the phalanx's surface, in the same axes."] = None
    unit: Annotated[LengthUnit, "Unit of the lengths in both files."] = "mm"
    plate_angle: Annotated[
        Angle, "Angle between the finger's axis and the plate [rad]; positive with the tip down."
    ] = 0.0
    largest_hole: Annotated[PositiveLength, "Diameter up to which holes are closed [m]."] = 5e-3
    edge_length: Annotated[
        PositiveLength | None, "Edge to which the triangles are decimated [m]; without it the contact size."
    ] = None
    layers: Annotated[LayerSizes, "Thickness of the skin, element sizes, and what of the finger is meshed."] = (
        LayerSizes()
    )

    def build(self, _specimen: Any = None, /) -> skfem.MeshTet1:
        """Return the mesh of the scan [m]; see :func:`mesh_scan`."""
        return mesh_scan(self).mesh

    def inspect(self, _specimen: Any = None, /) -> InspectedMesh:
        """Return the mesh of the scan [m], with quality, distance from the scan and repairs."""
        scan = mesh_scan(self)
        return InspectedMesh(scan.mesh, scan_tables(scan), suffix=".vtu")

    def key(self, _specimen: Any = None, /) -> str:
        """Return the hash of the settings and of what is in the files."""
        values = dict(as_mapping(self))
        for name in ("skin", "phalanx"):
            if values[name] is not None:
                values[name] = content_hash(f"mesh.{name}", values[name], "needs a surface file")
        return digest(values)

    def estimated_cells(self, _specimen: Any = None, /) -> float:
        """Return about how many tetrahedra the mesh will have, without making it.

        As many regular ones of the bulk's size as fill the convex hull of the skin, up to the cut along its longest
        side.
        """
        from scipy.spatial import ConvexHull, QhullError

        points = read_surface(self.skin, self.unit).points
        try:
            volume = float(ConvexHull(points).volume)
        except QhullError:
            raise MeshError(self.skin, "is flat", "needs a surface around a body") from None
        share = min(self.layers.cut / float(np.ptp(points, axis=0).max()), 1.0) if self.layers.cut else 1.0
        return 6.0 * float(np.sqrt(2.0)) * share * volume / self.layers.bulk_size**3

    def beside(self, folder: Path, /) -> Self:
        """Return the source with absolute paths, where they are relative to a folder."""
        phalanx = None if self.phalanx is None else str((folder / self.phalanx).resolve())
        return dataclasses.replace(self, skin=str((folder / self.skin).resolve()), phalanx=phalanx)


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
        Where a file cannot be read, is of the wrong size for its unit or open beyond repair, the phalanx is not inside
        the skin, or no mesh comes out.

    Examples
    --------
    A block of 20 x 12 x 14 mm in the place of a finger, whose tip is at +y:

    >>> import tempfile
    >>> import numpy as np
    >>> from scipy.spatial import ConvexHull
    >>> import fingerslip as fs
    >>> corners = np.array(list(np.ndindex(2, 2, 2))) * (12e-3, 20e-3, 14e-3)
    >>> sizes = fs.LayerSizes(skin_thickness=2e-3, contact_size=4e-3, bulk_size=5e-3, tolerance=0.5e-3)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     fs.write_surface(fs.Surface(corners, ConvexHull(corners).simplices), f"{folder}/skin.stl")
    ...     scan = fs.mesh_scan(fs.SurfaceMesh(f"{folder}/skin.stl", tip=(0, 1, 0), pad=(0, 0, -1), layers=sizes))
    >>> sorted(scan.mesh.subdomains), sorted(scan.mesh.boundaries)
    (['skin', 'tissue'], ['pad', 'skin', 'skin_tissue'])
    """
    files = [settings.skin, *([settings.phalanx] if settings.phalanx else [])]
    if settings.phalanx == settings.skin:
        raise InputError("phalanx", f"got '{settings.phalanx}', the file of the skin", "needs a file of its own")
    done = {file: repair_surface(read_surface(file, settings.unit), settings.largest_hole) for file in files}
    placement = placement_from_directions(done[settings.skin][0], settings.tip, settings.pad, settings.plate_angle)
    placed = [place_surface(surface, placement) for surface, _ in done.values()]
    edge = settings.edge_length or settings.layers.contact_size
    skin, *phalanges = (decimate_surface(surface, edge) for surface in placed)
    mesh = build_from_surfaces(skin, phalanges[0] if phalanges else None, settings.layers)
    names = ("skin", "phalanx_surface")
    return ScanMesh(
        mesh,
        {file: repairs for file, (_, repairs) in done.items()},
        layer_quality(mesh),
        tuple(deviation(mesh, name, surface) for name, surface in zip(names, placed, strict=False)),
        skin_range(mesh, placed[0]),
    )


def layer_quality(mesh: skfem.MeshTet1) -> tuple[LayerQuality, ...]:
    """Return the quality of each region of a mesh of tetrahedra."""
    grid = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: mesh.t.T}, mesh.p.T)
    measured = grid.cell_quality(["volume", "radius_ratio"])
    volumes, ratios = np.abs(measured["volume"]), 1.0 / np.abs(measured["radius_ratio"])
    first, second = mesh.p[:, mesh.t[[0, 0, 0, 1, 1, 2]]], mesh.p[:, mesh.t[[1, 2, 3, 2, 3, 3]]]
    edges = np.linalg.norm(first - second, axis=0)

    def row(name: str, cells: Any) -> LayerQuality:
        of_cells, good = edges[:, cells], ratios[cells]
        spread = (of_cells.min(), of_cells.mean(), of_cells.max(), good.min(), good.mean())
        return LayerQuality(name, len(cells), float(volumes[cells].sum()), *map(float, spread))

    regions = mesh.subdomains or {"mesh": np.arange(mesh.t.shape[1])}
    return tuple(row(name, cells) for name, cells in regions.items())


def deviation(mesh: skfem.MeshTet1, boundary: str, surface: Surface) -> Deviation:
    """Measure how far a boundary and a surface are from each other, at the points of both and the facets' centres."""
    used, numbered = np.unique(mesh.facets[:, mesh.boundaries[boundary]].T, return_inverse=True)
    meshed = Surface(mesh.p.T[used], numbered.reshape(-1, 3), boundary)
    from_mesh = distances(surface, np.vstack([meshed.points, meshed.corners.mean(axis=1)]))
    bounding = surface.points[np.unique(outermost(surface).triangles)]
    scanned = bounding[bounding[:, 0] > meshed.points[:, 0].min() + from_mesh.max()]
    both = np.concatenate([from_mesh, distances(meshed, scanned)])
    return Deviation(boundary, float(both.mean()), float(both.max()))


def skin_range(mesh: skfem.MeshTet1, skin: Surface) -> tuple[float, float, float]:
    """Return the least, mean and largest distance [m] of the inside of the skin from the scanned skin."""
    if "skin_tissue" not in mesh.boundaries:
        return 0.0, 0.0, 0.0
    depth = distances(skin, mesh.p.T[np.unique(mesh.facets[:, mesh.boundaries["skin_tissue"]])])
    return float(depth.min()), float(depth.mean()), float(depth.max())


def scan_tables(scan: ScanMesh) -> tuple[Table, Table, Table]:
    """Return what is worth knowing of the mesh of a scan: quality, distance from the scan, repairs; in millimetres."""
    from fingerslip.tables.table import Column, Table

    quality = tuple(
        (region, cells, volume * 1e9, *(edge * 1e3 for edge in edges), least, mean)
        for region, cells, volume, *edges, least, mean in map(dataclasses.astuple, scan.layers)
    )
    layers = (
        *map(Column, ("region", "cells")),
        Column("volume", "mm^3", 1),
        *(Column(f"{which} edge", "mm", 3) for which in ("shortest", "mean", "longest")),
        *(Column(f"{which} radius ratio", digits=2) for which in ("least", "mean")),
    )
    apart = tuple((deviation.boundary, deviation.mean * 1e3, deviation.largest * 1e3) for deviation in scan.deviations)
    distance = (Column("boundary"), *(Column(name, "mm", 3) for name in ("mean", "largest")))
    least, mean, largest = (value * 1e3 for value in scan.thickness)
    repairs = []
    for file, repair in scan.repairs.items():
        holes = len(repair.closed_holes), len(repair.open_holes), max(repair.open_holes, default=0.0) * 1e3
        repairs.append((Path(file).name, repair.dropped_pieces, repair.turned_triangles, *holes))
    names = ("file", "pieces dropped", "triangles turned", "holes closed", "holes left open")
    every_repair = (*map(Column, names), Column("largest left open", "mm", 1))
    thickness = f"Thickness of the skin: {least:.3g} to {largest:.3g} mm, mean {mean:.3g} mm."
    return (
        Table("", layers, quality, mesh_size_note(scan.mesh)),
        Table("Distance of the mesh from the scan", distance, apart, thickness),
        Table("Repairs", every_repair, tuple(repairs), "Holes left open lie behind the cut."),
    )
