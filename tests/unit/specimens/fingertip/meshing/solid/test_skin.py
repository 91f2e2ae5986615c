"""The skin in 3D: rows at their depths, conforming tetrahedra, and thicknesses that fit."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.specimens.fingertip import depth_below_skin, onto_skin, phalanx_surface
from fingerslip.specimens.fingertip.meshing.solid.build import (
    check_skin_fits,
    graded_sizes,
    sweep_solid_skin,
    tetrahedra,
)
from fingerslip.specimens.fingertip.meshing.solid.source import SolidSizes
from unit.fingers import change_solid

COARSE = SolidSizes("T4", contact_size=0.8e-3, bulk_size=1.6e-3)
RIPPLED = change_solid(fingerprint={"enabled": True})


def swept(fingertip, sizes=COARSE):
    return sweep_solid_skin(fingertip, sizes, phalanx_surface(fingertip).points.reshape(-1, 3))


@pytest.fixture(scope="module")
def skin():
    return swept(change_solid())


def test_rows_lie_at_their_depths_and_end_on_the_cut(skin):
    finger = change_solid()
    assert skin.levels == pytest.approx([0.0, 0.5e-3, 1e-3])
    assert np.abs(onto_skin(finger, skin.points[0]) - skin.points[0]).max() < 1e-9
    rim = skin.points[0][:, 0] == -16e-3
    assert np.count_nonzero(rim) > 20
    for level, row in zip(skin.levels, skin.points, strict=True):
        assert np.all(row[rim, 0] == -16e-3)
        assert np.allclose(depth_below_skin(finger, row[~rim]), level, atol=1e-5)


def test_contact_is_as_fine_as_wanted(skin):
    edge = np.linalg.norm(skin.points[0][skin.triangles[:, 0]] - skin.points[0][skin.triangles[:, 1]], axis=1)
    fine = skin.fine[skin.triangles].all(axis=1)
    assert np.median(edge[fine]) == pytest.approx(0.8e-3, rel=0.15)
    assert np.median(edge[~fine]) > 1.05 * np.median(edge[fine])
    assert skin.points[0][skin.fine, 1].max() <= -5e-3 + 1e-9


def test_tetrahedra_fill_the_rows_and_conform(skin):
    cells, row = tetrahedra(skin)
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


def test_skin_thicker_than_its_surface_bends_is_refused():
    check_skin_fits(change_solid())
    with pytest.raises(
        InputError, match=r"skin_thickness: got 3.5 mm, needs a smaller value: layers would cross .* x = "
    ):
        check_skin_fits(change_solid(layers={"skin_thickness": "3.5 mm"}, receptors={"fa_ii_depth": "4 mm"}))


def test_borders_of_layers_keep_apart():
    nail = {"start": "-4 mm", "end": "4 mm", "half_width": "4 mm", "thickness": "0.45 mm"}
    material = {"youngs_modulus": "170 MPa", "poisson_ratio": 0.3, "density": "1300 kg/m^3"}
    with pytest.raises(InputError, match=r"layers: has borders 0.05 mm apart"):
        swept(change_solid(solid={"nail": nail}, materials={"nail": material}))


def test_fingerprint_needs_four_elements_on_its_pitch():
    with pytest.raises(
        InputError, match=r"mesh.contact_size: got 0.8 mm, needs <= 0.1175 mm, a quarter of fingerprint.pitch"
    ):
        swept(RIPPLED)


def test_sizes_grow_with_distance_up_to_the_largest():
    points = np.array([[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0], [9e-3, 0.0, 0.0]])
    assert graded_sizes(points, points[:1], 0.3e-3, 1e-3) == pytest.approx([0.3e-3, 0.5e-3, 1e-3])
