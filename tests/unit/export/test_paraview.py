"""Snapshots with contact, counterfaces, sites and tensors as files for ParaView, and as other programs read them."""

import ast
import subprocess
import sys
from xml.etree import ElementTree as ET

import meshio
import numpy as np
import pytest
import pyvista
import xarray as xr
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkDataArray
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

import fingerslip as fs
from fingerslip.export.paraview import cell_tensors, write_paraview, write_series
from fingerslip.fe.recovery import von_mises
from fingerslip.snapshot import CELL_TYPES, Snapshot, faces_at
from fingerslip.verification.meshes import box
from problems.pushed import push_and_slide
from unit.report.scenes import block_history


@pytest.fixture(scope="module")
def folder(pushed, tmp_path_factory):
    found = tmp_path_factory.mktemp("paraview")
    write_paraview(pushed, found)
    return found


@pytest.mark.parametrize(("name", "one"), [("body", "body"), ("counterfaces", "counterface"), ("sites", "site")])
def test_every_part_has_a_file_for_each_snapshot(folder, pushed, name, one):
    entries = list(ET.parse(folder / f"{name}.pvd").getroot().iter("DataSet"))
    assert [float(entry.attrib["timestep"]) for entry in entries] == pytest.approx(pushed["snapshot_time"].values)
    assert [entry.attrib["file"] for entry in entries] == [f"{one}_{n:04d}.vtu" for n in range(len(entries))]
    assert all((folder / entry.attrib["file"]).is_file() for entry in entries)


def test_contact_plate_and_sites_are_where_they_are_and_the_script_is_python(folder, pushed):
    body = meshio.read(folder / "body_0002.vtu")
    step = int(np.abs(pushed["time"].values - pushed["snapshot_time"].values[2]).argmin())
    nodes = pushed["contact_node"].values
    pressure = body.point_data["contact_pressure"]
    np.testing.assert_array_equal(pressure[nodes], pushed["normal_traction"].values[step])
    assert np.isnan(np.delete(pressure, nodes)).all()
    assert pressure[nodes].max() > 0.0
    assert body.point_data["friction_traction"].shape == (len(body.points), 3)
    assert (folder / "regions.csv").read_text(encoding="utf-8") == "number,region\n0,bulk\n"
    first, last = (meshio.read(folder / f"counterface_{n:04d}.vtu").points for n in (0, 4))
    moved = pushed["counterface_displacement"].values
    step = int(np.abs(pushed["time"].values - pushed["snapshot_time"].values[4]).argmin())
    assert last[:, 1] - first[:, 1] == pytest.approx(np.full(2, moved[step, 0, 1] - moved[0, 0, 1]), abs=1e-9)
    sites = meshio.read(folder / "site_0004.vtu")
    assert sites.point_data["kind"].tolist() == [2, -1]
    np.testing.assert_allclose(sites.points[:, :2], pushed["site_position"].values)
    ast.parse((folder / "show.py").read_text(encoding="utf-8"))


def test_every_file_of_a_series_has_the_fields_of_its_snapshot_and_the_same_mesh(folder, pushed):
    for number, moved in enumerate(pushed["snapshot_displacement"].values):
        reader = vtkXMLUnstructuredGridReader()
        reader.SetFileName(str(folder / f"body_{number:04d}.vtu"))
        reader.Update()
        grid, body = reader.GetOutput(), meshio.read(folder / f"body_{number:04d}.vtu")
        read = vtk_to_numpy(grid.GetPointData().GetArray("displacement"))
        np.testing.assert_array_equal(read[:, : moved.shape[1]], moved)
        units = {"displacement": "m", "contact_pressure": "Pa"}
        for name, unit in units.items():
            told = grid.GetPointData().GetArray(name).GetInformation().Get(vtkDataArray.UNITS_LABEL())
            assert told.strip() == unit
        np.testing.assert_array_equal(body.point_data["displacement"], read)
        np.testing.assert_array_equal(vtk_to_numpy(grid.GetPoints().GetData()), body.points)
        np.testing.assert_array_equal(body.points[:, : moved.shape[1]], pushed["node_position"])
        np.testing.assert_array_equal(body.cells[0].data, pushed["cell_nodes"])
        np.testing.assert_array_equal(body.cell_data["region"][0], pushed["cell_region"])
        for name, values in cell_tensors(pushed, number).items():
            np.testing.assert_array_equal(body.cell_data[name][0].reshape(-1, 3, 3), values)
            array = grid.GetCellData().GetArray(name)
            assert array.GetNumberOfComponents() == 9
            np.testing.assert_array_equal(vtk_to_numpy(array).reshape(-1, 3, 3), values)
    assert np.abs(values).max() > 0.0


def test_plates_in_space_are_squares(tmp_path):
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
    sides = np.linalg.norm(np.diff(plate.points[plate.cells[0].data[0][[0, 1, 2, 3, 0]]], axis=0), axis=1)
    assert np.ptp(sides) < 1e-12
    assert not (tmp_path / "sites.pvd").exists()


@pytest.mark.parametrize(("dim", "kind", "few"), [(2, "quad", "triangle"), (3, "hexahedron", "wedge")])
def test_triangles_and_prisms_of_a_mixed_mesh_are_written_as_such_with_their_values(tmp_path, dim, kind, few):
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]], dtype=float)
    cells = np.array([[0, 1, 2, 3], [1, 4, 2, 2]])
    if dim == 3:
        points, cells = np.vstack([points, points + np.array([0, 0, 1])]), np.hstack([cells, cells + 5])
    snapshot = Snapshot(0.0, {2: 9, 3: 12}[dim], points, cells, {}, {"number": np.array([7.0, 8.0])})
    write_series(tmp_path, "bodies", [snapshot])
    read = meshio.read(tmp_path / "bodie_0000.vtu")
    assert [block.type for block in read.cells] == [kind, few]
    assert [values.tolist() for values in read.cell_data["number"]] == [[7.0], [8.0]]
    sizes = pyvista.read(tmp_path / "bodie_0000.vtu").compute_cell_sizes()
    np.testing.assert_allclose(sizes["Volume" if dim == 3 else "Area"], [1.0, 0.5])


MODULUS, RATIO = 50e3, 0.3  # of the block


def differences_of_nodes(history, number):
    """Return the small strains of simplices from the displacement of their corners."""
    dim = history.sizes["component"]
    cells = history["cell_nodes"].values[:, : dim + 1]
    points, moved = (
        values[cells] for values in (history["node_position"].values, history["snapshot_displacement"].values[number])
    )
    edges, changes = points[:, 1:] - points[:, :1], moved[:, 1:] - moved[:, :1]
    gradient = np.zeros((len(cells), 3, 3))
    gradient[:, :dim, :dim] = np.linalg.solve(edges, changes).transpose(0, 2, 1)
    return 0.5 * (gradient + gradient.transpose(0, 2, 1))


@pytest.mark.parametrize("element", ["T3", "T4"])
def test_strain_is_that_of_the_displaced_nodes(element):
    history = block_history(element)
    expected = differences_of_nodes(history, -1)
    np.testing.assert_allclose(cell_tensors(history, -1)["strain"], expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("element", list(CELL_TYPES))
def test_stress_follows_from_strain_by_hookes_law(element):
    history = block_history(element)
    tensors = cell_tensors(history, -1)
    shear, bulk = MODULUS / (2 * (1 + RATIO)), MODULUS * RATIO / ((1 + RATIO) * (1 - 2 * RATIO))
    trace = np.trace(tensors["strain"], axis1=1, axis2=2)
    hooke = 2 * shear * tensors["strain"] + bulk * trace[:, None, None] * np.eye(3)
    np.testing.assert_allclose(tensors["stress"], hooke, atol=1e-5 * np.abs(hooke).max())
    packed = tensors["stress"][:, [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    np.testing.assert_allclose(von_mises(packed), history["snapshot_von_mises"].values[-1], rtol=1e-5)


def test_without_recorded_tensors_none_are_written(pushed, tmp_path):
    write_paraview(pushed.drop_vars(["snapshot_stress", "snapshot_strain"]), tmp_path)
    written = set(meshio.read(tmp_path / "body_0001.vtu").cell_data)
    assert written == {"strain_energy_density", "von_mises", "region"}


READ = """
import pathlib, pyvista
for path in pathlib.Path(".").glob("*.vtu"):
    assert pyvista.read(path).n_cells, path
"""
AXES = np.linspace(-4e-3, 4e-3, 7)
SQUARE = box("Q4", AXES, np.linspace(0.0, 4e-3, 4))
CUBE = box("H8", AXES, AXES, np.linspace(0.0, 4e-3, 4))


def pressed(mesh, counterface):
    dim = mesh.dim()
    model = push_and_slide(
        mesh=mesh,
        formulation="solid" if dim == 3 else "plane_strain",
        depth=1.0 if dim == 3 else 10e-3,
        supports={"top": ("x", "y", "z")[:dim]},
        contacts=(fs.Contact("bottom", counterface, fs.Coulomb(0.4)),),
        programme=(fs.Press(0.2e-3, 5e-3), fs.Slide(0.2e-3, 5e-3)),
        record=fs.Recording(snapshots_every=0.04),
    )
    return fs.simulate(model)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mesh", "counterface"),
    [
        (SQUARE, fs.Cylinder(5e-3)),
        (SQUARE, fs.Plane((0.1, 1.0))),
        (CUBE, fs.Cylinder(5e-3, (0.0, 0.0, 1.0), axis=(0.0, 1.0, 0.0))),
        (CUBE, fs.Sphere(5e-3)),
    ],
)
def test_every_file_is_read_by_vtk_and_has_the_counterface_where_it_is(mesh, counterface, tmp_path):
    history = pressed(mesh, counterface)
    fs.write_history(history, tmp_path / "history.nc")
    history = fs.read_history(tmp_path / "history.nc")
    write_paraview(history, tmp_path)
    # VTK ends the process on a damaged file.
    subprocess.run([sys.executable, "-c", READ], cwd=tmp_path, check=True)
    placed = counterface.at_start(history["node_position"].values[bottom(mesh)])
    for number in range(history.sizes["snapshot_time"]):
        points = meshio.read(tmp_path / f"counterface_{number:04d}.vtu").points[:, : mesh.dim()]
        step = int(np.abs(history["time"].values - history["snapshot_time"].values[number]).argmin())
        gaps = placed.gap(points - history["counterface_displacement"].values[step, 0])
        np.testing.assert_allclose(gaps, 0.0, atol=1e-9)


DISC, RADIUS = np.array([0.0, -20e-3]), 20e-3


@pytest.mark.parametrize("centre", [(0.0, -2e-3), tuple(DISC)])
def test_an_outline_turns_with_its_body_and_where_it_rolls_what_may_touch_is_drawn(centre):
    """A disc on a body that turns by 1 about another centre than its own, and about its own."""
    free = {"free": ("y", "rz"), "inertia": (1e-8,), "springs": fs.Springs(rz=1e-3), "loads": (fs.BodyLoad(y=0.01),)}
    model = push_and_slide(
        contacts=(fs.Contact("bottom", fs.Cylinder(RADIUS, centre=tuple(DISC)), fs.Coulomb(0.4), rigid_body="disc"),),
        bodies={"disc": fs.RigidBody(1e-3, centre=centre, **free)},
        programme=(),
        time=fs.TimeStepping(5e-3, end=0.01),
        record=fs.Recording(snapshots_every=0.01),
    )
    history = fs.simulate(model)
    outline = history["counterface_outline"].values[0, :, 0]
    assert np.abs(outline[[0, -1], 0]).min() > np.abs(history["node_position"].values[:, 0]).max(), "beyond the body"
    turned = history.assign(rigid_body_rotation=xr.ones_like(history["rigid_body_rotation"]))
    (face,) = faces_at(turned, -1, 1e-2)
    turn = np.array([[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]])
    moved = history["counterface_displacement"].values[-1, 0]
    middle = centre + turn @ (DISC - centre) + moved
    np.testing.assert_allclose(np.linalg.norm(face.surface[:, 0, :2] - middle, axis=1), RADIUS, rtol=1e-6)
    drawn = outline if centre == tuple(DISC) else centre + (outline - centre) @ turn.T
    np.testing.assert_allclose(face.surface[:, 0, :2], drawn + moved, atol=1e-9)


def bottom(mesh):
    return np.unique(mesh.facets[:, mesh.boundaries["bottom"]])


@pytest.mark.slow
def test_a_round_counterface_of_an_old_history_has_no_files(tmp_path):
    history = pressed(SQUARE, fs.Cylinder(5e-3))
    write_paraview(history.drop_dims(["outline_row", "outline_column"]).drop_vars("counterface_shape"), tmp_path)
    assert not list(tmp_path.glob("counterface*"))
    assert (tmp_path / "body.pvd").is_file()
