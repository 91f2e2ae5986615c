"""What is worth knowing of the mesh of a scan, as tables."""

from __future__ import annotations

from pathlib import Path

from fingerslip.mesh.scan.quality import ScanMesh
from fingerslip.mesh.source import MeshTable, mesh_size_note

__all__ = ["scan_tables"]

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
    distances = tuple((found.boundary, found.mean * 1e3, found.largest * 1e3) for found in scan.deviations)
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
