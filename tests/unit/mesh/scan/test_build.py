"""The scan that is shipped goes through the whole chain, from dirty files to the times of slip."""

from __future__ import annotations

import contextlib
import dataclasses
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import skfem

import fingerslip as fs
from fingerslip.errors import InputError, MeshError
from fingerslip.mesh.scan.build import SurfaceMesh, deviation, layer_quality, mesh_scan, scan_cells
from fingerslip.mesh.scan.layered import LayerSizes
from places import ROOT
from unit.ellipsoids import ellipsoid

MESHES = ROOT / "meshes"
SCAN = SurfaceMesh(
    skin=str(MESHES / "scan_skin.stl"),
    bone=str(MESHES / "scan_bone.stl"),
    tip=(0.8, 0.36, 0.48),
    pad=(0.48, -0.86, -0.155),
    plate_angle=np.radians(20.0),
    layers=LayerSizes(contact_size=1.2e-3, bulk_size=3e-3, cut=16e-3, tolerance=0.15e-3),
)


@pytest.fixture(scope="module")
def example() -> dict[str, Any]:
    """What the example of the page leaves, run as it is printed."""
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "surfaces.md").read_text(encoding="utf-8"), re.DOTALL)
    names: dict[str, Any] = {}
    before = set(ROOT.iterdir())
    with contextlib.chdir(ROOT):
        exec(compile(code, "surfaces.md", "exec"), names)
    names["left_behind"] = set(ROOT.iterdir()) - before
    return names


@pytest.fixture(scope="module")
def scan(example):
    return example["scan"]


def test_files_are_what_the_script_makes(tmp_path: Path):
    subprocess.run([sys.executable, MESHES / "make_synthetic_scan.py", tmp_path], check=True)
    for name in ("scan_skin.stl", "scan_bone.stl"):
        made, shipped = (fs.read_surface(folder / name) for folder in (tmp_path, MESHES))
        assert made.triangles.shape == shipped.triangles.shape
        assert made.area == pytest.approx(shipped.area, rel=1e-6)
        assert (MESHES / name).stat().st_size < 200_000


def test_meshing_leaves_no_files_behind(example):
    assert not example["left_behind"]


def test_repairs_are_reported(scan):
    skin, bone = scan.repairs.values()
    assert len(skin.closed_holes) == len(skin.open_holes) == len(bone.open_holes) == 1
    assert skin.turned_triangles > 50
    assert bone.turned_triangles == 0


def test_mesh_keeps_to_the_scan(scan):
    assert [deviation.boundary for deviation in scan.deviations] == ["skin", "phalanx_surface"]
    for found in scan.deviations:
        # Off by the tolerance, and by the decimation that goes before, at most.
        assert 0 < found.mean < 0.5 * SCAN.layers.tolerance
        assert found.largest < 2 * SCAN.layers.tolerance
    least, mean, largest = scan.thickness
    assert mean == pytest.approx(1e-3, rel=0.03)
    assert 1e-3 - 2 * SCAN.layers.tolerance < least < largest < 1e-3 + 2 * SCAN.layers.tolerance


def test_cells_are_well_shaped(scan):
    assert [layer.region for layer in scan.layers] == ["skin", "tissue", "phalanx"]
    assert min(layer.least_radius_ratio for layer in scan.layers) > 0.02
    assert min(layer.mean_radius_ratio for layer in scan.layers) > 0.6
    assert max(layer.longest_edge for layer in scan.layers) < 2 * SCAN.layers.bulk_size


def test_scan_slips(example):
    events = example["events"]
    # The slide begins at 0.2 s; the edge lets go first, the whole pad before the end.
    assert 0.2 < events.incipient < events.three_quarter < events.overall < 1.0


def test_quality_of_a_known_tetrahedron():
    regular = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    (row,) = layer_quality(skfem.MeshTet1(regular.T, np.arange(4)[:, None]))
    assert row.least_radius_ratio == pytest.approx(1.0)
    assert row.volume == pytest.approx(8 / 3)
    assert row.shortest_edge == pytest.approx(np.sqrt(8))
    corner = np.vstack([np.zeros(3), np.eye(3)])
    (row,) = layer_quality(skfem.MeshTet1(corner.T, np.arange(4)[:, None]))
    assert row.mean_radius_ratio == pytest.approx(3 * (3 - np.sqrt(3)) / 6 / (np.sqrt(3) / 2))


def test_deviation_of_a_box_from_a_shifted_sphere():
    sphere = ellipsoid((5e-3, 5e-3, 5e-3), points=400)
    points = np.vstack([sphere.points * 1.1, np.zeros((1, 3))])
    cells = np.column_stack([sphere.triangles, np.full(len(sphere.triangles), 400)])
    ball = skfem.MeshTet1(points.T.copy(), cells.T.copy())
    found = deviation(ball.with_boundaries({"skin": ball.boundary_facets()}), "skin", sphere)
    assert found.mean == pytest.approx(0.5e-3, rel=0.02)
    assert found.largest == pytest.approx(0.5e-3, rel=0.05)


def test_scan_in_the_wrong_unit():
    with pytest.raises(MeshError, match=r"scan_skin.stl: is 2\d.* m long when its unit is 'm'.*is its unit 'mm'"):
        mesh_scan(dataclasses.replace(SCAN, unit="m"))


def test_open_end_without_a_cut():
    with pytest.raises(MeshError, match=r"scan_skin.stl: is open: 1 hole.*cut the finger"):
        mesh_scan(dataclasses.replace(SCAN, layers=LayerSizes()))


def test_skin_given_as_the_bone():
    with pytest.raises(InputError, match=r"bone: got .* the file of the skin"):
        mesh_scan(dataclasses.replace(SCAN, bone=SCAN.skin))


def test_number_of_tetrahedra_of_a_scan_is_foreseen(scan):
    """On a coarse mesh layers and contact, finer than the bulk, add to what fills the finger."""
    settings = dataclasses.replace(SCAN, layers=dataclasses.replace(SCAN.layers, bulk_size=0.3e-3, contact_size=0.3e-3))
    found = scan_cells(settings) * 0.3e-3**3 / (6.0 * np.sqrt(2.0))
    box = np.ptp(scan.mesh.p, axis=1).prod()
    assert 0.3 * box < found < 1.2 * box
