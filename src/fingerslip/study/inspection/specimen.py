"""The specimen of a study or of a preset: its mesh for ``fingerslip mesh``, its picture for ``show --figure``."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Any

from fingerslip.errors import InputError
from fingerslip.mesh.io import write_mesh
from fingerslip.mesh.source import InspectedMesh
from fingerslip.specimens.choice import SPECIMENS, preset_names, presets_of
from fingerslip.specimens.protocol import Specimen
from fingerslip.storage.files import writing
from fingerslip.study.running.build import inspect_mesh
from fingerslip.study.running.plan import plan_study
from fingerslip.tables.table import Column, Table

_STUDIES = (".yaml", ".yml")
_PICTURES = (".png", ".svg", ".pdf")


def save_mesh(target: str, path: Path | None = None) -> tuple[Table, ...]:
    """Write the mesh of a study (of its first run) or of a preset, and say what is worth knowing of it."""
    is_study = Path(target).suffix in _STUDIES
    inspected = inspect_mesh(plan_study(target).runs[0]) if is_study else _mesh_of_preset(target)
    path = path or Path("meshes") / f"{Path(target).stem if is_study else target}{inspected.suffix}"
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_mesh(inspected.mesh, path)
    titles = (str(path), *(table.title for table in inspected.tables[1:]))
    return tuple(
        Table(title, tuple(Column(*column) for column in table.columns), table.rows, table.note)
        for title, table in zip(titles, inspected.tables, strict=True)
    )


def _mesh_of_preset(name: str) -> InspectedMesh:
    names = preset_names()
    if name not in names:
        near = difflib.get_close_matches(name, names, n=1)
        repair = f"did you mean '{near[0]}'?" if near else f"presets: {', '.join(names)}"
        allowed = "needs the name of a preset or the path of a study (.yaml)"
        raise InputError(f"mesh {name}", "is neither a preset nor a study file", allowed, repair)
    specimen: Specimen = presets_of(name).read(name)
    return specimen.default_mesh.inspect(specimen)


def draw_specimen(target: str, path: Path) -> None:
    """Draw a fingertip, both sections and the finger in 3D, or a sensor, cut open and its markers."""
    # Libraries that draw are slow to load.
    from fingerslip.report.figures.specimens import fingertip_figure, tactip_figure
    from fingerslip.report.figures.style import save_figure

    if path.suffix not in _PICTURES:
        raise InputError("show --figure", f"got '{path}'", f"needs a file that ends in {', '.join(_PICTURES)}")
    kind, specimen = _specimen(target)
    draw = fingertip_figure if kind == "fingertip" else tactip_figure
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    save_figure(draw(specimen, Path(target).stem), path)


def _specimen(target: str) -> tuple[str, Any]:
    """Return the kind of the specimen of a preset or a study, and the specimen."""
    if Path(target).suffix not in _STUDIES:
        presets = presets_of(target)
        return next(kind for kind, element in SPECIMENS.items() if element is presets), presets.read(target)
    run = plan_study(target).runs[0]
    kind = run.study.specimen_kind
    if kind is None:
        raise InputError(f"show {target}", "has no specimen to draw", f"needs a study with a {' or '.join(SPECIMENS)}")
    return kind, run.specimen
