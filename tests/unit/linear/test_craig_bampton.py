"""Constraint modes are exact, normal modes are those with the interface held, and the coordinates are diagonal."""

import numpy as np
import pytest
from scipy import linalg, sparse

from fingerslip.dynamics.system.system import build_system
from fingerslip.linear.craig_bampton import (
    ConstraintModes,
    NormalModes,
    constraint_modes,
    craig_bampton,
    normal_modes,
    slow_motions,
)
from problems.matrices import SOLVERS
from problems.pushed import push_and_slide

INTERFACE, ROWS = np.array([0, 3, 4, 20, 41]), np.array([1, 2, 10])


@pytest.fixture(scope="module", params=SOLVERS)
def body(request):
    system = build_system(push_and_slide())
    return ConstraintModes(system.stiffness, system.mass, INTERFACE, request.param)


def inner(body):
    return np.setdiff1d(np.arange(body.stiffness.shape[0]), body.interface)


def dense_responses(body):
    """Return T by dense algebra."""
    others, stiffness = inner(body), body.stiffness.toarray()
    found = np.zeros((len(stiffness), INTERFACE.size))
    found[INTERFACE] = np.eye(INTERFACE.size)
    found[others] = -np.linalg.solve(stiffness[np.ix_(others, others)], stiffness[np.ix_(others, INTERFACE)])
    return found


def all_normal_modes(body):
    """Return every vibration, which Lanczos's method cannot find."""
    others = inner(body)
    stiffness, mass = (matrix.toarray()[np.ix_(others, others)] for matrix in (body.stiffness, body.mass))
    squares, vectors = linalg.eigh(stiffness, mass)
    shapes = np.zeros((body.stiffness.shape[0], others.size))
    shapes[others] = vectors
    return NormalModes(np.sqrt(squares), shapes, shapes[:, :0])


def test_the_inside_follows_the_interface_statically_and_gives_way_to_forces_while_that_is_held(body):
    exact, count = dense_responses(body), body.mass.shape[0]
    np.testing.assert_allclose(body.follow(np.eye(INTERFACE.size)), exact, atol=1e-12)
    forces = np.random.default_rng(1).normal(size=(count, 2))
    np.testing.assert_allclose(body.gather(forces), exact.T @ forces, atol=1e-11)
    np.testing.assert_allclose(body.schur, exact.T @ body.stiffness @ exact, atol=1e-9 * np.abs(body.schur).max())
    moved, others = body.give_way(forces[:, 0]), inner(body)
    np.testing.assert_array_equal(moved[INTERFACE], 0.0)
    np.testing.assert_allclose((body.stiffness @ moved)[others], forces[others, 0], atol=1e-10)
    none = np.zeros((count, 0))
    assert body.give_way(none).shape == none.shape
    assert body.gather(none).shape == (INTERFACE.size, 0)


@pytest.mark.parametrize("columns_at_once", [2, 64])
def test_mass_of_constraint_modes_is_gathered_some_columns_at_a_time(body, columns_at_once):
    exact = dense_responses(body)
    mass, at_rows = constraint_modes(body, ROWS, columns_at_once=columns_at_once)
    np.testing.assert_allclose(mass, exact.T @ body.mass @ exact, atol=1e-12 * mass.max())
    np.testing.assert_allclose(at_rows, exact[ROWS], atol=1e-12)


def excited(body, count, following=0):
    """Return normal modes that the slow motions of a body excite."""
    return normal_modes(body, slow_motions(body, constraint_modes(body, ROWS)[0], 3), count, following)


def test_slow_motions_follow_the_interface(body):
    mass, _ = constraint_modes(body, ROWS)
    squares, vectors = linalg.eigh(body.schur, mass)
    found = slow_motions(body, mass, 3)
    np.testing.assert_allclose(found, body.follow(found[INTERFACE]), atol=1e-9 * np.abs(found).max())
    np.testing.assert_allclose(np.abs(found[INTERFACE]), np.abs(vectors[:, :3]), rtol=1e-6)
    np.testing.assert_allclose(found.T @ body.stiffness @ found, np.diag(squares[:3]), atol=1e-9 * squares[2])
    assert slow_motions(body, mass, 100).shape[1] == INTERFACE.size


def test_slow_normal_modes_are_as_they_are_and_fast_ones_about_so(body):
    """The first ones hold what the inertia of slow motions does, and there are no more of them than there are."""
    found, every = excited(body, 24), all_normal_modes(body)
    np.testing.assert_allclose(found.frequencies[:4], every.frequencies[:4], rtol=1e-6)
    assert (np.diff(found.frequencies) > 0.0).all()
    np.testing.assert_allclose(found.shapes.T @ (body.mass @ found.shapes), np.eye(24), atol=1e-10)
    stiffness = found.shapes.T @ (body.stiffness @ found.shapes)
    np.testing.assert_allclose(stiffness, np.diag(found.frequencies**2), atol=1e-9 * found.frequencies[-1] ** 2)
    np.testing.assert_array_equal(found.shapes[INTERFACE], 0.0)
    moved = slow_motions(body, constraint_modes(body, ROWS)[0], 3)
    correction, few = body.give_way(body.mass @ moved), excited(body, 3)
    left = correction - few.shapes @ (few.shapes.T @ (body.mass @ correction))
    assert np.abs(left).max() < 1e-9 * np.abs(correction).max()
    assert excited(body, 10 * inner(body).size).frequencies.size <= inner(body).size
    assert normal_modes(body, np.zeros((body.mass.shape[0], 2)), 5).frequencies.size == 0


def test_stiffness_and_mass_are_diagonal_in_the_coordinates(body):
    basis = craig_bampton(body, constraint_modes(body, ROWS), excited(body, 6), ROWS)
    field = basis.field(body, np.eye(basis.eigenvalues.size))
    assert field.shape == (body.mass.shape[0], 11)
    np.testing.assert_allclose(field.T @ body.mass @ field, np.eye(11), atol=1e-10)
    stiffness = field.T @ body.stiffness @ field
    np.testing.assert_allclose(stiffness, np.diag(basis.eigenvalues), atol=1e-9 * basis.eigenvalues.max())
    np.testing.assert_allclose(basis.at_interface, field[INTERFACE], atol=1e-9)
    np.testing.assert_allclose(basis.at_rows, field[ROWS], atol=1e-9)
    forces = np.random.default_rng(3).normal(size=body.mass.shape[0])
    np.testing.assert_allclose(basis.project(body, forces), field.T @ forces, atol=1e-9 * np.abs(field).max())


def test_responses_to_forces_on_the_interface_and_of_further_shapes_are_exact(body):
    """The former without any normal mode; what adds nothing is left out."""

    def answers(basis, force):
        exact = np.linalg.solve(body.stiffness.toarray(), force)
        found = basis.field(body, basis.project(body, force) / basis.eigenvalues)
        np.testing.assert_allclose(found, exact, atol=1e-9 * np.abs(exact).max())

    force, load = np.zeros(body.mass.shape[0]), np.random.default_rng(5).normal(size=body.mass.shape[0])
    force[INTERFACE] = [1.0, -2.0, 0.5, 3.0, 1.0]
    answers(craig_bampton(body, constraint_modes(body, ROWS), excited(body, 0), ROWS), force)
    response, few = body.give_way(load), excited(body, 3)
    basis = craig_bampton(body, constraint_modes(body, ROWS), few, ROWS, [response, 2.0 * response, few.shapes[:, 0]])
    assert basis.eigenvalues.size == INTERFACE.size + 3 + 1
    answers(basis, load)
    whole = craig_bampton(body, constraint_modes(body, ROWS), all_normal_modes(body), ROWS)
    exact = linalg.eigh(body.stiffness.toarray(), body.mass.toarray(), eigvals_only=True)
    np.testing.assert_allclose(whole.eigenvalues, exact, rtol=1e-8, err_msg="all normal modes are the whole body")


def test_what_follows_is_beside_the_basis_and_known_with_it(body):
    basis = craig_bampton(body, constraint_modes(body, ROWS), excited(body, 6, following=5), ROWS)
    field, following = basis.field(body, np.eye(basis.eigenvalues.size)), basis.following
    assert following.shape[1] == 5
    np.testing.assert_allclose(following.T @ body.mass @ following, np.eye(5), atol=1e-10)
    np.testing.assert_allclose(basis.shapes.T @ body.mass @ following, 0.0, atol=1e-10)
    squares = basis.following_squares
    np.testing.assert_allclose(following.T @ body.stiffness @ following, np.diag(squares), atol=1e-9 * squares.max())
    np.testing.assert_allclose(basis.following_mass, following.T @ body.mass @ field, atol=1e-10)
    stiffness = following.T @ body.stiffness @ field
    np.testing.assert_allclose(basis.following_stiffness, stiffness, atol=1e-9 * np.abs(stiffness).max())
    np.testing.assert_allclose(excited(body, 6, following=5).shapes, excited(body, 6).shapes, rtol=1e-9, atol=1e-9)


def test_an_unknown_without_stiffness_is_part_of_the_interface(body):
    """A driven counterface has mass alone."""
    stiffness = sparse.block_diag([body.stiffness, [[0.0]]], format="csr")
    mass = sparse.block_diag([body.mass, [[4.0]]], format="csr")
    driven = ConstraintModes(stiffness, mass, np.append(INTERFACE, body.mass.shape[0]), body.solver)
    assert driven.schur[-1, -1] == pytest.approx(0.0, abs=1e-12)
    basis = craig_bampton(driven, constraint_modes(driven, ROWS), excited(driven, 2), ROWS)
    assert basis.eigenvalues[0] == pytest.approx(0.0, abs=1e-6 * basis.eigenvalues[1])
    np.testing.assert_allclose(np.abs(basis.at_interface[-1, 0]), 0.5, rtol=1e-9)
