"""Snapshots as VTK has them: reference points, three components, cells in its order and under its numbers."""

import meshio
import numpy as np
import pytest
import pyvista

from fingerslip.snapshot import CELL_TYPES, in_space, read_snapshot
from unit.report.scenes import block_history


@pytest.mark.parametrize(("element", "name"), [
    ("Q4", "QUAD"), ("T3", "TRIANGLE"), ("T6", "QUADRATIC_TRIANGLE"),
    ("H8", "HEXAHEDRON"), ("T4", "TETRA"), ("T10", "QUADRATIC_TETRA")
])  # fmt: skip
def test_both_libraries_know_every_element_under_these_names(element, name):
    kind = CELL_TYPES[element]
    assert kind.vtk == getattr(pyvista.CellType, name)
    assert meshio.vtk_to_meshio_type[kind.vtk] == kind.meshio if hasattr(meshio, "vtk_to_meshio_type") else True
    points = np.random.default_rng(0).normal(size=(10, 3))
    count = {"quad": 4, "triangle": 3, "triangle6": 6, "hexahedron": 8, "tetra": 4, "tetra10": 10}[kind.meshio]
    cells = np.arange(count)[None]
    (block,) = meshio.Mesh(points, [(kind.meshio, cells)]).cells
    assert block.type == kind.meshio
    assert pyvista.UnstructuredGrid({kind.vtk: cells}, points).n_cells == 1


@pytest.mark.parametrize("element", ["Q4", "T4"])
def test_points_are_reference_positions_and_vectors_have_three_components(element):
    history = block_history(element)
    snapshot = read_snapshot(history, 2)
    dim = history.sizes["component"]
    np.testing.assert_array_equal(snapshot.points[:, :dim], history["node_position"])
    assert snapshot.points.shape == snapshot.point_fields["displacement"].shape == (history.sizes["node"], 3)
    np.testing.assert_array_equal(snapshot.point_fields["displacement"][:, :dim], history["snapshot_displacement"][2])
    assert np.abs(snapshot.point_fields["displacement"]).max() > 1e-4, "the block has moved"
    assert snapshot.time == float(history["snapshot_time"][2])
    assert set(snapshot.cell_fields) == {"strain_energy_density", "von_mises", "region"}
    assert in_space(np.array([[1.0, 2.0]])).tolist() == [[1.0, 2.0, 0.0]]
    assert in_space(np.array([[1.0, 2.0, 3.0]])).tolist() == [[1.0, 2.0, 3.0]]
