"""Scans as a source of meshes: their files, what decides the mesh, and what is refused; nothing is meshed here."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from pathlib import Path

import meshio
import numpy as np
import pytest

import fingerslip as fs
from fingerslip.errors import InputError, MeshError
from fingerslip.mesh.scan import build
from fingerslip.mesh.scan.build import SurfaceMesh, mesh_scan, scan_cells
from fingerslip.mesh.scan.layered import LayerSizes
from unit.scans import MESHES, SCAN, mesh_of_a_scan


def test_files_are_what_the_script_makes(tmp_path: Path):
    subprocess.run([sys.executable, MESHES / "make_synthetic_scan.py", tmp_path], check=True)
    for name in ("scan_skin.stl", "scan_phalanx.stl"):
        made, shipped = (fs.read_surface(folder / name) for folder in (tmp_path, MESHES))
        assert made.triangles.shape == shipped.triangles.shape
        assert made.area == pytest.approx(shipped.area, rel=1e-6)
        assert (MESHES / name).stat().st_size < 200_000


def test_scan_in_the_wrong_unit():
    with pytest.raises(MeshError, match=r"scan_skin.stl: is 2\d.* m long when its unit is 'm'.*is its unit 'mm'"):
        mesh_scan(dataclasses.replace(SCAN, unit="m"))


def test_open_end_without_a_cut():
    with pytest.raises(MeshError, match=r"scan_skin.stl: is open: 1 hole.*cut the finger"):
        mesh_scan(dataclasses.replace(SCAN, layers=LayerSizes()))


def test_skin_given_as_the_phalanx():
    with pytest.raises(InputError, match=r"phalanx: got .* the file of the skin"):
        mesh_scan(dataclasses.replace(SCAN, phalanx=SCAN.skin))


def test_number_of_tetrahedra_is_foreseen_from_the_volume():
    """As many of the bulk's size as fill the convex hull up to the cut: between the finger and the box around it."""
    skin = fs.read_surface(SCAN.skin)
    box = np.ptp(skin.points, axis=0).prod()
    of_one_cell = SCAN.layers.bulk_size**3 / (6.0 * np.sqrt(2.0))
    whole = dataclasses.replace(SCAN, layers=dataclasses.replace(SCAN.layers, cut=None))
    assert 0.3 * box < scan_cells(whole) * of_one_cell < box
    assert SCAN.estimated_cells() == scan_cells(SCAN) < scan_cells(whole)


def test_it_says_what_it_is():
    assert (SCAN.dim, SCAN.element, SCAN.needs_specimen, SCAN.assumes_metres) == (3, "T4", False, False)
    assert SCAN.refined(0.5) is None


def test_paths_are_relative_to_a_folder(tmp_path: Path):
    scan = SurfaceMesh("skin.stl", (1, 0, 0), (0, -1, 0), "phalanx.stl").beside(tmp_path)
    assert (scan.skin, scan.phalanx) == (str(tmp_path.resolve() / "skin.stl"), str(tmp_path.resolve() / "phalanx.stl"))
    assert SurfaceMesh("skin.stl", (1, 0, 0), (0, -1, 0)).beside(tmp_path).phalanx is None


def test_key_follows_content_and_settings_but_not_the_folder(tmp_path: Path):
    def scan(folder: str, skin: str = "skin") -> SurfaceMesh:
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / "skin.stl").write_text(skin)
        return SurfaceMesh("skin.stl", (1, 0, 0), (0, -1, 0)).beside(tmp_path / folder)

    first = scan("a").key()
    assert scan("a").key() == scan("b").key() == first
    assert dataclasses.replace(scan("a"), plate_angle=0.1).key() != first
    assert scan("b", "another skin").key() != first


def test_missing_surface_is_named():
    with pytest.raises(InputError, match=r"mesh.skin: cannot read none.stl"):
        SurfaceMesh("none.stl", (1, 0, 0), (0, -1, 0)).key()


def test_mesh_and_its_tables_come_from_one_scan(monkeypatch: pytest.MonkeyPatch):
    made = mesh_of_a_scan()
    monkeypatch.setattr(build, "mesh_scan", lambda settings: made if settings is SCAN else None)
    assert SCAN.build() is made.mesh
    found = SCAN.inspect()
    assert found.mesh is made.mesh
    assert [table.title for table in found.tables] == ["", "Distance of the mesh from the scan", "Repairs"]
    assert found.suffix == ".vtu"


def test_a_flat_skin_has_no_size(tmp_path: Path) -> None:
    points = np.array([[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]], dtype=float)
    meshio.write(tmp_path / "skin.vtu", meshio.Mesh(points, [("quad", [[0, 1, 2, 3]])]))
    with pytest.raises(MeshError, match=r"skin\.vtu: is flat, needs a surface around a body"):
        scan_cells(dataclasses.replace(SCAN, skin=str(tmp_path / "skin.vtu")))
