"""Surfaces of layers: closed, and cut through the middle with the right area."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.report.page.surface import surface_arrays
from unit.report.scenes import block_history

SIDE = 10e-3


def areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


@pytest.mark.parametrize("element", ["T4", "T10", "H8"])
def test_a_block_of_two_layers_has_its_faces_and_its_section(element: str) -> None:
    history = block_history(element)
    surface = surface_arrays(history, [0, history.sizes["snapshot_time"] - 1])
    size = areas(surface.points, surface.triangles)
    # Two blocks share a face, which each of them has.
    assert size[~surface.is_cut].sum() == pytest.approx(8 * SIDE**2)
    assert size[surface.is_cut].sum() == pytest.approx(SIDE**2)
    cut = np.unique(surface.triangles[surface.is_cut])
    assert surface.points[cut, 2] == pytest.approx(surface.cut_at)
    first, second, third = (surface.points[surface.triangles[surface.is_cut][:, corner]] for corner in range(3))
    assert (np.cross(second - first, third - first)[:, 2] > 0.0).all(), "all face one way, or shading is speckled"
    assert set(surface.regions) == {0, 1}


@pytest.mark.parametrize("element", ["T4", "T10", "H8"])
def test_vertices_move_and_touch_as_nodes_do(element: str) -> None:
    history = block_history(element)
    last = history.sizes["snapshot_time"] - 1
    surface = surface_arrays(history, [last])
    moved = history["snapshot_displacement"].values[
        last, np.unique(history["cell_nodes"].values[:, : 8 if element == "H8" else 4])
    ]
    assert np.abs(surface.moved).max() == pytest.approx(np.abs(moved).max())
    touching = surface.points[surface.states[0] != 255]
    np.testing.assert_allclose(touching[:, 2], 0.0, atol=1e-12)
    assert len(touching) == 25, "all corners of the face on the plate"
    assert {*surface.states[0]} <= {*history["contact_state"].values[-1], 255}
    assert surface.stress.max() <= history["snapshot_von_mises"].values[last].max() + 1e-9
