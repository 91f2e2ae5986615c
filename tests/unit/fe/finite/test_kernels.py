"""Compiled loops: principal directions, forces and stiffness by independent formulas."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.fe.finite.kernels import (
    LANES,
    ROWS,
    diagonalise,
    nodal_forces,
    nodal_forces_2d,
    stiffness_of_cells,
    strains,
    strains_2d,
    volume_slopes,
)


def one_cell(dim, gradient):
    """Return what loops take for one point of a simplex with unit edges that has a displacement gradient."""
    slopes = np.vstack([-np.ones(dim), np.eye(dim)])[None, None]
    nodes = np.arange(dim + 1)[None]
    places = np.vstack([np.zeros(dim), np.eye(dim)])
    return slopes, nodes, places @ np.asarray(gradient).T


def found(dim, gradient):
    empty = np.empty((1, dim, dim)), np.empty((1, dim)), np.empty((1, dim, dim))
    compiled = strains_2d if dim == 2 else strains
    worst = compiled(*one_cell(dim, gradient), *empty)
    return worst, [own[0] for own in empty]


GRADIENTS = {
    "zero": np.zeros((3, 3)),
    "random": np.random.default_rng(1).uniform(-0.4, 0.4, (3, 3)),
    "alike": np.diag([0.2, 0.2, 0.2]),
    "two alike": np.diag([0.2, 0.2, -0.1]),
    "nearly alike": np.array([[0.2, 1e-9, 0.0], [0.0, 0.2, 0.0], [0.0, 1e-12, 0.2 + 1e-10]]),
    "turned": np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, 0.0]]),
    "tiny": 1e-9 * np.random.default_rng(2).uniform(-1, 1, (3, 3)),
    "far": np.array([[20.0, 3.0, 1.0], [0.0, -0.9, 0.2], [0.0, 0.0, 2.0]]),
}


@pytest.mark.parametrize("name", GRADIENTS)
@pytest.mark.parametrize("dim", [2, 3])
def test_squares_of_the_stretches_and_directions_make_the_metric(name, dim):
    gradient = GRADIENTS[name][:dim, :dim]
    worst, (deformation, squared, directions) = found(dim, gradient)
    assert worst == -1
    np.testing.assert_allclose(deformation, np.eye(dim) + gradient, atol=1e-15)
    metric = deformation.T @ deformation
    np.testing.assert_allclose(directions.T @ directions, np.eye(dim), atol=1e-14)
    np.testing.assert_allclose(directions @ np.diag(squared) @ directions.T, metric, atol=1e-14 * np.abs(metric).max())


@pytest.mark.parametrize("name", GRADIENTS)
def test_plane_and_space_agree(name):
    gradient = np.zeros((3, 3))
    gradient[:2, :2] = GRADIENTS[name][:2, :2]
    _, (_, in_plane, _) = found(2, gradient[:2, :2])
    _, (_, with_across, _) = found(3, gradient)
    np.testing.assert_allclose(np.sort([*in_plane, 1.0]), np.sort(with_across), rtol=1e-14)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("bad", [-1.5, -1.0, np.nan])
def test_what_is_inside_out_flat_or_no_number_is_found(dim, bad):
    gradient = np.zeros((dim, dim))
    gradient[0, 0] = bad
    assert found(dim, gradient)[0] == 0


def first_piola(deformation, stress):
    """Return P = F sum_i tau_i / lambda_i^2 N_i N_i^T of a law with given principal stresses."""
    values, vectors = np.linalg.eigh(deformation.T @ deformation)
    return deformation @ vectors @ np.diag(stress(np.sqrt(values)) / values) @ vectors.T


def kirchhoff(stretches):
    """Return the Kirchhoff stresses of an isotropic law without coupling, tau_i = lambda_i^3 - 1."""
    return stretches**3 - 1.0


@pytest.mark.parametrize("name", ["random", "alike", "two alike", "nearly alike", "turned"])
@pytest.mark.parametrize("dim", [2, 3])
def test_forces_and_stiffness_are_those_of_the_stress(name, dim):
    """Also where stretches are alike, where the quotient of differences has no digits."""
    gradient = GRADIENTS[name][:dim, :dim]
    slopes, nodes, _ = one_cell(dim, gradient)
    _, (deformation, squared, directions) = found(dim, gradient)
    stretches = np.sqrt(squared)
    state = deformation[None], squared[None], directions[None], kirchhoff(stretches)[None]
    forces = np.zeros((dim + 1, dim))
    compiled = nodal_forces_2d if dim == 2 else nodal_forces
    compiled(slopes, nodes, np.array([2.0]), *state, forces)
    np.testing.assert_allclose(forces, 2.0 * slopes[0, 0] @ first_piola(deformation, kirchhoff).T, atol=1e-12)
    matrices = np.empty((1, forces.size, forces.size))
    tangent = np.diag(3.0 * stretches**3)[None]
    stiffness_of_cells(slopes, np.array([2.0]), *state, tangent, False, matrices)
    step, expected = 1e-6, np.empty_like(matrices[0])
    for column in range(forces.size):
        change = step * np.eye(forces.size)[column].reshape(forces.shape)
        parts = [first_piola(deformation + sign * change.T @ slopes[0, 0], kirchhoff) for sign in (1, -1)]
        expected[:, column] = (2.0 * slopes[0, 0] @ (parts[0] - parts[1]).T / (2 * step)).ravel()
    np.testing.assert_allclose(matrices[0], expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("dim", [2, 3])
def test_slopes_of_the_volume_are_its_derivative(dim):
    gradient = GRADIENTS["random"][:dim, :dim]
    slopes, _, _ = one_cell(dim, gradient)
    _, (deformation, squared, directions) = found(dim, gradient)
    of_volume = np.empty((1, dim + 1, dim))
    volume_slopes(slopes, deformation[None], squared[None], directions[None], of_volume)
    step = 1e-6
    for node in range(dim + 1):
        for axis in range(dim):
            change = step * np.outer(np.eye(dim)[axis], slopes[0, 0, node])
            ahead, back = (np.linalg.det(deformation + sign * change) for sign in (1, -1))
            assert of_volume[0, node, axis] == pytest.approx((ahead - back) / (2 * step), abs=1e-8)


def tensors():
    """Return symmetric tensors (LANES, 3, 3): of many sizes, without shear, with values alike, and none at all."""
    found = np.random.default_rng(0).normal(size=(LANES, 3, 3))
    found *= np.logspace(-200, 100, LANES)[:, None, None]
    found[:4] = 0.0
    found[1] = np.diag([3.0, 1.0, 2.0])
    found[2] = np.ones((3, 3))
    found[3, 0, 1] = found[3, 1, 0] = 1.0
    return found + found.transpose(0, 2, 1)


def diagonalised(given):
    lanes = np.empty((ROWS, LANES))
    lanes[:3] = given[:, [0, 1, 2], [0, 1, 2]].T
    lanes[3:6] = given[:, [0, 0, 1], [1, 2, 2]].T
    diagonalise(lanes)
    return lanes[:3].T, lanes[6:].T.reshape(-1, 3, 3).transpose(0, 2, 1)


def test_values_and_directions_make_the_tensors():
    given = tensors()
    values, directions = diagonalised(given)
    sizes = np.abs(given).max(axis=(1, 2))
    errors = np.abs(np.einsum("pik,pk,pjk->pij", directions, values, directions) - given).max(axis=(1, 2))
    # Below 1e-150 shear is taken as none, also for its size.
    np.testing.assert_array_less(errors, 1e-14 * sizes + 1e-149)
    np.testing.assert_allclose(
        directions.transpose(0, 2, 1) @ directions, np.tile(np.eye(3), (LANES, 1, 1)), atol=1e-14
    )


@pytest.mark.parametrize("lane", [0, LANES - 1])
def test_what_is_no_number_stays_alone(lane):
    given = tensors()
    expected = diagonalised(given)[0]
    given[lane] = np.nan
    values = diagonalised(given)[0]
    others = np.arange(LANES) != lane
    assert np.isnan(values[lane]).any()
    np.testing.assert_allclose(values[others], expected[others], rtol=1e-12)
