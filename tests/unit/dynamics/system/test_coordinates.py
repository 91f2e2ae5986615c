"""On the mesh, coordinates are the unknowns themselves."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from fingerslip.dynamics.system.coordinates import MeshCoordinates
from fingerslip.dynamics.system.operators import Unknowns
from fingerslip.linear.solvers.superlu import SuperLU
from problems.matrices import positive_definite
from unit.dynamics.bodies import driven

COORDINATES = MeshCoordinates(Unknowns(np.array([0, 1, 3, 5]), (driven(1),)), 6)
FIELD = np.array([1.0, 2.0, 3.0, 4.0, 9.0])


def test_rigid_bodies_stand_at_the_end():
    assert COORDINATES.rigid.tolist() == [4]


def test_fields_on_the_mesh_are_zero_where_it_is_held():
    assert COORDINATES.on_mesh(FIELD).tolist() == [1.0, 2.0, 0.0, 3.0, 0.0, 4.0]


def test_maps_take_what_they_do_not_ignore():
    matrix = sparse.csr_matrix([[0.0, 1.0, 5.0, 0.0, 0.0, 2.0]])
    components, taken = COORDINATES.apply_map(matrix)
    np.testing.assert_allclose(taken @ components.read(FIELD), matrix @ COORDINATES.on_mesh(FIELD))


def test_matrices_are_factorised_and_condensed():
    matrix, right = positive_definite(8), np.arange(8.0)
    factor = COORDINATES.factorise(matrix, SuperLU())
    np.testing.assert_allclose(matrix @ factor.backward(factor.forward(right)), right, atol=1e-12)
    _, compliance = COORDINATES.condense(matrix, sparse.csr_matrix(np.eye(8)[:2]), SuperLU(), 0)
    np.testing.assert_allclose(compliance, np.linalg.inv(matrix.toarray())[:2, :2], atol=1e-12)
