"""Maps from the unknowns to displacements of nodes relative to their counterfaces on free rigid bodies."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.system.bodies import rigid_freedoms
from fingerslip.dynamics.system.operators import NodalComponents, Unknowns, relative_operator, rotations_of
from fingerslip.fe.space import build_space
from problems.held import held
from problems.pushed import pad
from unit.dynamics.bodies import driven

SPACE = build_space(pad("Q4"))
NORMAL = (0.6, -0.8)


def test_values_on_the_mesh_are_restricted_to_free_degrees_of_freedom_and_end_with_zeros_for_bodies():
    unknowns = Unknowns(np.array([0, 3, 4]), (driven(1),))
    np.testing.assert_array_equal(unknowns.restrict(10.0 * np.arange(6.0)), [0.0, 30.0, 40.0, 0.0])


def test_nodes_move_relative_to_the_counterface_that_a_force_drives_along_its_normal():
    free = np.setdiff1d(np.arange(SPACE.n_dofs), [10, 11])
    unknowns = Unknowns(free, (driven(1, NORMAL),))
    values = np.random.default_rng(0).normal(size=free.size + 1)
    nodal = np.zeros(SPACE.n_dofs)
    nodal[free] = values[:-1]
    nodes, counterface = np.array([5, 7, 9]), np.array([0, 0, 1])
    moved = relative_operator(SPACE, unknowns, nodes, counterface) @ values
    expected = nodal.reshape(-1, 2)[nodes]
    expected[2] -= values[-1] * np.array(NORMAL)
    np.testing.assert_allclose(moved.reshape(-1, 2), expected, rtol=1e-15)
    assert not expected[0].any(), "node 5 is held"


def test_no_nodes_make_an_empty_map():
    unknowns = Unknowns(np.arange(SPACE.n_dofs))
    none = np.zeros(0, dtype=int)
    assert relative_operator(SPACE, unknowns, none, none).shape == (0, SPACE.n_dofs)


def test_components_of_nodes_are_taken_from_the_unknowns_and_held_ones_are_zero():
    unknowns = Unknowns(np.array([0, 2, 3, 5]), (driven(0),))
    components = NodalComponents.of(unknowns, 6, np.array([4, 5, 0, 1]))
    field = np.array([10.0, 12.0, 13.0, 15.0, 99.0])
    assert components.read(field).tolist() == [0.0, 15.0, 10.0, 0.0]
    taken = np.array([0, 2, 3])
    assert components.among(taken).read(np.stack([field, 2.0 * field])[:, taken]).tolist() == [
        [0.0, 15.0, 10.0, 0.0],
        [0.0, 30.0, 20.0, 0.0],
    ]


@pytest.mark.parametrize("element", ["Q4", "H8"])
def test_arms_are_how_far_a_turn_of_the_body_moves_the_nodes_that_it_sees(element):
    """Of a body that has turned by 1 rad; on one that does not turn nodes stay where they are."""
    dim = 2 if element == "Q4" else 3
    about = "rz" if dim == 2 else "ry"
    body = fs.RigidBody(1.0, free=("x", about), centre=(0.3, 0.2, 0.1)[:dim], inertia=(1.0,) * (1 if dim == 2 else 3))
    model = held(element, body=body)
    rotations = rotations_of(rigid_freedoms(model), np.array([7, 8]), 3)
    points, counterface = np.random.default_rng(0).normal(size=(4, dim)), np.array([0, 1, 2, 0])
    start, after = (rotations.pose(np.array([angle]), points, counterface) for angle in (1.0, 1.0 + 1e-6))
    moved = np.einsum("cij,cj->ci", start.turned, after.points - start.points) / 1e-6
    assert rotations.at.tolist() == [8]
    np.testing.assert_allclose(start.columns[:, 0].reshape(-1, dim), moved, atol=1e-5)
    np.testing.assert_array_equal(start.points[2], points[2])
