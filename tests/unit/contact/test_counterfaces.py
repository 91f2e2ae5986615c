"""Rigid counterfaces: their distance from points, their normals, where they just touch, and frames on them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.contact.counterfaces import (
    Cylinder,
    Plane,
    Sphere,
    contact_frames,
    rotate_compliance,
    sliding_direction,
)
from fingerslip.errors import InputError

directions = st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0)).filter(lambda n: np.hypot(*n) > 1e-3)
ROUND = [
    Sphere(0.5, (0.0, 0.0, 1.0)),
    Sphere(0.5, (0.0, 1.0)),
    Cylinder(0.5, (0.0, -1.0)),
    Cylinder(0.5, (0.0, 0.0, 1.0), axis=(1.0, 1.0, 0.0)),
]


def test_gap_is_the_signed_distance_along_the_normal():
    plane = Plane(normal=(3.0, 4.0), offset=2.0)
    assert plane.gap(np.array([[3.0, 4.0]]))[0] == pytest.approx(3.0)
    assert Plane(normal=(3.0, 4.0)).at_start(np.array([[3.0, 4.0], [0.0, 0.0]])).offset == 0.0
    assert plane.at_start(np.zeros((1, 2))) is plane
    np.testing.assert_allclose(Plane(normal=(2.0, 3.0, 6.0)).unit_normal, np.array([2.0, 3.0, 6.0]) / 7.0)
    cylinder = Cylinder(0.5, (0.0, 0.0, 1.0), centre=(0.0, 0.0, 0.0), axis=(2.0, 0.0, 0.0))
    np.testing.assert_allclose(cylinder.gap(np.array([[7.0, 3.0, 4.0], [-2.0, 3.0, 4.0]])), 4.5)


@given(normal=directions, length=st.floats(0.1, 10.0))
def test_the_direction_of_a_plane_knows_no_length(normal, length):
    longer = Plane(normal=(length * normal[0], length * normal[1]))
    np.testing.assert_allclose(longer.unit_normal, Plane(normal=normal).unit_normal, atol=1e-12)


@given(normal=directions, travel=st.floats(-2.0, 2.0), aside=st.floats(-2.0, 2.0))
def test_a_point_that_moves_along_the_plane_keeps_its_gap(normal, travel, aside):
    plane, point = Plane(normal=normal, offset=0.1), np.array([0.3, -0.7])
    moved = point + travel * plane.unit_normal + aside * plane.unit_normal[::-1] * [1.0, -1.0]
    before, after = plane.gap(np.array([point, moved]))
    assert after - before == pytest.approx(travel, abs=1e-12)


@given(normal=directions)
def test_at_the_touching_offset_the_nearest_point_has_no_gap(normal):
    points = np.random.default_rng(0).normal(size=(20, 2))
    gaps = Plane(normal=normal).at_start(points).gap(points)
    assert gaps.min() == pytest.approx(0.0, abs=1e-12)
    assert (gaps > 1e-9).sum() == 19


@pytest.mark.parametrize("counterface", ROUND)
def test_a_round_body_is_placed_where_it_just_touches_and_presses(counterface):
    points = np.random.default_rng(2).uniform(-1.0, 1.0, size=(200, counterface.dim)) * 0.2
    placed = counterface.at_start(points)
    assert placed.gap(points).min() == pytest.approx(0.0, abs=1e-12)
    assert (np.asarray(placed.centre) - points.mean(axis=0)) @ counterface.unit_normal < 0.0, "it is behind its surface"
    ahead = placed.gap(points - 0.01 * counterface.unit_normal)
    assert ahead.min() < 0.0, "points that come against its direction go in"


@pytest.mark.parametrize("counterface", ROUND)
def test_normals_are_unit_and_the_slope_of_the_gap(counterface):
    placed = counterface.at_start(np.full((1, counterface.dim), 0.3))
    points = np.asarray(placed.centre) + np.random.default_rng(1).normal(size=(20, counterface.dim))
    normals = placed.normals(points)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=1e-12)
    for axis, step in enumerate(1e-6 * np.eye(counterface.dim)):
        slope = (placed.gap(points + step) - placed.gap(points - step)) / 2e-6
        np.testing.assert_allclose(slope, normals[:, axis], atol=1e-8)


BETWEEN = "radius: got 0.4 mm, needs more than the 0.5 mm to the nearest node"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        *((lambda n=n: Plane(normal=n), "normal: got .*, needs two or three components, not all zero")
          for n in ((0.0, 0.0), (1.0,), (0.0, 0.0, 0.0, 1.0))),
        (lambda: Cylinder(1.0, (1.0, 1.0), axis=(1.0, 0.0, 0.0)), "axis"),
        (lambda: Cylinder(1.0, (0.0, 1.0), centre=(0.0, 0.0, 0.0)), "centre"),
        *((lambda a=a: Cylinder(1.0, (0.0, 0.0, 1.0), axis=a), "axis") for a in (None, (0.0, 0.0, 1.0), (1.0, 0.0))),
        (lambda: Cylinder(0.4e-3, (0.0, 1.0)).at_start(np.array([[0.0, 0.0], [1e-3, 0.0]])), BETWEEN),
        (lambda: Sphere(0.4e-3, (0.0, 0.0, 1.0)).at_start(np.array([[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0]])), BETWEEN),
    ],
)  # fmt: skip
def test_shapes_that_cannot_be_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


@pytest.mark.parametrize("dim", [2, 3])
def test_frames_are_orthonormal_with_the_normal_first(dim):
    """Also where the surface lies across the wanted direction."""
    normals = np.vstack([np.eye(dim)[:1], unit(np.random.default_rng(0).normal(size=(50, dim)))])
    frames = contact_frames(normals, np.eye(dim)[0])
    np.testing.assert_array_equal(frames[:, 0], normals)
    np.testing.assert_allclose(frames @ frames.transpose(0, 2, 1), np.tile(np.eye(dim), (51, 1, 1)), atol=1e-12)
    assert np.isfinite(sliding_direction(np.eye(dim)[0])).all()


@pytest.mark.parametrize(
    ("normal", "direction", "frame"),
    [
        ([0.0, 1.0], [0.0, 0.0], [[0, 1], [1, 0]]),
        ([0.0, -1.0], [0.0, 0.0], [[0, -1], [-1, 0]]),
        ([0.0, 0.0, 1.0], [1.0, 0.0, 5.0], [[0, 0, 1], [1, 0, 0], [0, 1, 0]]),
    ],
)
def test_a_plate_below_slides_along_x(normal, direction, frame):
    np.testing.assert_allclose(contact_frames(np.array([normal]), np.array(direction))[0], frame, atol=1e-15)
    np.testing.assert_array_equal(sliding_direction(np.abs(normal)), np.eye(len(normal))[0])


@pytest.mark.parametrize("dim", [2, 3])
def test_a_rotated_compliance_gives_the_same_energy(dim):
    rng = np.random.default_rng(4)
    root = rng.normal(size=(4 * dim, 4 * dim))
    compliance = root @ root.T
    frames = contact_frames(unit(rng.normal(size=(4, dim))), np.eye(dim)[0])
    local = rng.normal(size=(4, dim))
    spread = np.einsum("cij,ci->cj", frames, local).ravel()
    turned = rotate_compliance(compliance, frames)
    assert local.ravel() @ turned @ local.ravel() == pytest.approx(spread @ compliance @ spread, rel=1e-12)


def test_a_cylinder_in_3d_presses_along_y_by_default():
    assert Cylinder(1.0, axis=(0.0, 0.0, 1.0)) == Cylinder(1.0, (0.0, 1.0, 0.0), axis=(0.0, 0.0, 1.0))
