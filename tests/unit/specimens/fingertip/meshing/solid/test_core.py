"""Tissue and phalanx in 3D: the hull is kept, cells fill it, with the phalanx in a hole or through the cut."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import MeshError
from fingerslip.mesh.patches import mesh_surface
from fingerslip.specimens.fingertip.meshing.solid import build as solid_core
from fingerslip.specimens.fingertip.meshing.solid.build import mesh_solid_core, rim
from unit.mesh.test_patches import ball


def volume(core, name):
    corners = core.points[core.cells[name]]
    return np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum() / 6.0


def enclosed(surface):
    """Volume between a surface that is closed, or open at x = 0, and the plane x = 0."""
    return float(np.linalg.det(surface.points[surface.triangles]).sum() / 6.0)


def shell(is_open, scale=1.0, shift=0.0):
    grid = scale * ball(np.pi / 2 if is_open else 0.0) + [shift, 0.0, 0.0]
    return mesh_surface(grid, is_open, 20, np.full(grid.shape[:2], 1.2e-3))


@pytest.mark.parametrize("reaching", [True, False])
def test_cells_fill_the_hull(reaching):
    skin = shell(True)
    phalanx = shell(True, 0.5) if reaching else shell(False, 0.3, 2.2e-3)
    core = mesh_solid_core(skin, phalanx, 1.2e-3)
    inner = enclosed(phalanx)
    assert volume(core, "phalanx") == pytest.approx(inner, rel=1e-6)
    assert volume(core, "tissue") == pytest.approx(enclosed(skin) - inner, rel=1e-6)
    assert np.array_equal(core.points[: len(skin.points)], skin.points)


def test_rim_runs_round_once():
    skin = shell(True)
    ring = rim(skin)
    on_cut = np.flatnonzero(np.abs(skin.points[:, 0]) < 1e-9)
    assert np.array_equal(np.sort(ring), on_cut)
    step = np.linalg.norm(skin.points[ring] - skin.points[np.roll(ring, 1)], axis=1)
    assert step.max() < 1.6e-3


def test_failure_of_gmsh_is_ours(monkeypatch):
    def fail(*_):
        raise RuntimeError("no")

    skin, phalanx = shell(True), shell(True, 0.5)
    monkeypatch.setattr(solid_core.gmsh.model.mesh, "optimize", fail)
    with pytest.raises(MeshError, match="tissue and phalanx: Gmsh says 'no'"):
        mesh_solid_core(skin, phalanx, 1.2e-3)
