"""Names of boundaries of a TacTip's mesh."""

from __future__ import annotations

import numpy as np
import skfem

from fingerslip.specimens.tactip.meshing.sizes import with_names


def test_outside_of_the_skin_and_face_of_the_window():
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0.0, 1.0, 3), np.array([0.0, 1.0, 2.0, 3.0]))
    height = mesh.p[1, mesh.t].mean(axis=0)
    region = np.where(height < 1.0, 0, np.where(height < 2.0, 1, 3))
    named = with_names(mesh, region, half=False)
    assert len(named.boundaries["window_face"]) == 2
    assert len(named.boundaries["contact"]) == 4
    assert set(named.subdomains) == {"skin", "gel", "window"}


def test_a_half_has_a_plane_of_symmetry():
    mesh = skfem.MeshTet.init_tensor(*[np.linspace(0.0, 1.0, 3)] * 3)
    named = with_names(mesh, np.zeros(mesh.t.shape[1], dtype=np.int64), half=True)
    symmetry = named.boundaries["symmetry"]
    assert np.all(mesh.p[2, mesh.facets[:, symmetry]] == 0.0)
    assert len(symmetry) == 8
    assert not np.isin(named.boundaries["contact"], symmetry).any()
