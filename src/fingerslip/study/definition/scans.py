"""Scans in studies: where their files are, what decides their mesh, and how good it is."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from fingerslip.digest import digest, file_digest
from fingerslip.errors import InputError
from fingerslip.mesh.scan.build import ScanMesh, SurfaceMesh
from fingerslip.parameters import as_mapping
from fingerslip.report.tables.table import Column, Table

__all__ = ["beside", "scan_key", "scan_tables"]

_LAYERS = (
    Column("region"),
    Column("cells"),
    Column("volume", "mm^3", 1),
    Column("shortest edge", "mm", 3),
    Column("mean edge", "mm", 3),
    Column("longest edge", "mm", 3),
    Column("least radius ratio", "", 2),
    Column("mean radius ratio", "", 2),
)
_DEVIATIONS = (Column("boundary"), Column("mean", "mm", 3), Column("largest", "mm", 3))
_REPAIRS = (
    Column("file"),
    Column("pieces dropped"),
    Column("triangles turned"),
    Column("holes closed"),
    Column("holes left open"),
    Column("largest left open", "mm", 1),
)


def beside(settings: SurfaceMesh, folder: Path) -> SurfaceMesh:
    """Return the settings with absolute paths.

    Parameters
    ----------
    settings : SurfaceMesh
        Settings whose files are relative to a folder.
    folder : Path
        The folder, of the study file.
    """
    bone = None if settings.bone is None else str((folder / settings.bone).resolve())
    return dataclasses.replace(settings, skin=str((folder / settings.skin).resolve()), bone=bone)


def scan_key(settings: SurfaceMesh, where: str) -> str:
    """Return what decides the mesh of a scan, hashed: its settings, and what is in its files.

    Parameters
    ----------
    settings : SurfaceMesh
        The settings.
    where : str
        Name of the run, for errors.

    Raises
    ------
    InputError
        Where a file cannot be read.
    """
    values = as_mapping(settings)
    for name in ("skin", "bone"):
        if values[name] is not None:
            values[name] = _content(Path(values[name]), f"{where}: mesh.{name}")
    return digest(values)


def scan_tables(scan: ScanMesh, title: str) -> tuple[Table, Table, Table]:
    """Return what is to be known of the mesh of a scan: quality, distance from the scan, repairs.

    Parameters
    ----------
    scan : ScanMesh
        The mesh.
    title : str
        Title of the first table, such as the mesh's file.
    """
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
    mesh, (least, mean, largest) = scan.mesh, (value * 1e3 for value in scan.thickness)
    sizes = f"{mesh.p.shape[1]} nodes, {mesh.t.shape[1]} cells; boundaries: {', '.join(mesh.boundaries)}"
    distances = tuple((found.boundary, found.mean * 1e3, found.largest * 1e3) for found in scan.deviations)
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
        Table(title, _LAYERS, quality, sizes),
        Table("Distance of the mesh from the scan", _DEVIATIONS, distances, thickness),
        Table("Repairs", _REPAIRS, repairs, "Holes left open lie behind the cut."),
    )


def _content(file: Path, where: str) -> str:
    try:
        return file_digest(file)
    except OSError as error:
        raise InputError(where, f"cannot read {file} ({error.strerror})", "needs a surface file") from None
