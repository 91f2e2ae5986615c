"""Contact candidates: who may touch, their frames, areas and penalties."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.contact.bodies import Plane
from fingerslip.contact.candidates import automatic_penalty, check_outsiders, find_candidates, join_candidates
from fingerslip.errors import InputError, SlipOutsideContactError

POSITIONS = np.array([[-2.0, 0.4], [-1.0, 0.1], [0.0, 0.0], [1.0, 0.1], [2.0, 0.4], [0.0, 3.0]])
AREAS = np.array([0.5, 1.0, 1.0, 1.0, 0.5, 0.0])


def find(plane=None, *, reach=0.2, nodes=range(5), areas=AREAS, body=0):
    return find_candidates(
        plane or Plane(),
        POSITIONS,
        np.array(nodes),
        areas,
        body=body,
        reach=reach,
        friction_coefficient=0.6,
        penalties=(100.0, 40.0),
        where="contacts.0",
    )


def test_a_plane_without_offset_touches_and_reaches_the_near_nodes():
    found = find()
    np.testing.assert_array_equal(found.nodes, [1, 2, 3])
    np.testing.assert_allclose(found.gap, [0.1, 0.0, 0.1])
    np.testing.assert_allclose(found.normal_stiffness, [100.0] * 3)
    np.testing.assert_allclose(found.tangential_stiffness, [40.0] * 3)
    np.testing.assert_allclose(found.friction_coefficient, 0.6)
    assert len(find(reach=1.0).nodes) == 5


def test_a_given_offset_is_a_gap_from_the_start():
    np.testing.assert_allclose(find(Plane(offset=-0.1)).gap, [0.2, 0.1, 0.2])


def test_nodes_without_area_are_no_candidates():
    areas = AREAS.copy()
    areas[2] = 0.0
    np.testing.assert_array_equal(find(areas=areas).nodes, [1, 3])


def test_a_plate_inside_the_body_is_refused():
    with pytest.raises(InputError, match=r"contacts.0.offset: the plate starts 50 mm inside the body, needs an offset"):
        find(Plane(offset=0.05))


def test_a_plate_out_of_reach_is_refused():
    with pytest.raises(InputError, match=r"contacts.0: no node of the boundary is within 200 mm of the plate"):
        find(Plane(offset=-1.0))


def test_frames_are_normal_and_tangent_and_right_for_an_inclined_plane():
    found = find(Plane(normal=(-3.0, 4.0)), reach=10.0)
    np.testing.assert_allclose(found.frames[0], [[-0.6, 0.8], [0.8, 0.6]])
    for frame in found.frames:
        np.testing.assert_allclose(frame @ frame.T, np.eye(2), atol=1e-15)


def test_the_local_operator_turns_displacements_into_the_frame():
    found = find(Plane(normal=(-3.0, 4.0)), reach=10.0)
    displacement = np.random.default_rng(1).normal(size=POSITIONS.shape)
    local = (found.local_operator(POSITIONS.size) @ displacement.ravel()).reshape(-1, 2)
    np.testing.assert_allclose(local[:, 0], displacement[found.nodes] @ [-0.6, 0.8])
    np.testing.assert_allclose(local[:, 1], displacement[found.nodes] @ [0.8, 0.6])


def test_joining_keeps_order_and_bodies():
    joined = join_candidates([find(body=0), find(Plane(normal=(0.0, -1.0)), nodes=[5], areas=np.ones(6), body=1)], 2)
    np.testing.assert_array_equal(joined.nodes, [1, 2, 3, 5])
    np.testing.assert_array_equal(joined.body, [0, 0, 0, 1])
    none = join_candidates([], 2)
    assert none.local_operator(12).shape == (0, 12)


def test_three_components_are_refused_in_2d():
    with pytest.raises(InputError, match=r"contact is two-dimensional so far"):
        find_candidates(
            Plane(normal=(0.0, 0.0, 1.0)),
            np.zeros((1, 3)),
            np.array([0]),
            np.ones(1),
            body=0,
            reach=1.0,
            friction_coefficient=0.0,
            penalties=(1.0, 1.0),
            where="contacts.0",
        )


def test_outsiders_that_touch_are_refused_with_place_and_way_out():
    with pytest.raises(SlipOutsideContactError, match=r"0.25 s: node 4 at \(2000, 400\) mm .* larger contact reach"):
        check_outsiders(np.array([0.1, -1e-6]), np.array([0, 4]), POSITIONS, 0.25)
    check_outsiders(np.array([0.1, 0.0]), np.array([0, 4]), POSITIONS, 0.25)
    check_outsiders(np.zeros(0), np.zeros(0, dtype=int), POSITIONS, 0.25)


def test_the_automatic_penalty_is_ten_times_the_stiffness_of_a_row_of_cells():
    assert automatic_penalty(136e3, 0.15e-3) == pytest.approx(10 * 136e3 / 0.15e-3)
