"""Writing the mesh of a study or of a preset."""

from __future__ import annotations

import difflib
import math
from pathlib import Path
from typing import Any

from fingerslip.errors import InputError
from fingerslip.files import writing
from fingerslip.mesh.io import write_mesh
from fingerslip.mesh.quality import quality_table
from fingerslip.mesh.scan.build import SurfaceMesh, mesh_scan
from fingerslip.report.tables.table import Column, Table
from fingerslip.specimens.fingertip import Fingertip, preset, preset_names
from fingerslip.specimens.fingertip.meshing.section.build import build_section
from fingerslip.specimens.fingertip.meshing.solid.build import build_solid
from fingerslip.study.definition.scans import scan_tables
from fingerslip.study.definition.sweep import Run
from fingerslip.study.running.build import build_mesh, located
from fingerslip.study.running.runner import plan_study

__all__ = ["save_and_show", "save_mesh"]

_COLUMNS = (
    Column("region"),
    Column("cells"),
    Column("least scaled Jacobian", "", 2),
    Column("smallest angle", "deg", 0),
    Column("largest angle", "deg", 0),
    Column("largest aspect ratio", "", 1),
)


def save_and_show(target: str, path: Path | None = None) -> tuple[Table, ...]:
    """Write the mesh of a study (of its first run) or of a preset, and say what is to be known of it.

    Parameters
    ----------
    target : str
        A study file, or the name of a preset.
    path : Path, optional
        The file; without it one in ``meshes/``, for Gmsh or, where it is the mesh of a scan, for ParaView.

    Returns
    -------
    tuple of Table
        The quality of the cells, and for a scan also its distance from the mesh and its repairs.

    Raises
    ------
    InputError
        Where there is no such study or preset, or its mesh cannot be built.
    ResultError
        Where the file cannot be written.
    """
    if Path(target).suffix in (".yaml", ".yml"):
        run = plan_study(target).runs[0]
        if isinstance(run.study.mesh, SurfaceMesh):
            return _save_scan(run, run.study.mesh, path or Path("meshes") / f"{Path(target).stem}.vtu")
    return (save_mesh(target, path),)


def _save_scan(run: Run, settings: SurfaceMesh, path: Path) -> tuple[Table, ...]:
    try:
        scan = mesh_scan(settings)
    except InputError as error:
        raise located(error, run.where) from None
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        scan.mesh.save(str(path))
    return scan_tables(scan, str(path))


def save_mesh(target: str, path: Path | None = None) -> Table:
    """Write the mesh of a study (of its first run) or of a preset.

    Parameters
    ----------
    target : str
        A study file, or the name of a preset; one with a shape in space gives the mesh in space.
    path : Path, optional
        The file; without it a Gmsh file in ``meshes/``.

    Returns
    -------
    Table
        The quality of the cells, region by region.

    Raises
    ------
    InputError
        Where there is no such study or preset, or its mesh cannot be built.
    ResultError
        Where the file cannot be written.
    """
    is_study = Path(target).suffix in (".yaml", ".yml")
    if not is_study:
        _check_preset(target)
    mesh = build_mesh(plan_study(target).runs[0]) if is_study else _mesh_of(preset(target))
    path = path or Path("meshes") / f"{Path(target).stem if is_study else target}.msh"
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_mesh(mesh, path)
    rows = tuple(
        (
            row.region,
            row.cells,
            row.scaled_jacobian,
            math.degrees(row.smallest_angle),
            math.degrees(row.largest_angle),
            row.aspect_ratio,
        )
        for row in quality_table(mesh)
    )
    sizes = f"{mesh.p.shape[1]} nodes, {mesh.t.shape[1]} cells; boundaries: {', '.join(mesh.boundaries or {})}"
    return Table(f"{path}", _COLUMNS, rows, sizes)


def _check_preset(target: str) -> None:
    names = preset_names()
    if target in names:
        return
    near = difflib.get_close_matches(target, names, n=1)
    repair = f"did you mean '{near[0]}'?" if near else f"presets: {', '.join(names)}"
    found = "is neither a preset nor a study file"
    raise InputError(f"mesh {target}", found, "needs the name of a preset or the path of a study (.yaml)", repair)


def _mesh_of(fingertip: Fingertip) -> Any:
    """Return the mesh in space of a fingertip that has a shape in space, else that of its section."""
    return build_section(fingertip) if fingertip.solid is None else build_solid(fingertip)
