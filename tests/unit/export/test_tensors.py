"""Stress and strain tensors of snapshots, and as other programs read them."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
import xarray as xr
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from fingerslip.export.paraview import cell_tensors, write_paraview
from fingerslip.fe.recovery import von_mises
from fingerslip.snapshot import CELL_TYPES
from unit.report.scenes import block_history

MODULUS, RATIO = 50e3, 0.3  # of the block


def differences_of_nodes(history: xr.Dataset, number: int) -> np.ndarray:
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
def test_strain_is_that_of_the_displaced_nodes(element: str) -> None:
    history = block_history(element)
    expected = differences_of_nodes(history, -1)
    np.testing.assert_allclose(cell_tensors(history, -1)["strain"], expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("element", list(CELL_TYPES))
def test_stress_follows_from_strain_by_hookes_law(element: str) -> None:
    history = block_history(element)
    tensors = cell_tensors(history, -1)
    shear, bulk = MODULUS / (2 * (1 + RATIO)), MODULUS * RATIO / ((1 + RATIO) * (1 - 2 * RATIO))
    trace = np.trace(tensors["strain"], axis1=1, axis2=2)
    hooke = 2 * shear * tensors["strain"] + bulk * trace[:, None, None] * np.eye(3)
    np.testing.assert_allclose(tensors["stress"], hooke, atol=1e-5 * np.abs(hooke).max())
    packed = tensors["stress"][:, [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    np.testing.assert_allclose(von_mises(packed), history["snapshot_von_mises"].values[-1], rtol=1e-5)


def test_meshio_and_vtk_read_the_tensors_back(pushed: xr.Dataset, tmp_path: Path) -> None:
    write_paraview(pushed, tmp_path)
    file = tmp_path / "body_0002.vtu"
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(file))
    reader.Update()
    cells, read = reader.GetOutput().GetCellData(), meshio.read(file).cell_data
    tensors = cell_tensors(pushed, 2)
    assert set(tensors) == {"stress", "strain"}
    for name, values in tensors.items():
        np.testing.assert_array_equal(read[name][0].reshape(-1, 3, 3), values)
        assert cells.GetArray(name).GetNumberOfComponents() == 9
        np.testing.assert_array_equal(vtk_to_numpy(cells.GetArray(name)).reshape(-1, 3, 3), values)
        assert np.abs(values).max() > 0.0


def test_a_history_without_tensors_is_written_without_them(pushed: xr.Dataset, tmp_path: Path) -> None:
    write_paraview(pushed.drop_vars(["snapshot_stress", "snapshot_strain"]), tmp_path)
    written = set(meshio.read(tmp_path / "body_0001.vtu").cell_data)
    assert written == {"strain_energy_density", "von_mises", "region"}
