"""The folder of a run: written, read back, with snapshots; what tells runs apart; bases."""

import dataclasses
import json
import logging
import os
import platform
import shutil
import subprocess
import threading
import unittest.mock
import xml.etree.ElementTree as ET
from importlib import metadata

import meshio
import numpy as np
import pytest
import pyvista
import skfem

from fingerslip.fe.space import build_space, cell_nodes
from fingerslip.history import make_history, read_history
from fingerslip.slip import find_events, measures
from fingerslip.slip.measures import Measure
from fingerslip.study.definition.runs import plan_study
from fingerslip.study.storage import store
from fingerslip.study.storage.reporting import read_run_values
from fingerslip.study.storage.store import BasisFolder, commit, mesh_hash, read_run, write_run, write_snapshots
from problems.blocks import distorted
from unit.study.block import block_mesh, block_values
from unit.synthetic import Process, make


@pytest.fixture
def folder(write_study, tmp_path):
    """Return the folder of a run that was written without computing it."""
    run = plan_study(write_study()).runs[1]
    folder = tmp_path / run.name
    folder.mkdir()
    doubts, history = ("contacts.0: turns",), make(Process()).assign_attrs(doubt="time steps have made energy")
    write_run(folder, run, history, inputs="abc", mesh=block_mesh(), seconds=1.2345, doubts=doubts)
    return folder


def test_what_is_written_is_read_back_with_all_values(folder):
    result = read_run(folder)
    assert sorted(path.name for path in folder.iterdir()) == ["events.json", "history.nc", "run.yaml"]
    assert (result.name, result.identity, result.seconds) == ("friction_coefficient-0.4", "abc", 1.234)
    assert result.swept == {"contact.friction_coefficient": 0.4}
    assert result.events == find_events(read_history(folder / "history.nc"))
    assert result.values["programme.0.press.depth"] == "0.0001 m"
    assert result.values["materials.block.poisson_ratio"] == 0.3
    assert read_run_values(folder / "run.yaml").study.programme[1].direction == (1.0, 0.0), "where the plate went"
    assert result.mesh_hash == mesh_hash(block_mesh())
    assert result.doubts == ("contacts.0: turns", "time steps have made energy")
    assert result.mesh_size == pytest.approx(32 ** (-1 / 2))


def test_an_added_measure_is_in_the_file_and_in_the_log_with_a_warning_of_contact_at_a_free_edge(
    write_study, tmp_path, monkeypatch, caplog
):
    added = Measure("slides", "number of slides", lambda history: int((history["phase_kind"] == "slide").sum()))
    monkeypatch.setattr(measures, "MEASURES", (*measures.MEASURES, added))
    run, history = plan_study(write_study()).runs[0], make(Process())

    def warnings(history):
        caplog.clear()
        with caplog.at_level(logging.INFO, "fingerslip"):
            write_run(tmp_path, run, history, inputs="a", mesh=block_mesh(), seconds=1.0)
        return [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]

    ending = history.assign_coords(contact_edge_distance=("contact_node", np.zeros(history.sizes["contact_node"])))
    (message,) = warnings(ending)
    assert "friction_coefficient-0.2 ('skin' from" in message
    stored = json.loads((tmp_path / "events.json").read_text())
    assert (stored["edge_contact"]["distance_m"], stored["numbers"]["slides"]) == (0.0, 1)
    assert {"number of slides: 1", "largest normal force: 0.4 N"} <= set(caplog.messages)
    assert warnings(history) == []


def test_identity_changes_with_values_and_mesh_but_not_with_the_title(write_study):
    def first(values, **more):
        return plan_study(write_study(block_values() | values, **more)).runs[0].identity

    base = first({})
    assert first({"title": "another"}) == base
    assert len({base, first({"depth": "2 mm"}), first({}, curvature=1.0)}) == 3


def test_mesh_hash_sees_points_and_cells_and_nothing_else_and_is_one_on_processors_that_round_otherwise():
    mesh = block_mesh()
    assert mesh_hash(mesh) == mesh_hash(block_mesh())
    assert mesh_hash(mesh.with_boundaries({"other": np.array([0])})) == mesh_hash(mesh)
    moved = mesh.p.copy()
    moved[1, 7] += 1e-8  # a millionth of the size
    assert mesh_hash(skfem.MeshQuad(moved, mesh.t)) != mesh_hash(mesh)
    assert mesh_hash(skfem.MeshQuad(mesh.p, mesh.t[:, ::-1])) != mesh_hash(mesh)
    mesh = skfem.MeshTri().refined(4).scaled(7e-3)
    hashes = {mesh_hash(dataclasses.replace(mesh, doflocs=points)) for points in (mesh.p, np.nextafter(mesh.p, 1.0))}
    assert len(hashes) == 1
    assert mesh_hash(dataclasses.replace(mesh, doflocs=mesh.p * [[1.0], [1.001]])) not in hashes


def test_versions_are_those_that_run_and_packages_that_are_not_installed_are_left_out(monkeypatch):
    found, whole = store.versions(), metadata.version
    known = {"python": platform.python_version(), "numpy": np.__version__, "fingerslip": whole("fingerslip")}
    assert known.items() <= found.items()
    assert {"scikit-fem", "gmsh", "scipy", "xarray"} <= set(found)

    def version(name):
        if name == "mkl":
            raise metadata.PackageNotFoundError(name)
        return whole(name)

    monkeypatch.setattr(metadata, "version", version)
    assert set(store.versions.__wrapped__()) == set(found) - {"mkl"}


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """Return a git repository with one commit in which the package seems to be."""
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    module = tmp_path / "src" / "fingerslip" / "study" / "storage" / "store.py"
    module.parent.mkdir(parents=True)
    module.write_text("")
    who = ["-c", "user.name=nobody", "-c", "user.email=nobody@example.org", "-c", "commit.gpgsign=false"]
    for arguments in (["init", "-q"], ["add", "."], [*who, "commit", "-q", "-m", "first"], ["tag", "v1.0"]):
        subprocess.run(["git", "-C", str(tmp_path), *arguments], check=True)
    monkeypatch.setattr(store, "__file__", str(module))
    return tmp_path


def test_commit_is_the_whole_hash_and_says_when_files_were_changed_or_is_not_known(checkout, monkeypatch):
    """A tag on the commit must not stand in for its hash."""
    command = ["git", "-C", str(checkout), "rev-parse", "HEAD"]
    head = subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    assert commit() == head
    (checkout / "src" / "fingerslip" / "study" / "storage" / "store.py").write_text("changed")
    assert commit() == f"{head}-dirty"
    for error in (FileNotFoundError("git"), subprocess.TimeoutExpired("git", 10)):
        with monkeypatch.context() as patch:
            patch.setattr(subprocess, "run", unittest.mock.Mock(side_effect=error))
            assert commit() is None, "without a git that answers"
    monkeypatch.setattr(store, "__file__", str(checkout.parent / "a" / "b" / "c" / "d" / "store.py"))
    assert commit() is None, "outside a checkout"


ARRAYS = {"eigenvalues": np.array([1.0, 2.5]), "interface": np.array([3, 4]), "shapes": np.zeros((4, 0))}


@pytest.fixture
def bases(tmp_path):
    return BasisFolder(tmp_path / "study" / ".bases")


def test_arrays_are_read_back_as_they_were_and_an_unknown_key_makes_no_folder(bases):
    assert bases.load("other") is None
    assert not bases.folder.exists()
    bases.save("one", ARRAYS)
    found = bases.load("one")
    assert found is not None
    assert found.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(found[name], array)
        assert found[name].dtype == array.dtype


@pytest.mark.parametrize(
    "damage", [lambda b: b[:-3], lambda b: b[:100] + b"x" + b[101:], lambda _: b"", lambda _: b"\xff" * 200]
)
def test_a_damaged_file_is_not_used_and_replaced(bases, damage, caplog):
    bases.save("one", ARRAYS)
    (file,) = bases.folder.iterdir()
    file.write_bytes(damage(file.read_bytes()))
    caplog.set_level(logging.WARNING, "fingerslip")
    assert bases.load("one") is None
    assert str(file) in caplog.text
    assert "the basis is made again" in caplog.text
    bases.save("one", ARRAYS)
    assert bases.load("one") is not None


def test_only_the_newest_are_kept_and_a_folder_that_cannot_be_written_is_told(bases, tmp_path, monkeypatch, caplog):
    bases = dataclasses.replace(bases, most=2)
    for age, key in enumerate(["a", "b", "c"]):
        bases.save(key, ARRAYS)
        os.utime(bases.folder / f"{key}.basis", (1e9 + age, 1e9 + age))
    bases.save("d", ARRAYS)
    assert sorted(path.name for path in bases.folder.iterdir()) == ["c.basis", "d.basis"]
    (tmp_path / "file").write_text("")
    caplog.set_level(logging.WARNING, "fingerslip")
    with BasisFolder(tmp_path / "file" / "inside").alone("one"):
        BasisFolder(tmp_path / "file" / "inside").save("one", ARRAYS)
    assert "the basis is not kept" in caplog.text


def test_whoever_makes_a_basis_is_alone(bases):
    inside, came = threading.Event(), list[bool]()

    def take():
        with bases.alone("one"):
            came.append(inside.is_set())

    with bases.alone("one"):
        waiting = threading.Thread(target=take)
        waiting.start()
        waiting.join(0.2)
        assert waiting.is_alive()
        inside.set()
    waiting.join(10.0)
    assert came == [True]
    assert not bases.folder.exists()


TIMES = [0.0, 0.05, 0.12]


def history_on(mesh):
    space = build_space(mesh)
    rng = np.random.default_rng(0)
    nodal = rng.normal(size=(2, len(TIMES), len(space.positions), 2))
    cells = rng.uniform(size=(2, len(TIMES), mesh.nelements))
    values = {
        "time": np.linspace(0.0, 0.12, 5),
        "component": ["x", "y"],
        "snapshot_time": TIMES,
        "node_position": space.positions,
        "cell_nodes": cell_nodes(space),
        "cell_region": np.zeros(mesh.nelements, dtype=np.int8),
        "snapshot_displacement": nodal[0],
        "snapshot_velocity": nodal[1],
        "snapshot_strain_energy_density": cells[0],
        "snapshot_von_mises": cells[1],
    }
    return make_history(values, {"element": space.element})


@pytest.mark.parametrize(("element", "kind"), [("Q4", "quad"), ("T3", "triangle"), ("T6", "triangle6")])
def test_snapshots_are_the_mesh_with_its_values_and_there_is_none_without_any(element, kind, tmp_path):
    mesh = distorted(element)
    history = history_on(mesh)
    write_snapshots(history.drop_dims("snapshot_time"), tmp_path)
    assert list(tmp_path.iterdir()) == []
    write_snapshots(history, tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir())[0::3] == ["snapshot_0000.vtu", "snapshots.pvd"]
    entries = list(ET.parse(tmp_path / "snapshots.pvd").getroot().iter("DataSet"))
    assert [float(entry.get("timestep")) for entry in entries] == history["snapshot_time"].values.tolist()
    assert [entry.get("file") for entry in entries] == [f"snapshot_{number:04d}.vtu" for number in range(3)]
    grid = meshio.read(tmp_path / "snapshot_0002.vtu")
    (block,) = grid.cells
    assert block.type == kind
    for name in ("strain_energy_density", "von_mises"):
        np.testing.assert_array_equal(grid.cell_data[name][0], history[f"snapshot_{name}"][2])
    corners = block.data[:, : 4 if element == "Q4" else 3]
    np.testing.assert_array_equal(np.sort(corners, axis=1), np.sort(mesh.t[: corners.shape[1]].T, axis=1))
    # What ParaView's filter Warp By Vector does with a snapshot.
    warped = np.asarray(pyvista.read(tmp_path / "snapshot_0001.vtu").warp_by_vector("displacement").points)
    deformed = history["node_position"].values + history["snapshot_displacement"].values[1]
    np.testing.assert_allclose(warped[:, :2], deformed, rtol=1e-6)
    assert np.abs(deformed - history["node_position"].values).max() > 0.1
