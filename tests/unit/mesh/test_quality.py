"""The shape of cells in numbers, what is refused, and what is mended."""

import contextlib

import numpy as np
import pytest
import skfem
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from fingerslip.errors import MeshError
from fingerslip.mesh.gmsh_session import Fragments
from fingerslip.mesh.quality import check_quality, quality_table, tetrahedron_margins
from fingerslip.mesh.repair import repair_tetrahedra, scaled_jacobians, smooth


def quadrilateral(*corners):
    return skfem.MeshQuad1(np.array(corners, dtype=float).T, np.array([[0], [1], [2], [3]]))


def tetrahedron(*corners):
    return skfem.MeshTet1(np.array(corners, dtype=float).T.copy(), np.array([[0], [1], [2], [3]]))


HIGH = np.sqrt(3) / 2


@pytest.mark.parametrize(
    ("corners", "jacobian", "angles"),
    [
        ([(0, 0), (3, 0), (3, 1), (0, 1)], 1.0, (90, 90)),
        ([(0, 0), (1, 0), (1.5, HIGH), (0.5, HIGH)], HIGH, (60, 120)),
        ([(0, 0), (1, 0), (0.5, 0.5), (0, 1)], 0.0, None),
        ([(0, 0), (1, 0), (0.5, HIGH)], 1.0, (60, 60)),
    ],
    ids=["rectangle", "rhombus", "straight corner", "equilateral triangle"],
)
def test_cells_of_known_shape(corners, jacobian, angles):
    points, cells = np.array(corners, dtype=float), np.arange(len(corners))[None]
    triangle = len(corners) == 3
    mesh = (skfem.MeshTri1 if triangle else skfem.MeshQuad1)(points.T.copy(), cells.T)
    (row,) = quality_table(mesh)
    assert (row.region, row.cells, row.scaled_jacobian) == ("mesh", 1, pytest.approx(jacobian, abs=1e-15))
    assert scaled_jacobians(points, cells) == pytest.approx(HIGH if triangle else jacobian, abs=1e-15)
    assert angles is None or np.degrees([row.smallest_angle, row.largest_angle]) == pytest.approx(angles)


FOLDED = quadrilateral((0, 0), (1, 0), (0.2, 0.2), (0, 1))


def test_folded_corners_are_negative():
    (row,) = quality_table(FOLDED)
    assert row.scaled_jacobian < 0
    assert row.largest_angle > np.pi
    clockwise, collapsed = np.array([[0, 0], [0, 1], [1, 1], [1, 0]]), np.array([[0, 0], [0, 0], [1, 1], [0, 1]])
    assert scaled_jacobians(np.vstack([clockwise, collapsed]), np.arange(8).reshape(2, 4)).tolist() == [-1.0, 0.0]


SLIVER = tetrahedron((0, 0, 0), (1, 0, 0.03), (1, 1, 0), (0, 1, 0.03))


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
        (FOLDED, "mesh cell 0 at x = 300 mm, y = 300 mm: scaled Jacobian -"),
        (quadrilateral((0, 0), (12, 0), (12, 1), (0, 1)), "aspect ratio 12, needs < 10"),
        (SLIVER, "cell 0 at x = 500 mm, y = 500 mm, z = 15 mm: smallest angle in degrees"),
        *((good, None) for good in (triangle(60.0), triangle(16.0), kite(164.0))),
        (quadrilateral((0, 0), (9, 0), (9, 1), (0, 1)), None),
    ],
)
def test_every_limit_is_held(mesh, message):
    with pytest.raises(MeshError, match=message) if message else contextlib.nullcontext():
        check_quality(mesh)


def test_the_region_of_the_worst_cell_is_named():
    points = np.array([[0, 0], [1, 0], [13, 0], [0, 1], [1, 1], [13, 1]], dtype=float)
    mesh = skfem.MeshQuad1(points.T, np.array([[0, 1, 4, 3], [1, 2, 5, 4]]).T)
    mesh = mesh.with_subdomains({"low": np.array([0]), "long": np.array([1])})
    with pytest.raises(MeshError, match=r"^long cell 1 at x = 7000 mm, y = 500 mm: aspect ratio 12, needs < 10"):
        check_quality(mesh)
    low, long = quality_table(mesh)
    assert (low.region, low.aspect_ratio, long.aspect_ratio) == ("low", 1.0, 12.0)


def test_regular_tetrahedron_is_best_the_corner_of_a_cube_known_and_a_flat_one_beyond_the_limits():
    regular = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]
    (row,) = quality_table(tetrahedron(*regular))
    assert (row.scaled_jacobian, row.aspect_ratio) == (pytest.approx(1.0), pytest.approx(1.0))
    assert (row.smallest_angle, row.largest_angle) == (pytest.approx(np.arccos(1 / 3)), pytest.approx(np.arccos(1 / 3)))
    (row,) = quality_table(tetrahedron((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)))
    assert np.degrees([row.smallest_angle, row.largest_angle]) == pytest.approx([54.7356, 90.0], abs=1e-3)
    assert row.scaled_jacobian == pytest.approx(np.sqrt(2) * 0.5)
    flat = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    best, none = tetrahedron_margins(np.array([regular, flat], dtype=float))
    assert best > 5.0
    assert none == 0.0


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


REGION = np.zeros(9, dtype=int)


def patch():
    """Return nodes and cells of three by three unit squares of one region, and which nodes are on the border."""
    x, y = np.meshgrid(np.arange(4.0), np.arange(4.0))
    points = np.column_stack([x.ravel(), y.ravel()])
    cells = np.array([[r * 4 + c, r * 4 + c + 1, r * 4 + c + 5, r * 4 + c + 4] for r in range(3) for c in range(3)])
    return points, cells, (points == 0).any(axis=1) | (points == 3).any(axis=1)


def worst_at_nodes(points, cells):
    worst = np.ones(len(points))
    for cell, value in zip(cells, scaled_jacobians(points, cells), strict=True):
        worst[cell] = np.minimum(worst[cell], value)
    return worst


def test_smoothing_mends_a_bad_patch_and_leaves_the_border():
    points, cells, fixed = patch()
    assert np.array_equal(smooth(points, cells, REGION), points), "good cells stay"
    points[5] = [1.7, 1.6]
    before = points.copy()
    result = smooth(points, cells, REGION)
    assert np.array_equal(points, before)
    assert scaled_jacobians(points, cells).min() < 0.4
    assert scaled_jacobians(result, cells).min() > 0.7
    assert np.array_equal(result[fixed], points[fixed])


@given(moves=st.lists(st.floats(-0.6, 0.6), min_size=8, max_size=8))
def test_smoothing_makes_no_node_worse(moves):
    points, cells, fixed = patch()
    points[~fixed] += np.reshape(moves, (4, 2))
    result = smooth(points, cells, REGION)
    assert np.all(worst_at_nodes(result, cells) >= worst_at_nodes(points, cells) - 1e-15)
    assert np.array_equal(result[fixed], points[fixed])


NONE = np.empty((0, 3))


def cube(*more):
    """Return a cube of 1 mm, whose halves below and above z = 0.5 mm are two regions, with a few more nodes."""
    grid = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 3)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    points = np.vstack([grid, *more])
    # Delaunay's tetrahedra of a grid are not unique: a little noise chooses, and flat ones at the faces go.
    chosen = points + np.random.default_rng(0).normal(0.0, 1e-6, points.shape)
    cells = Delaunay(chosen).simplices.astype(np.int64)
    cells = cells[np.abs(np.linalg.det(points[cells][:, 1:] - points[cells][:, :1])) > 1e-4]
    region = (points[cells][..., 2].mean(axis=1) > 0.5).astype(np.int64)
    return Fragments(1e-3 * points, cells, region)


def volumes(fragments):
    corners = fragments.points[fragments.cells]
    return np.bincount(fragments.region, np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0)


def margins(fragments):
    return tetrahedron_margins(fragments.points[fragments.cells])


# Beside a node of the grid, in the upper half: edges fifty times shorter than the others.
NEAR = np.array([[0.5, 0.5, 0.51]])


def test_a_short_edge_becomes_a_node_and_no_region_loses_volume():
    poor = cube(NEAR)
    assert margins(poor).min() <= 1.0
    mended = repair_tetrahedra(poor, NONE)
    assert margins(mended).min() > 1.0
    assert len(mended.points) == len(poor.points) - 1
    assert volumes(mended) == pytest.approx(volumes(poor), rel=1e-9)


def test_nodes_that_are_to_stay_and_good_cells_do():
    mended = repair_tetrahedra(cube(NEAR), 1e-3 * NEAR)
    assert np.linalg.norm(mended.points - 1e-3 * NEAR, axis=1).min() == 0.0
    good = cube()
    same = repair_tetrahedra(good, NONE)
    assert np.array_equal(same.points, good.points)
    assert np.array_equal(same.cells, good.cells)
