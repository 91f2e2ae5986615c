"""Mirrored tetrahedra are turned round, with the middles of their edges."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from fingerslip.mesh.quality import positive_tetrahedra


@pytest.mark.parametrize("kind", [skfem.MeshTet1, skfem.MeshTet2])
def test_volumes_become_positive_and_middles_stay_on_their_edges(kind):
    mesh = (
        kind.init_tensor(*[np.linspace(0.0, 1.0, 3)] * 3)
        if kind is skfem.MeshTet1
        else skfem.MeshTet2.from_mesh(skfem.MeshTet1.init_tensor(*[np.linspace(0.0, 1.0, 3)] * 3))
    )
    points, cells = mesh.doflocs.T, np.array(mesh.dofs.element_dofs.T)
    before = cells.copy()
    turned = positive_tetrahedra(points, cells)
    np.testing.assert_array_equal(cells, before)
    a, b, c, d = np.moveaxis(points[turned[:, :4]], 1, 0)
    volume = np.sum(np.cross(b - a, c - a) * (d - a), axis=1) / 6
    assert volume.min() > 0.0
    assert volume.sum() == pytest.approx(1.0)
    assert (turned != before).any(), "some were mirrored"
    for middle, (first, second) in zip(turned[:, 4:].T, [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)], strict=False):
        np.testing.assert_allclose(points[middle], (points[turned[:, first]] + points[turned[:, second]]) / 2)
