"""Stress and strain tensors of snapshots, and as other programs read them."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
import xarray as xr
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from fingerslip.export.paraview import write_paraview
from fingerslip.export.tensors import centre_gradients, strain_tensors, stress_tensors
from fingerslip.fe.recovery import von_mises
from fingerslip.report.scene.snapshot import CELL_TYPES
from unit.report.scenes import block_history

GRADIENT = np.array([[0.01, 0.02, -0.03], [0.005, -0.02, 0.01], [0.0, 0.015, 0.03]])


def stretched(history: xr.Dataset, kinematics: str) -> xr.Dataset:
    """Return a history whose displacement has a known constant gradient."""
    dim = history.sizes["component"]
    moved = history["node_position"].values @ GRADIENT[:dim, :dim].T
    fields = np.broadcast_to(moved, history["snapshot_displacement"].shape)
    changed = history.assign(snapshot_displacement=(history["snapshot_displacement"].dims, fields))
    return changed.assign_attrs(kinematics=kinematics)


@pytest.mark.parametrize("element", list(CELL_TYPES))
def test_a_known_gradient_gives_its_strain(element: str) -> None:
    history = block_history(element)
    dim = history.sizes["component"]
    own = np.zeros((3, 3))
    own[:dim, :dim] = GRADIENT[:dim, :dim]
    small, large = (strain_tensors(stretched(history, kind), 0) for kind in ("small", "finite"))
    np.testing.assert_allclose(small, np.broadcast_to(0.5 * (own + own.T), small.shape), atol=1e-14)
    expected = 0.5 * (own + own.T + own.T @ own)
    np.testing.assert_allclose(large, np.broadcast_to(expected, large.shape), atol=1e-14)
    assert centre_gradients(element).sum(axis=0) == pytest.approx(np.zeros(dim), abs=1e-15)


def test_stress_is_that_of_hookes_law_and_of_the_von_mises_stress() -> None:
    history = block_history("T4")
    stress, strain = stress_tensors(history, -1), strain_tensors(history, -1)
    shear = 50e3 / (2 * 1.3)
    bulk = 50e3 * 0.3 / (1.3 * 0.4)
    trace = np.trace(strain, axis1=1, axis2=2)
    hooke = 2 * shear * strain + bulk * trace[:, None, None] * np.eye(3)
    np.testing.assert_allclose(stress, hooke, rtol=1e-5, atol=1e-5 * np.abs(hooke).max())
    packed = stress[:, [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    np.testing.assert_allclose(von_mises(packed), history["snapshot_von_mises"].values[-1], rtol=1e-5)


def test_plane_stress_says_nothing_of_the_strain_across(pushed: xr.Dataset) -> None:
    assert not strain_tensors(pushed, 1)[:, 2, 2].any()
    assert np.isnan(strain_tensors(pushed.assign_attrs(formulation="plane_stress"), 1)[:, 2, 2]).all()


def test_meshio_and_vtk_read_the_tensors_back(pushed: xr.Dataset, tmp_path: Path) -> None:
    write_paraview(pushed, tmp_path)
    file = tmp_path / "body_0002.vtu"
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(file))
    reader.Update()
    cells, read = reader.GetOutput().GetCellData(), meshio.read(file).cell_data
    for name, tensors in {"stress": stress_tensors(pushed, 2), "strain": strain_tensors(pushed, 2)}.items():
        np.testing.assert_array_equal(read[name][0].reshape(-1, 3, 3), tensors)
        assert cells.GetArray(name).GetNumberOfComponents() == 9
        np.testing.assert_array_equal(vtk_to_numpy(cells.GetArray(name)).reshape(-1, 3, 3), tensors)
        assert np.abs(tensors).max() > 0.0


def test_a_history_without_stress_is_written_without_it(pushed: xr.Dataset, tmp_path: Path) -> None:
    write_paraview(pushed.drop_vars("snapshot_stress"), tmp_path)
    assert set(meshio.read(tmp_path / "body_0001.vtu").cell_data) == {
        "strain_energy_density", "von_mises", "region", "strain"
    }  # fmt: skip
