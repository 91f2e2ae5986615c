"""The source of meshes in 3D gives the mesh of the function."""

from __future__ import annotations

from fingerslip.specimens.fingertip.meshing.sources import SolidSizes
from unit.fingers import change_solid, coarse_solid


def test_mesh_of_the_source_is_that_of_the_function():
    mesh = SolidSizes("T4", 0.8e-3, 1.6e-3).build(change_solid())
    assert mesh.p.tobytes() == coarse_solid().p.tobytes()
