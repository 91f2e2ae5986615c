"""Snapshots with the contact, counterfaces and sites as files for ParaView."""

from __future__ import annotations

import ast
from pathlib import Path
from xml.etree import ElementTree as ET

import meshio
import numpy as np
import pytest
import xarray as xr

import fingerslip as fs
from fingerslip.errors import ResultError
from fingerslip.export.paraview import write_paraview
from fingerslip.verification.meshes import box
from problems.pushed import push_and_slide


@pytest.fixture(scope="module")
def folder(pushed: xr.Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("paraview")
    write_paraview(pushed, found)
    return found


@pytest.mark.parametrize(("name", "one"), [("body", "body"), ("counterfaces", "counterface"), ("sites", "site")])
def test_every_part_has_a_file_for_each_snapshot(folder: Path, pushed: xr.Dataset, name: str, one: str) -> None:
    entries = list(ET.parse(folder / f"{name}.pvd").getroot().iter("DataSet"))
    assert [float(entry.attrib["timestep"]) for entry in entries] == pytest.approx(pushed["snapshot_time"].values)
    assert [entry.attrib["file"] for entry in entries] == [f"{one}_{n:04d}.vtu" for n in range(len(entries))]
    assert all((folder / entry.attrib["file"]).is_file() for entry in entries)


def test_contact_is_on_the_points_that_may_touch(folder: Path, pushed: xr.Dataset) -> None:
    body = meshio.read(folder / "body_0002.vtu")
    step = int(np.abs(pushed["time"].values - pushed["snapshot_time"].values[2]).argmin())
    nodes = pushed["contact_node"].values
    pressure = body.point_data["contact_pressure"]
    np.testing.assert_array_equal(pressure[nodes], pushed["normal_traction"].values[step])
    assert np.isnan(np.delete(pressure, nodes)).all()
    assert pressure[nodes].max() > 0.0
    assert body.point_data["friction_traction"].shape == (len(body.points), 3)
    assert (folder / "regions.csv").read_text(encoding="utf-8") == "number,region\n0,bulk\n"


def test_the_plate_is_where_the_counterface_is(folder: Path, pushed: xr.Dataset) -> None:
    first, last = (meshio.read(folder / f"counterface_{n:04d}.vtu").points for n in (0, 4))
    moved = pushed["counterface_displacement"].values
    step = int(np.abs(pushed["time"].values - pushed["snapshot_time"].values[4]).argmin())
    assert last[:, 1] - first[:, 1] == pytest.approx(np.full(2, moved[step, 0, 1] - moved[0, 0, 1]), abs=1e-9)


def test_sites_move_with_the_body(folder: Path, pushed: xr.Dataset) -> None:
    sites = meshio.read(folder / "site_0004.vtu")
    assert sites.point_data["kind"].tolist() == [2, -1]
    np.testing.assert_allclose(sites.points[:, :2], pushed["site_position"].values)


def test_the_script_is_python(folder: Path) -> None:
    ast.parse((folder / "show.py").read_text(encoding="utf-8"))


def test_plates_in_space_are_squares(tmp_path: Path) -> None:
    grid = np.linspace(0.0, 4e-3, 3)
    model = push_and_slide(
        mesh=box("H8", grid, grid, grid),
        formulation="solid",
        depth=1.0,
        supports={"top": ("x", "y", "z")},
        contacts=(fs.Contact("bottom", fs.Plane((0.0, 0.0, 1.0)), fs.Coulomb(0.4)),),
        programme=(fs.Press(0.2e-3, 5e-3),),
        record=fs.Recording(snapshots_every=0.04),
    )
    write_paraview(fs.simulate(model), tmp_path)
    plate = meshio.read(tmp_path / "counterface_0001.vtu")
    assert plate.cells[0].type == "quad"
    sides = np.linalg.norm(np.diff(plate.points[[0, 1, 2, 3, 0]], axis=0), axis=1)
    assert np.ptp(sides) < 1e-12
    assert not (tmp_path / "sites.pvd").exists()


def test_a_history_without_snapshots_is_refused(pushed: xr.Dataset, tmp_path: Path) -> None:
    with pytest.raises(ResultError, match=r"has no snapshots of the whole mesh; write record: \{snapshots_every"):
        write_paraview(pushed.isel(snapshot_time=slice(0, 0)), tmp_path)
