"""Contact candidates: who may touch, their frames, areas and penalties."""

import numpy as np
import pytest

from fingerslip.contact.candidates import (
    Counterfaces,
    check_outsiders,
    find_candidates,
    join_candidates,
    node_operator,
)
from fingerslip.contact.counterfaces import Cylinder, Plane, tangent_lengths
from fingerslip.contact.friction import Anisotropic, Conditions, Coulomb
from fingerslip.contact.rows import nodes_along
from fingerslip.errors import InputError, SlipOutsideContactError

POSITIONS = np.array([[-2.0, 0.4], [-1.0, 0.1], [0.0, 0.0], [1.0, 0.1], [2.0, 0.4], [0.0, 3.0]])
AREAS = np.array([0.5, 1.0, 1.0, 1.0, 0.5, 0.0])


def find(plane=None, *, search_distance=0.2, nodes=range(5), areas=AREAS, counterface=0):
    return find_candidates(
        (plane or Plane()).at_start(POSITIONS[np.array(nodes)]),
        POSITIONS,
        np.array(nodes),
        areas,
        counterface=counterface,
        search_distance=search_distance,
        penalties=(100.0, 40.0),
        where="contacts.0",
    )


@pytest.mark.parametrize(
    ("search", "nodes"),
    [
        ({}, [1, 2, 3]),
        ({"search_distance": 1.0}, [0, 1, 2, 3, 4]),
        ({"plane": Plane(offset=-0.1)}, [1, 2, 3]),
        ({"plane": Plane(offset=-0.15)}, [2]),
        ({"areas": np.array([0.5, 1.0, 0.0, 1.0, 0.5, 0.0])}, [1, 3]),
    ],
)
def test_nodes_with_an_area_within_the_search_distance_are_candidates(search, nodes):
    candidates = find(**search)
    assert candidates.nodes.tolist() == nodes
    np.testing.assert_array_equal(candidates.positions, POSITIONS[nodes])
    np.testing.assert_allclose(candidates.normal_stiffness, 100.0 * AREAS[nodes])
    np.testing.assert_allclose(candidates.tangential_stiffness, 40.0 * AREAS[nodes])


@pytest.mark.parametrize(
    ("plane", "message"),
    [
        (Plane(offset=0.05),
         "contacts.0.offset: the counterface starts 50 mm inside the body, needs an offset <= 0 mm"),
        (Cylinder(1.0, centre=(0.0, -0.75)),
         "contacts.0.centre: the counterface starts 250 mm inside the body, needs a centre at least 250 mm further"),
        (Plane(offset=-1.0), "contacts.0: no node of the boundary is within 200 mm of the counterface"),
    ],
)  # fmt: skip
def test_counterfaces_inside_the_body_or_out_of_reach_are_refused(plane, message):
    with pytest.raises(InputError, match=message):
        find(plane)


def test_surfaces_give_gaps_frames_and_coefficients_body_by_body():
    surfaces = Counterfaces((Plane(normal=(-3.0, 4.0), offset=0.1), Plane(offset=-0.5)), (Coulomb(0.3), Coulomb(0.7)))
    points, counterface = np.array([[0.0, 1.0], [2.0, 1.0]]), np.array([0, 1])
    at_rest = Conditions(np.ones(2), np.zeros(2), np.zeros(2), 0.0)
    assert surfaces.are_flat
    np.testing.assert_allclose(surfaces.gaps(points, counterface), [0.7, 1.5])
    np.testing.assert_allclose(surfaces.frames(points, counterface)[0], [[-0.6, 0.8], [0.8, 0.6]])
    np.testing.assert_allclose(surfaces.normals(points, counterface), [[-0.6, 0.8], [0.0, 1.0]])
    np.testing.assert_allclose(surfaces.coefficients(at_rest, counterface), [0.3, 0.7])


@pytest.mark.parametrize(
    ("law", "frame"),
    [
        (Anisotropic(0.4, 0.8, (0.0, 1.0, 0.0)), [[0, 0, 1], [0, 1, 0], [-2, 0, 0]]),
        (Coulomb(0.4), [[0, 0, 1], [1, 0, 0], [0, 1, 0]]),
    ],
)
def test_anisotropic_friction_stretches_the_second_tangent_and_other_laws_take_the_counterfaces(law, frame):
    surfaces, counterface = Counterfaces((Plane(normal=(0.0, 0.0, 1.0), offset=0.0),), (law,)), np.zeros(1, dtype=int)
    frames = surfaces.frames(np.zeros((1, 3)), counterface)
    np.testing.assert_allclose(frames[0], frame, atol=1e-15)
    np.testing.assert_allclose(tangent_lengths(frames), [[1.0, law.frame.stretch]])
    at_rest = Conditions(np.ones(1), np.zeros(1), np.zeros(1), 0.0)
    np.testing.assert_array_equal(surfaces.coefficients(at_rest, counterface), 0.4)


def test_the_node_operator_picks_displacements_of_candidates_that_are_joined_in_order():
    displacement = np.random.default_rng(1).normal(size=POSITIONS.shape)
    picked = node_operator(np.array([4, 1]), 2, POSITIONS.size) @ displacement.ravel()
    np.testing.assert_array_equal(picked.reshape(-1, 2), displacement[[4, 1]])
    above = find(Plane(normal=(0.0, -1.0)), nodes=[5], areas=np.ones(6), counterface=1)
    joined = join_candidates([find(), above], 2)
    np.testing.assert_array_equal(joined.nodes, [1, 2, 3, 5])
    np.testing.assert_array_equal(joined.counterface, [0, 0, 0, 1])
    assert node_operator(join_candidates([], 2).nodes, 2, 12).shape == (0, 12)


def test_outsiders_that_touch_are_refused_with_their_position_and_a_remedy():
    search = {"shape": Plane(normal=(0.0, 1.0), offset=0.0), "number": 1, "searched": 0.3}
    message = (
        r"contacts.1.search_distance: at t = 0.25 s: node 4 at \(2000, 400\) mm .*, only nodes within 300 mm at the"
        r" start may .*; write a larger search_distance, such as 600 mm, or"
    )
    with pytest.raises(SlipOutsideContactError, match=message):
        check_outsiders(np.array([0.1, -1e-6]), np.array([0, 4]), POSITIONS[[0, 4]], 0.25, **search)
    check_outsiders(np.array([0.1, 0.0]), np.array([0, 4]), POSITIONS[[0, 4]], 0.25, **search)
    check_outsiders(np.zeros(0), np.zeros(0, dtype=int), np.zeros((0, 2)), 0.25, **search)


GRID = np.stack(np.meshgrid(np.linspace(0.0, 8.0, 17), 0.0, [0.0, 5.0]), axis=-1).reshape(-1, 3)
EVEN = np.stack(np.meshgrid(np.arange(20.0), 0.0, np.arange(20.0)), axis=-1).reshape(-1, 3)
UNEVEN = EVEN + np.random.default_rng(3).uniform(-0.25, 0.25, EVEN.shape) * [1.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("positions", "direction", "rows"),
    [
        (GRID, (1, 0, 0), (17, 17)),
        (GRID, (0, 0, 1), (1, 2)),
        (GRID[:, [2, 1, 0]], (0, 0, 1), (17, 17)),
        (GRID[(GRID[:, 0] < 2.1) | (GRID[:, 0] > 5.9)], (1, 0, 0), (10, 10)),  # between ridges nothing touches
        (UNEVEN, (1, 0, 0), (18, 24)),
        (UNEVEN, (0.6, 0, 0.8), (26, 34)),
        (GRID[:1], (1, 0, 0), (1, 1)),
        (GRID[:0], (1, 0, 0), (0, 0)),
    ],
)
def test_nodes_are_counted_along_the_slide(positions, direction, rows):
    assert rows[0] <= nodes_along(positions, np.array(direction, dtype=float)) <= rows[1]
