"""The shape of cells in numbers."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from fingerslip.errors import MeshError
from fingerslip.mesh.quality import check_quality, quality_table


def quadrilateral(*corners):
    return skfem.MeshQuad1(np.array(corners, dtype=float).T, np.array([[0], [1], [2], [3]]))


def test_rectangle_is_perfect_but_long():
    (row,) = quality_table(quadrilateral((0, 0), (3, 0), (3, 1), (0, 1)))
    assert (row.region, row.cells, row.scaled_jacobian, row.aspect_ratio) == ("mesh", 1, 1.0, 3.0)
    assert (row.smallest_angle, row.largest_angle) == pytest.approx((np.pi / 2, np.pi / 2))


def test_rhombus_has_the_sine_of_its_angle():
    (row,) = quality_table(quadrilateral((0, 0), (1, 0), (1.5, np.sqrt(3) / 2), (0.5, np.sqrt(3) / 2)))
    assert row.scaled_jacobian == pytest.approx(np.sin(np.pi / 3))
    assert np.degrees([row.smallest_angle, row.largest_angle]) == pytest.approx([60, 120])


def test_reflex_corner_is_negative():
    (row,) = quality_table(quadrilateral((0, 0), (1, 0), (0.2, 0.2), (0, 1)))
    assert row.scaled_jacobian < 0
    assert row.largest_angle > np.pi


def test_equilateral_triangle_is_perfect():
    mesh = skfem.MeshTri1(np.array([[0, 1, 0.5], [0, 0, np.sqrt(3) / 2]]), np.array([[0], [1], [2]]))
    (row,) = quality_table(mesh)
    assert row.scaled_jacobian == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("corners", "message"),
    [
        (((0, 0), (1, 0), (0.2, 0.2), (0, 1)), "mesh cell 0 at x = 300 mm, y = 300 mm: scaled Jacobian -"),
        (((0, 0), (12, 0), (12, 1), (0, 1)), "aspect ratio 12, needs < 10"),
    ],
)
def test_poor_cells_are_refused_with_their_place(corners, message):
    with pytest.raises(MeshError, match=message):
        check_quality(quadrilateral(*corners))


def triangle(apex):
    """Return an isosceles triangle with an angle [deg] at its apex."""
    half = np.radians(apex) / 2
    corners = np.array([[0.0, -np.sin(half), np.sin(half)], [0.0, np.cos(half), np.cos(half)]])
    return skfem.MeshTri1(corners, np.array([[0], [1], [2]]))


def kite(apex):
    """Return a quadrilateral with a blunt angle [deg] at one corner and no other beyond 75."""
    half = np.radians(apex) / 2
    return quadrilateral((0, 0), (np.sin(half), np.cos(half)), (0, 1.5), (-np.sin(half), np.cos(half)))


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (triangle(14.0), "smallest angle in degrees 14, needs > 15"),
        (triangle(145.0), "largest angle in degrees 145, needs < 140"),
        (triangle(12.0), r"scaled Jacobian 0.24, needs > 0.25"),
        (kite(165.2), "largest angle in degrees 165, needs < 165"),
    ],
)
def test_every_limit_is_held(mesh, message):
    with pytest.raises(MeshError, match=message):
        check_quality(mesh)


def test_good_cells_of_either_kind_pass():
    check_quality(triangle(60.0))
    check_quality(triangle(16.0))
    check_quality(kite(164.0))
    check_quality(quadrilateral((0, 0), (9, 0), (9, 1), (0, 1)))


def test_the_region_of_the_worst_cell_is_named():
    points = np.array([[0, 0], [1, 0], [13, 0], [0, 1], [1, 1], [13, 1]], dtype=float)
    mesh = skfem.MeshQuad1(points.T, np.array([[0, 1, 4, 3], [1, 2, 5, 4]]).T)
    mesh = mesh.with_subdomains({"low": np.array([0]), "long": np.array([1])})
    with pytest.raises(MeshError, match=r"^long cell 1 at x = 7000 mm, y = 500 mm: aspect ratio 12, needs < 10"):
        check_quality(mesh)
    low, long = quality_table(mesh)
    assert (low.region, low.aspect_ratio, long.aspect_ratio) == ("low", 1.0, 12.0)


def tetrahedron(*corners):
    return skfem.MeshTet1(np.array(corners, dtype=float).T.copy(), np.array([[0], [1], [2], [3]]))


def test_regular_tetrahedron_is_best_and_the_corner_of_a_cube_known():
    (row,) = quality_table(tetrahedron((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)))
    assert (row.scaled_jacobian, row.aspect_ratio) == (pytest.approx(1.0), pytest.approx(1.0))
    assert (row.smallest_angle, row.largest_angle) == (pytest.approx(np.arccos(1 / 3)), pytest.approx(np.arccos(1 / 3)))
    (row,) = quality_table(tetrahedron((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)))
    assert np.degrees([row.smallest_angle, row.largest_angle]) == pytest.approx([54.7356, 90.0], abs=1e-3)
    assert row.scaled_jacobian == pytest.approx(np.sqrt(2) * 0.5)


def test_sliver_is_refused_with_its_place():
    sliver = tetrahedron((0, 0, 0), (1, 0, 0.03), (1, 1, 0), (0, 1, 0.03))
    with pytest.raises(MeshError, match=r"cell 0 at x = 500 mm, y = 500 mm, z = 15 mm: smallest angle in degrees"):
        check_quality(sliver)


def test_corners_may_be_counted_either_way_round_but_not_both_ways_in_one_mesh():
    grid = np.linspace(0.0, 1.0, 4)
    mesh = skfem.MeshQuad.init_tensor(grid, grid)
    turned = skfem.MeshQuad(mesh.p, mesh.t[[0, 3, 2, 1]])
    for either in (mesh, turned):
        (row,) = quality_table(either)
        assert row.scaled_jacobian == pytest.approx(1.0)
        assert row.largest_angle == pytest.approx(np.pi / 2)
    cells = mesh.t.copy()
    cells[:, 4] = cells[[0, 3, 2, 1], 4]
    (row,) = quality_table(skfem.MeshQuad(mesh.p, cells))
    assert row.scaled_jacobian == pytest.approx(-1.0)
