"""Constraint modes taken some at a time, and frequencies; all else is measured on the mesh in test_reduced.py."""

import numpy as np
import pytest
from scipy import linalg

from fingerslip.dynamics.system.system import build_system
from fingerslip.linear import craig_bampton
from fingerslip.linear.craig_bampton import ConstraintModes, constraint_modes, normal_modes, slow_motions
from problems.matrices import SOLVERS
from problems.pushed import push_and_slide

INTERFACE, ROWS = np.array([0, 3, 4, 20, 41]), np.array([1, 2, 10])


@pytest.fixture(scope="module", params=SOLVERS)
def body(request):
    system = build_system(push_and_slide())
    return ConstraintModes(system.stiffness, system.mass, INTERFACE, request.param)


def inner(body):
    return np.setdiff1d(np.arange(body.stiffness.shape[0]), body.interface)


@pytest.mark.parametrize("columns_at_once", [2, 64])
def test_mass_of_constraint_modes_is_gathered_some_columns_at_a_time(body, columns_at_once, monkeypatch):
    others, stiffness = inner(body), body.stiffness.toarray()
    modes = np.zeros((len(stiffness), INTERFACE.size))
    modes[INTERFACE] = np.eye(INTERFACE.size)
    modes[others] = -np.linalg.solve(stiffness[np.ix_(others, others)], stiffness[np.ix_(others, INTERFACE)])
    monkeypatch.setattr(craig_bampton, "_COLUMNS_AT_ONCE", columns_at_once)
    mass, at_rows = constraint_modes(body, ROWS)
    np.testing.assert_allclose(mass, modes.T @ body.mass @ modes, atol=1e-12 * mass.max())
    np.testing.assert_allclose(at_rows, modes[ROWS], atol=1e-12)


def test_slow_normal_modes_have_the_frequencies_of_the_body_whose_interface_is_held(body):
    found = normal_modes(body, slow_motions(body, constraint_modes(body, ROWS)[0], 3), 24)
    stiffness, mass = (matrix.toarray()[np.ix_(inner(body), inner(body))] for matrix in (body.stiffness, body.mass))
    exact = np.sqrt(linalg.eigh(stiffness, mass, eigvals_only=True)[:4])
    np.testing.assert_allclose(found.frequencies[:4], exact, rtol=1e-6)
    np.testing.assert_allclose(found.shapes.T @ (body.mass @ found.shapes), np.eye(24), atol=1e-10)
    np.testing.assert_array_equal(found.shapes[INTERFACE], 0.0)
