"""Scans in studies: settings with paths and units, what decides the mesh, tables; no mesh is built here."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import skfem

from fingerslip.errors import InputError
from fingerslip.mesh.scan.build import Deviation, ScanMesh, SurfaceMesh, layer_quality
from fingerslip.mesh.scan.repair import Repairs
from fingerslip.study.definition.scans import scan_key, scan_tables
from fingerslip.study.definition.spec import parse_study, study_mapping
from fingerslip.study.definition.sweep import Run
from fingerslip.study.inspection import mesh as meshes
from fingerslip.study.running import build
from unit.study.block import block_values


def scan_values(**changes: Any) -> dict[str, Any]:
    """A study of a scan, as a YAML file holds it."""
    mesh = {"skin": "skin.stl", "bone": "bone.stl", "tip": [1, 0, 0], "pad": [0, -1, 0], "plate_angle": "20 deg"}
    mesh |= {"unit": "mm", "layers": {"skin_thickness": "1.2 mm", "cut": "16 mm"}}
    return block_values() | {"mesh": mesh | changes, "sweep": {}}


def mesh_of_a_scan() -> ScanMesh:
    """A cube in place of a finger."""
    cube = skfem.MeshTet1().scaled(10e-3)
    cube = cube.with_subdomains({"tissue": np.arange(cube.nelements)}).with_boundaries({"skin": cube.boundary_facets()})
    repairs = {"/scans/skin.stl": Repairs(1, 94, (4e-3,), (15.6e-3,))}
    return ScanMesh(cube, repairs, layer_quality(cube), (Deviation("skin", 2e-5, 7e-5),), (0.9e-3, 1e-3, 1.1e-3))


def run_of(folder: Path, **changes: Any) -> Run:
    study = parse_study(scan_values(**changes), folder / "study.yaml")
    return Run("run", str(folder / "study.yaml"), {}, study, None)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("skin.stl", "bone.stl"):
        (tmp_path / name).write_text(name)
    return tmp_path


def test_settings_are_si_and_paths_absolute(folder: Path) -> None:
    settings = run_of(folder).study.mesh
    assert isinstance(settings, SurfaceMesh)
    assert settings.skin == str(folder / "skin.stl")
    assert settings.bone == str(folder / "bone.stl")
    assert settings.plate_angle == pytest.approx(np.pi / 9)
    assert (settings.layers.skin_thickness, settings.layers.cut) == (1.2e-3, 16e-3)


def test_settings_read_back_the_same(folder: Path) -> None:
    study = run_of(folder).study
    assert parse_study(study_mapping(study), folder / "study.yaml") == study


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"plate_angel": "20 deg"}, "mesh.plate_angel: is not known, .*did you mean 'plate_angle'"),
        ({"tip": [1, 0]}, "mesh.tip"),
        ({"unit": "inch"}, "mesh.unit: got 'inch'"),
        ({"layers": {"cut": "16"}}, "mesh.layers.cut: '16' has no unit.*'16 mm'"),
        ({"layers": {"tolerance": "0.5 mm"}}, r"mesh.layers.tolerance: got 0.5 mm, needs <= 0.25 mm"),
    ],
)
def test_mistake_is_named_with_its_mend(folder: Path, changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        run_of(folder, **changes)


def test_key_follows_content_and_settings(folder: Path) -> None:
    first = build.mesh_key(run_of(folder))
    assert build.mesh_key(run_of(folder)) == first
    assert build.mesh_key(run_of(folder, plate_angle="10 deg")) != first
    (folder / "bone.stl").write_text("another bone")
    assert build.mesh_key(run_of(folder)) != first


def test_key_does_not_follow_the_folder(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    other = tmp_path_factory.mktemp("other")
    for name in ("skin.stl", "bone.stl"):
        (other / name).write_text(name)
    assert build.mesh_key(run_of(folder)) == build.mesh_key(run_of(other))


def test_missing_surface_is_named() -> None:
    with pytest.raises(InputError, match=r"study: mesh.skin: cannot read none.stl"):
        scan_key(SurfaceMesh("none.stl", (1, 0, 0), (0, -1, 0)), "study")


def test_mesh_of_a_run_is_that_of_its_scan(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = mesh_of_a_scan()
    monkeypatch.setattr(build, "mesh_scan", lambda settings: made if settings.layers.cut == 16e-3 else None)
    monkeypatch.setattr(build, "scan_cells", lambda _: 1e4)
    assert build.build_mesh(run_of(folder)) is made.mesh


def test_error_of_a_scan_names_the_study(folder: Path) -> None:
    with pytest.raises(InputError, match=r"study.yaml: .*skin.stl: cannot be read"):
        build.build_mesh(run_of(folder))


def test_tables_are_in_millimetres() -> None:
    quality, distances, repairs = scan_tables(mesh_of_a_scan(), "finger.vtu")
    assert quality.title == "finger.vtu"
    (row,) = quality.rows
    assert row[:3] == ("tissue", 5, pytest.approx(1000.0))
    assert "8 nodes, 5 cells; boundaries: skin" in quality.note
    assert distances.rows == (("skin", pytest.approx(0.02), pytest.approx(0.07)),)
    assert "0.9 to 1.1 mm, mean 1 mm" in distances.note
    assert repairs.rows == (("skin.stl", 1, 94, 1, 1, pytest.approx(15.6)),)


def test_saved_mesh_has_its_names(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(meshes, "mesh_scan", lambda _: mesh_of_a_scan())
    monkeypatch.setattr(meshes, "plan_study", lambda _: type("Plan", (), {"runs": [run_of(folder)]}))
    tables = meshes.save_and_show(str(folder / "study.yaml"), folder / "new" / "finger.vtu")
    assert len(tables) == 3
    back = skfem.Mesh.load(folder / "new" / "finger.vtu")
    assert set(back.boundaries) == {"skin"}
    assert len(back.subdomains["tissue"]) == 5
