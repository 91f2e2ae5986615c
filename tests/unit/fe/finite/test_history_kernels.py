"""The compiled loops against the same in NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.fe.finite import history as kernels

PLANE, SPACE = ((0, 0), (1, 1), (0, 1), (2, 2)), ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
COUNT = 7


def full(packed, dim):
    """Return tensors (n, 3, 3)."""
    found = np.zeros((len(packed), 3, 3))
    for own, (i, j) in zip(packed.T, PLANE if dim == 2 else SPACE, strict=True):
        found[:, i, j] = found[:, j, i] = own
    return found


def points(dim, seed=3):
    """Return deformation gradients (n, dim, dim), logarithmic strains (n, 3) and tensors (n, k)."""
    generator = np.random.default_rng(seed)
    deformation = np.eye(dim) + generator.uniform(-0.2, 0.2, (COUNT, dim, dim))
    gradient = np.tile(np.eye(3), (COUNT, 1, 1))
    gradient[:, :dim, :dim] = deformation
    if dim == 2:
        gradient[:, 2, 2] = generator.uniform(0.8, 1.2, COUNT)
    return deformation, gradient, generator.normal(size=(COUNT, 4 if dim == 2 else 6))


def log_strains(gradient, dim):
    """Return squares of stretches (n, dim), directions (n, dim, dim) and logarithmic strains (n, 3)."""
    squared, directions = np.linalg.eigh((np.transpose(gradient, (0, 2, 1)) @ gradient)[:, :dim, :dim])
    strain = np.zeros((COUNT, 3))
    strain[:, :dim] = 0.5 * np.log(squared)
    if dim == 2:
        strain[:, 2] = np.log(gradient[:, 2, 2])
    return squared, directions, strain


@pytest.mark.parametrize("dim", [2, 3])
def test_tensors_are_pushed_forward(dim):
    deformation, gradient, packed = points(dim)
    found = np.empty_like(packed)
    kernels.push_forward(deformation, log_strains(gradient, dim)[2], packed, found)
    scale = np.linalg.det(gradient)[:, None, None] ** (-2 / 3)
    expected = scale * gradient @ full(packed, dim) @ np.transpose(gradient, (0, 2, 1))
    np.testing.assert_allclose(full(found, dim), expected, atol=1e-13)


@pytest.mark.parametrize("dim", [2, 3])
def test_stress_of_the_shape_comes_back_when_it_is_pushed_forward(dim):
    deformation, gradient, packed = points(dim)
    squared, directions, strain = log_strains(gradient, dim)
    stress, reference, current = np.random.default_rng(1).normal(size=(COUNT, 3)), np.empty_like(packed), packed.copy()
    kernels.shape_tensors(squared, directions, strain, stress, reference)
    kernels.push_forward(deformation, strain, reference, current)
    values = np.empty((COUNT, 3))
    kernels.principal_values(current, dim, values)
    expected = np.sort(stress - stress.mean(axis=1, keepdims=True), axis=1)
    np.testing.assert_allclose(np.sort(values, axis=1), expected, atol=1e-12)
    np.testing.assert_allclose(np.trace(full(current, dim), axis1=1, axis2=2), 0.0, atol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_principal_values_are_those_of_the_deviators(dim):
    _, _, packed = points(dim)
    values = np.empty((COUNT, 3))
    kernels.principal_values(packed, dim, values)
    tensors = full(packed, dim)
    deviators = tensors - np.trace(tensors, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    np.testing.assert_allclose(np.sort(values, axis=1), np.linalg.eigvalsh(deviators), atol=1e-12)
    if dim == 2:
        np.testing.assert_allclose(values[:, 2], deviators[:, 2, 2])


def test_dashpots_follow_and_leave_what_numpy_says():
    generator = np.random.default_rng(2)
    number = np.array([0, 1, 1, 0, 0, 1, 0])
    shares, decay, end, start = generator.uniform(0.0, 1.0, (4, 2, 3))
    given0, given = generator.normal(size=(2, COUNT, 5))
    dashpots0, dashpots, left = generator.normal(size=(3, COUNT, 5)), np.empty((3, COUNT, 5)), np.empty((COUNT, 5))

    def of(table):
        return table[number].T[:, :, None]

    kept = of(decay) * dashpots0 + of(start) * given0
    kernels.leave(number, shares, decay, start, given0, dashpots0, left)
    np.testing.assert_allclose(left, (of(shares) * kept).sum(axis=0))
    kernels.follow(number, decay, end, start, given0, given, dashpots0, dashpots)
    np.testing.assert_allclose(dashpots, kept + of(end) * given)
