"""Compiled loops: principal directions, forces and stiffness by independent formulas."""

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
)


def strained(dim, gradient):
    """Return what loops take for one point of a simplex with unit edges that has a displacement gradient."""
    slopes = np.vstack([-np.ones(dim), np.eye(dim)])[None, None]
    nodes = np.arange(dim + 1)[None]
    displacement = np.vstack([np.zeros(dim), np.eye(dim)]) @ np.asarray(gradient).T
    filled = np.empty((1, dim, dim)), np.empty((1, dim)), np.empty((1, dim, dim))
    worst = (strains_2d if dim == 2 else strains)(slopes, nodes, displacement, *filled)
    return slopes, nodes, worst, [values[0] for values in filled]


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


def first_piola(deformation, stress):
    """Return P = F sum_i tau_i / lambda_i^2 N_i N_i^T of a law with given principal stresses."""
    values, vectors = np.linalg.eigh(deformation.T @ deformation)
    return deformation @ vectors @ np.diag(stress(np.sqrt(values)) / values) @ vectors.T


def kirchhoff(stretches):
    """Return the Kirchhoff stresses of an isotropic law without coupling, tau_i = lambda_i^3 - 1."""
    return stretches**3 - 1.0


@pytest.mark.parametrize("name", GRADIENTS)
@pytest.mark.parametrize("dim", [2, 3])
def test_directions_make_the_metric_and_forces_and_stiffness_are_those_of_the_stress(name, dim):
    """Also where the quotient of differences of stresses has no digits."""
    gradient = GRADIENTS[name][:dim, :dim]
    slopes, nodes, worst, (deformation, squared, directions) = strained(dim, gradient)
    assert worst == -1
    np.testing.assert_allclose(deformation, np.eye(dim) + gradient, atol=1e-15)
    metric = deformation.T @ deformation
    np.testing.assert_allclose(directions.T @ directions, np.eye(dim), atol=1e-14)
    np.testing.assert_allclose(directions @ np.diag(squared) @ directions.T, metric, atol=1e-14 * np.abs(metric).max())
    if name in ("tiny", "far", "zero"):
        return
    stretches = np.sqrt(squared)
    state = deformation[None], squared[None], directions[None], kirchhoff(stretches)[None]
    forces = np.zeros((dim + 1, dim))
    (nodal_forces_2d if dim == 2 else nodal_forces)(slopes, nodes, np.array([2.0]), *state, forces)
    np.testing.assert_allclose(forces, 2.0 * slopes[0, 0] @ first_piola(deformation, kirchhoff).T, atol=1e-12)
    matrices, step = np.empty((1, forces.size, forces.size)), 1e-6
    stiffness_of_cells(slopes, np.array([2.0]), *state, np.diag(3.0 * stretches**3)[None], False, matrices)
    expected = np.empty_like(matrices[0])
    for column, unit in enumerate(np.eye(forces.size)):
        change = step * unit.reshape(forces.shape).T @ slopes[0, 0]
        ahead, back = (first_piola(deformation + sign * change, kirchhoff) for sign in (1, -1))
        expected[:, column] = (2.0 * slopes[0, 0] @ (ahead - back).T / (2 * step)).ravel()
    np.testing.assert_allclose(matrices[0], expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("bad", [-1.5, -1.0, np.nan])
def test_what_is_inside_out_flat_or_no_number_is_told(dim, bad):
    assert strained(dim, np.diag([bad, 0.0, 0.0])[:dim, :dim])[2] == 0


def tensors():
    """Return symmetric tensors (LANES, 3, 3): of many sizes, without shear, with values alike, and none at all."""
    values = np.random.default_rng(0).normal(size=(LANES, 3, 3))
    values *= np.logspace(-200, 100, LANES)[:, None, None]
    values[:4] = 0.0
    values[1], values[2] = np.diag([3.0, 1.0, 2.0]), np.ones((3, 3))
    values[3, 0, 1] = values[3, 1, 0] = 1.0
    return values + values.transpose(0, 2, 1)


def diagonalised(symmetric):
    lanes = np.empty((ROWS, LANES))
    lanes[:3] = symmetric[:, [0, 1, 2], [0, 1, 2]].T
    lanes[3:6] = symmetric[:, [0, 0, 1], [1, 2, 2]].T
    diagonalise(lanes)
    return lanes[:3].T, lanes[6:].T.reshape(-1, 3, 3).transpose(0, 2, 1)


@pytest.mark.parametrize("lane", [None, 0, LANES - 1])
def test_values_and_directions_make_the_tensors_and_what_is_no_number_stays_alone(lane):
    symmetric, others = tensors(), np.arange(LANES) != lane
    sizes = np.abs(symmetric).max(axis=(1, 2))
    if lane is not None:
        symmetric[lane] = np.nan
    values, directions = diagonalised(symmetric)
    made = np.einsum("pik,pk,pjk->pij", directions, values, directions)
    errors = np.abs(made - symmetric).max(axis=(1, 2))
    # Below 1e-150 shear is taken as none, also for its size.
    np.testing.assert_array_less(errors[others], (1e-14 * sizes + 1e-149)[others])
    square = (directions.transpose(0, 2, 1) @ directions)[others]
    np.testing.assert_allclose(square, np.broadcast_to(np.eye(3), square.shape), atol=1e-14)
    assert lane is None or np.isnan(values[lane]).any()
