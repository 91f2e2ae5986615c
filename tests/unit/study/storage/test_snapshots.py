"""Snapshots as files that ParaView opens: cells, middle nodes, vectors and times."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import meshio
import numpy as np
import pytest
import pyvista
import xarray as xr

from fingerslip.fe.space import build_space, cell_nodes
from fingerslip.history import make_history
from fingerslip.study.storage.store import write_snapshots
from problems.blocks import ELEMENTS, distorted

TIMES = [0.0, 0.05, 0.12]


def history_on(mesh: object) -> xr.Dataset:
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


@pytest.mark.parametrize("element", ELEMENTS)
def test_values_come_back_at_their_nodes_and_cells(element: str, tmp_path: Path) -> None:
    mesh = distorted(element)
    history = history_on(mesh)
    write_snapshots(history, tmp_path)
    for number in range(len(TIMES)):
        grid = meshio.read(tmp_path / f"snapshot_{number:04d}.vtu")
        np.testing.assert_array_equal(grid.points[:, :2], history["node_position"])
        assert not grid.points[:, 2].any()
        for name in ("displacement", "velocity"):
            stored = grid.point_data[name]
            np.testing.assert_array_equal(stored[:, :2], history[f"snapshot_{name}"][number])
            assert stored.shape[1] == 3
            assert not stored[:, 2].any()
        for name in ("strain_energy_density", "von_mises"):
            np.testing.assert_array_equal(grid.cell_data[name][0], history[f"snapshot_{name}"][number])


@pytest.mark.parametrize(("element", "kind"), [("Q4", "quad"), ("T3", "triangle"), ("T6", "triangle6")])
def test_cells_are_those_of_the_mesh(element: str, kind: str, tmp_path: Path) -> None:
    """VTK puts the middle nodes of a triangle on the sides 01, 12 and 20, in this order."""
    mesh = distorted(element)
    write_snapshots(history_on(mesh), tmp_path)
    grid = meshio.read(tmp_path / "snapshot_0000.vtu")
    (block,) = grid.cells
    assert block.type == kind
    corners = block.data[:, : 4 if element == "Q4" else 3]
    np.testing.assert_array_equal(np.sort(corners, axis=1), np.sort(mesh.t[: corners.shape[1]].T, axis=1))
    x, y = np.moveaxis(grid.points[corners][..., :2], 2, 0)
    around = 0.5 * np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)
    assert np.abs(around).sum() == pytest.approx(1.0, rel=1e-12), "corners in order round the cell"
    if element == "T6":
        ends = grid.points[corners]
        np.testing.assert_allclose(grid.points[block.data[:, 3:]], 0.5 * (ends + np.roll(ends, -1, axis=1)), atol=1e-15)


def test_collection_names_every_file_with_its_time(tmp_path: Path) -> None:
    mesh = distorted("Q4")
    write_snapshots(history_on(mesh), tmp_path)
    entries = list(ET.parse(tmp_path / "snapshots.pvd").getroot().iter("DataSet"))
    assert [float(entry.get("timestep")) for entry in entries] == TIMES
    assert [entry.get("file") for entry in entries] == [f"snapshot_{number:04d}.vtu" for number in range(3)]
    assert all((tmp_path / entry.get("file")).is_file() for entry in entries)


def test_without_snapshots_nothing_is_written(tmp_path: Path) -> None:
    mesh = distorted("Q4")
    write_snapshots(history_on(mesh).drop_dims("snapshot_time"), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_points_warped_by_the_displacement_are_the_deformed_body(tmp_path: Path) -> None:
    """What ParaView's filter Warp By Vector does with a snapshot."""
    history = history_on(distorted("Q4"))
    write_snapshots(history, tmp_path)
    grid = pyvista.read(tmp_path / "snapshot_0001.vtu")
    warped = grid.warp_by_vector("displacement")
    deformed = history["node_position"].values + history["snapshot_displacement"].values[1]
    np.testing.assert_allclose(np.asarray(warped.points)[:, :2], deformed, rtol=1e-6)
    assert np.abs(np.asarray(warped.points) - np.asarray(grid.points)).max() > 0.1
