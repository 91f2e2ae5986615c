"""From the files of a scan to a layered mesh."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from fingerslip.errors import InputError, MeshError
from fingerslip.mesh.scan.layered import LayerSizes
from fingerslip.mesh.scan.quality import ScanMesh, deviation, layer_quality, skin_range
from fingerslip.mesh.source import InspectedMesh, MeshSource, MeshTable, mesh_size_note
from fingerslip.parameters import Angle, FileName, PositiveLength, as_mapping, parameters
from fingerslip.storage.files import digest, file_digest
from fingerslip.units import LengthUnit

if TYPE_CHECKING:
    import skfem

__all__ = [
    "ScanMesh",
    "SurfaceMesh",
    "mesh_scan",
    "scan_cells",
    "scan_tables",
]


@parameters
class SurfaceMesh(MeshSource):
    """A mesh that is built from the surfaces of a scan.

    Parameters
    ----------
    skin : str
        File of the skin's surface: STL, PLY, OBJ.
    tip : tuple of float
        Rough direction from the palm to the tip, in the scan's axes.
    pad : tuple of float
        Rough direction in which the pad faces, in the scan's axes.
    phalanx : str, optional
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

    dim: ClassVar[int] = 3
    element: ClassVar[str] = "T4"

    skin: FileName
    tip: tuple[float, float, float]
    pad: tuple[float, float, float]
    phalanx: FileName | None = None
    unit: LengthUnit = "mm"
    plate_angle: Angle = 0.0
    largest_hole: PositiveLength = 5e-3
    edge_length: PositiveLength | None = None
    layers: LayerSizes = LayerSizes()

    def build(self, _specimen: Any = None, /) -> skfem.MeshTet1:
        """Return the mesh of the scan [m]; see :func:`mesh_scan`."""
        return mesh_scan(self).mesh

    def inspect(self, _specimen: Any = None, /) -> InspectedMesh:
        """Return the mesh of the scan [m], with quality, distance from the scan and repairs."""
        scan = mesh_scan(self)
        return InspectedMesh(scan.mesh, scan_tables(scan), suffix=".vtu")

    def key(self, _specimen: Any = None, /) -> str:
        """Return the hash of the settings and of what is in the files.

        Raises
        ------
        InputError
            Where a file cannot be read.
        """
        values = as_mapping(self)
        content = {name: _content(name, values[name]) for name in ("skin", "phalanx") if values[name] is not None}
        return digest(values | content)

    def estimated_cells(self, _specimen: Any = None, /) -> float:
        """Return about how many tetrahedra the mesh will have; see :func:`scan_cells`."""
        return scan_cells(self)

    def beside(self, folder: Path, /) -> Self:
        """Return the source with absolute paths, where they are relative to a folder."""
        phalanx = None if self.phalanx is None else str((folder / self.phalanx).resolve())
        return dataclasses.replace(self, skin=str((folder / self.skin).resolve()), phalanx=phalanx)


def _content(name: str, file: str) -> str:
    try:
        return file_digest(Path(file))
    except OSError as error:
        raise InputError(f"mesh.{name}", f"cannot read {file} ({error.strerror})", "needs a surface file") from None


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
    """
    from fingerslip.mesh.scan.layered import build_from_surfaces
    from fingerslip.mesh.scan.offset import decimate_surface
    from fingerslip.mesh.scan.placement import place_surface, placement_from_directions
    from fingerslip.mesh.scan.repair import repair_surface
    from fingerslip.mesh.scan.surfaces import read_surface

    files = [settings.skin] + ([settings.phalanx] if settings.phalanx else [])
    if len(set(files)) < len(files):
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


def scan_cells(settings: SurfaceMesh) -> float:
    """Return about how many tetrahedra the mesh of a scan will have, without making it.

    As many regular ones of the bulk's size as fill the convex hull of the skin, up to the cut along its longest side.
    """
    from scipy.spatial import ConvexHull, QhullError

    from fingerslip.mesh.scan.surfaces import read_surface

    points = read_surface(settings.skin, settings.unit).points
    try:
        volume = float(ConvexHull(points).volume)
    except QhullError:
        raise MeshError(settings.skin, "is flat", "needs a surface around a body") from None
    share = min(settings.layers.cut / float(np.ptp(points, axis=0).max()), 1.0) if settings.layers.cut else 1.0
    return 6.0 * float(np.sqrt(2.0)) * share * volume / settings.layers.bulk_size**3


_LAYERS = (
    ("region", "", None),
    ("cells", "", None),
    ("volume", "mm^3", 1),
    ("shortest edge", "mm", 3),
    ("mean edge", "mm", 3),
    ("longest edge", "mm", 3),
    ("least radius ratio", "", 2),
    ("mean radius ratio", "", 2),
)
_DEVIATIONS = (("boundary", "", None), ("mean", "mm", 3), ("largest", "mm", 3))
_REPAIRS = (
    ("file", "", None),
    ("pieces dropped", "", None),
    ("triangles turned", "", None),
    ("holes closed", "", None),
    ("holes left open", "", None),
    ("largest left open", "mm", 1),
)


def scan_tables(scan: ScanMesh) -> tuple[MeshTable, MeshTable, MeshTable]:
    """Return what is worth knowing of the mesh of a scan: quality, distance from the scan, repairs; in millimetres."""
    quality = tuple(
        (
            layer.region,
            layer.cells,
            layer.volume * 1e9,
            layer.shortest_edge * 1e3,
            layer.mean_edge * 1e3,
            layer.longest_edge * 1e3,
            layer.least_radius_ratio,
            layer.mean_radius_ratio,
        )
        for layer in scan.layers
    )
    distances = tuple(
        (deviation.boundary, deviation.mean * 1e3, deviation.largest * 1e3) for deviation in scan.deviations
    )
    least, mean, largest = (value * 1e3 for value in scan.thickness)
    thickness = f"Thickness of the skin: {least:.3g} to {largest:.3g} mm, mean {mean:.3g} mm."
    repairs = tuple(
        (
            Path(file).name,
            done.dropped_pieces,
            done.turned_triangles,
            len(done.closed_holes),
            len(done.open_holes),
            max(done.open_holes, default=0.0) * 1e3,
        )
        for file, done in scan.repairs.items()
    )
    return (
        MeshTable(_LAYERS, quality, note=mesh_size_note(scan.mesh)),
        MeshTable(_DEVIATIONS, distances, "Distance of the mesh from the scan", thickness),
        MeshTable(_REPAIRS, repairs, "Repairs", "Holes left open lie behind the cut."),
    )
