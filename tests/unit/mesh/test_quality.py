import numpy as np
import pytest
import skfem

from fingerslip.errors import MeshError
from fingerslip.mesh import check_quality, quality_table
from fingerslip.mesh.smoothing import scaled_jacobians, smoothed


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


def test_smoothing_mends_a_bad_patch_and_leaves_the_border():
    x, y = np.meshgrid(np.arange(4.0), np.arange(4.0))
    points = np.column_stack([x.ravel(), y.ravel()])
    cells = np.array([[r * 4 + c, r * 4 + c + 1, r * 4 + c + 5, r * 4 + c + 4] for r in range(3) for c in range(3)])
    fixed = (points == 0).any(axis=1) | (points == 3).any(axis=1)
    points[5] = [1.7, 1.6]
    result = smoothed(points, cells, fixed)
    assert scaled_jacobians(points, cells).min() < 0.4
    assert scaled_jacobians(result, cells).min() > 0.7
    assert np.array_equal(result[fixed], points[fixed])


def test_smoothing_leaves_good_cells_alone():
    mesh = skfem.MeshQuad1().refined(2)
    fixed = np.zeros(mesh.p.shape[1], dtype=bool)
    assert np.array_equal(smoothed(mesh.p.T, mesh.t.T, fixed), mesh.p.T)
