"""Writing the mesh of a study or of a preset."""

from __future__ import annotations

import difflib
from pathlib import Path

from fingerslip.errors import InputError
from fingerslip.mesh.io import write_mesh
from fingerslip.mesh.source import InspectedMesh, MeshTable
from fingerslip.specimens.choice import preset_names, presets_of
from fingerslip.specimens.protocol import Specimen
from fingerslip.storage.files import writing
from fingerslip.study.running.build import inspect_mesh
from fingerslip.study.running.plan import plan_study
from fingerslip.tables.table import Column, Table

__all__ = ["save_mesh"]


def save_mesh(target: str, path: Path | None = None) -> tuple[Table, ...]:
    """Write the mesh of a study (of its first run) or of a preset, and say what is worth knowing of it."""
    is_study = Path(target).suffix in (".yaml", ".yml")
    inspected = inspect_mesh(plan_study(target).runs[0]) if is_study else _mesh_of_preset(target)
    path = path or Path("meshes") / f"{Path(target).stem if is_study else target}{inspected.suffix}"
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_mesh(inspected.mesh, path)
    first, *others = inspected.tables
    return (_table(first, str(path)), *(_table(table, table.title) for table in others))


def _table(table: MeshTable, title: str) -> Table:
    return Table(title, tuple(Column(*column) for column in table.columns), table.rows, table.note)


def _mesh_of_preset(name: str) -> InspectedMesh:
    names = preset_names()
    if name not in names:
        near = difflib.get_close_matches(name, names, n=1)
        repair = f"did you mean '{near[0]}'?" if near else f"presets: {', '.join(names)}"
        fault, allowed = (
            "is neither a preset nor a study file",
            "needs the name of a preset or the path of a study (.yaml)",
        )
        raise InputError(f"mesh {name}", fault, allowed, repair)
    specimen: Specimen = presets_of(name).read(name)
    return specimen.default_mesh.inspect(specimen)
