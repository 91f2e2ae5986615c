"""The fingertip in 3D as a mesh: skin, phalanx, tissue by Gmsh, and what is refused."""

from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from fingerslip.errors import InputError, MeshError
from fingerslip.mesh.gmsh_session import mesh_surface
from fingerslip.specimens.fingertip.fingertip import SolidSizes
from fingerslip.specimens.fingertip.meshing import solid
from fingerslip.specimens.fingertip.phalanx import phalanx_surface
from fingerslip.specimens.fingertip.skin import below_skin, depth_below_skin, onto_skin, skin_grid
from fingerslip.study.definition.spec import read_study
from places import STUDIES
from unit.fingers import change_solid
from unit.mesh.test_gmsh import ball

SIZES = SolidSizes("T4", contact_size=0.8e-3, bulk_size=1.6e-3)


def swept(fingertip, sizes=SIZES):
    return solid.sweep_solid_skin(fingertip, sizes, phalanx_surface(fingertip).points.reshape(-1, 3))


@pytest.fixture(scope="module")
def skin():
    return swept(change_solid())


def test_rows_lie_at_their_depths_end_on_the_cut_and_are_as_fine_as_wanted_at_the_contact(skin):
    finger = change_solid()
    assert skin.levels == pytest.approx([0.0, 0.5e-3, 1e-3])
    assert np.abs(onto_skin(finger, skin.points[0]) - skin.points[0]).max() < 1e-9
    rim = skin.points[0][:, 0] == -16e-3
    assert np.count_nonzero(rim) > 20
    for level, row in zip(skin.levels, skin.points, strict=True):
        assert np.all(row[rim, 0] == -16e-3)
        assert np.allclose(depth_below_skin(finger, row[~rim]), level, atol=1e-5)
    edge = np.linalg.norm(skin.points[0][skin.triangles[:, 0]] - skin.points[0][skin.triangles[:, 1]], axis=1)
    fine = skin.fine[skin.triangles].all(axis=1)
    assert np.median(edge[fine]) == pytest.approx(0.8e-3, rel=0.15)
    assert np.median(edge[~fine]) > 1.05 * np.median(edge[fine])
    assert skin.points[0][skin.fine, 1].max() <= -5e-3 + 1e-9


def test_tetrahedra_fill_the_rows_and_conform(skin):
    cells, row = solid.tetrahedra(skin)
    points = skin.points.reshape(-1, 3)
    corners = points[cells]
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    assert len(cells) == 3 * 2 * len(skin.triangles)
    assert np.abs(volume).min() > 0.0
    faces = np.sort(np.concatenate([cells[:, [a, b, c]] for a, b, c in ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))]))
    _, count = np.unique(faces, axis=0, return_counts=True)
    assert count.max() == 2
    rim = np.count_nonzero(skin.points[0][:, 0] == -16e-3)
    # Outside: the first and the last row of triangles, and two triangles for each side of a prism on the cut.
    assert np.count_nonzero(count == 1) == 2 * len(skin.triangles) + 2 * rim * (len(skin.levels) - 1)
    assert list(np.unique(row)) == [0, 1]


@pytest.mark.slow
def test_triangles_are_fine_near_the_contact_and_never_wider_than_the_tissue(monkeypatch):
    finger, sizes = change_solid(), SolidSizes("T4", contact_size=0.4e-3, bulk_size=2e-3)
    monkeypatch.setattr(solid, "mesh_surface", mesher := Mock())
    skin = skin_grid(finger).reshape(-1, 3)
    inner = below_skin(finger, skin, finger.layers.skin_thickness)
    surface = phalanx_surface(finger)
    solid.mesh_phalanx(finger, surface, sizes, SimpleNamespace(points=inner[None]))
    grid, is_open, divide_at, wanted = mesher.call_args.args
    assert is_open
    assert grid is surface.points
    assert surface.points[divide_at, 0, 0] == pytest.approx(0.0)
    tissue = np.linalg.norm(surface.points[::6, ::6, None] - inner[None, None, ::20], axis=-1).min(axis=-1)
    wanted = wanted[::6, ::6]
    assert np.all(wanted >= sizes.contact_size)
    assert np.all(wanted <= np.maximum(0.75 * tissue, sizes.contact_size))
    palmar, dorsal = wanted[:, 0], wanted[:, wanted.shape[1] // 2]
    assert palmar.mean() < dorsal.mean()


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
def test_cells_fill_the_hull_whose_rim_runs_round_once(reaching):
    skin = shell(True)
    ring = solid.rim(skin)
    assert np.array_equal(np.sort(ring), np.flatnonzero(np.abs(skin.points[:, 0]) < 1e-9))
    assert np.linalg.norm(skin.points[ring] - skin.points[np.roll(ring, 1)], axis=1).max() < 1.6e-3
    phalanx = shell(True, 0.5) if reaching else shell(False, 0.3, 2.2e-3)
    core = solid.mesh_solid_core(skin, phalanx, 1.2e-3)
    inner = enclosed(phalanx)
    assert volume(core, "phalanx") == pytest.approx(inner, rel=1e-6)
    assert volume(core, "tissue") == pytest.approx(enclosed(skin) - inner, rel=1e-6)
    assert np.array_equal(core.points[: len(skin.points)], skin.points)


def test_sizes_have_defaults_are_refined_together_and_cells_are_foreseen_by_their_volume():
    sizes = SolidSizes()
    assert sizes == SolidSizes("T10", 0.8e-3, 1.3e-3, 1.5e-3)
    assert read_study(STUDIES / "wang2014_3d.yaml").mesh == sizes, "the shipped run has the defaults"
    assert (sizes.dim, sizes.element, sizes.needs_specimen, sizes.assumes_metres) == (3, "T10", True, False)
    assert sizes.refined(2.0) == SolidSizes("T10", 1.6e-3, 2.6e-3, 1.5e-3)
    points = np.array([[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0], [9e-3, 0.0, 0.0]])
    assert solid.graded_sizes(points, points[:1], 0.3e-3, 1e-3) == pytest.approx([0.3e-3, 0.5e-3, 1e-3])
    coarse, fine = (solid.solid_cells(change_solid(), SolidSizes("T4", size, size)) for size in (1e-3, 0.5e-3))
    assert fine == pytest.approx(8 * coarse)
    rippled = change_solid(fingerprint={"enabled": True, "pitch": "0.94 mm"})
    with pytest.raises(InputError, match=r"needs <= 0\.235 mm, a quarter of fingerprint\.pitch"):
        solid.solid_cells(rippled, SolidSizes("T4", 0.3e-3))


def test_failure_of_gmsh_is_ours(monkeypatch):
    skin, phalanx = shell(True), shell(True, 0.5)
    monkeypatch.setattr(solid.gmsh.model.mesh, "optimize", Mock(side_effect=RuntimeError("no")))
    with pytest.raises(MeshError, match="tissue and phalanx: Gmsh says 'no'"):
        solid.mesh_solid_core(skin, phalanx, 1.2e-3)
