"""The phalanx in 3D as triangles: closed but for its base, on its surface."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fingerslip.specimens.fingertip import phalanx_surface
from fingerslip.specimens.fingertip.meshing.solid import mesh_phalanx, rim, sweep_solid_skin
from fingerslip.specimens.fingertip.meshing.sources import SolidSizes
from unit.fingers import change_solid

COARSE = SolidSizes("T4", contact_size=0.8e-3, bulk_size=1.6e-3)


@pytest.mark.parametrize("variant", ["original", pytest.param("scaled", marks=pytest.mark.slow)])
def test_phalanx_has_a_rim_where_it_reaches_the_cut(variant):
    finger = change_solid(phalanx={"variant": variant})
    phalanx = phalanx_surface(finger)
    mesh = mesh_phalanx(finger, phalanx, COARSE, sweep_solid_skin(finger, COARSE, phalanx.points.reshape(-1, 3)))
    ring = rim(mesh)
    assert (len(ring) > 0) == phalanx.open
    assert np.all(np.abs(mesh.points[ring, 0] + 16e-3) < 1e-12)
    distance, _ = cKDTree(phalanx.points.reshape(-1, 3)).query(mesh.points)
    assert distance.max() < 0.2e-3
