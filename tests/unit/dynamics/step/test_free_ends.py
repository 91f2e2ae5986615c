"""Steps without forces at their ends: the scheme's own prediction, and moving supports where they are prescribed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from fingerslip.dynamics.step.free_ends import free_ends, right_hand_sides
from fingerslip.dynamics.system.scheme import Static, hht
from fingerslip.linear.symmetric import symmetric_parts

RNG = np.random.default_rng(0)
STARTS = tuple(RNG.normal(size=(2, 5)) for _ in range(3))
NO_SUPPORT = np.zeros(0, dtype=np.int64), np.zeros(0)


def symmetric(seed):
    matrix = sparse.random(5, 5, 0.6, "csr", random_state=seed)
    return sparse.csr_matrix(matrix + matrix.T)


def taken(scheme):
    """Return what a scheme makes of the start of a step, and its factors and weights."""
    free = scheme.predict(*np.eye(3))
    factors = scheme.displacement_factor, scheme.velocity_factor, scheme.inertia_factor
    return np.stack([free.displacement, free.velocity]), (*factors, scheme.start_weight, scheme.end_weight)


@pytest.mark.parametrize("scheme", [hht(0.1, -0.2), Static(0.1)], ids=["HHT", "static"])
def test_ends_are_the_predictions_of_the_scheme(scheme):
    ends = free_ends(*taken(scheme), *NO_SUPPORT, *STARTS)
    expected = scheme.predict(*STARTS)
    np.testing.assert_allclose(ends, np.stack([expected.displacement, expected.velocity], axis=1), atol=1e-15)


def test_moving_supports_are_where_they_are_prescribed_and_follow_the_scheme():
    scheme = hht(0.1, -0.2)
    ends = free_ends(*taken(scheme), np.array([3, 4]), np.array([7.0, -1.0]), *STARTS)
    np.testing.assert_allclose(ends[:, 0, 3:], [[7.0, -1.0]] * 2, rtol=1e-15)
    expected = scheme.predict(*STARTS)
    acceleration = (ends[:, 0] - expected.displacement) / scheme.displacement_factor
    np.testing.assert_allclose(ends[:, 2], acceleration, rtol=1e-12)
    np.testing.assert_allclose(ends[:, 1], expected.velocity + scheme.velocity_factor * acceleration, rtol=1e-12)
    assert (ends[:, 2, :3] == 0.0).all()


def test_right_hand_sides_count_all_that_resists():
    scheme = hht(0.1, -0.2)
    stiffness, elastic, mass = map(symmetric, range(3))
    dampers, unbalance, loads = RNG.normal(size=5), RNG.normal(size=(2, 5)), RNG.normal(size=(2, 5))
    shares, (prediction, factors) = (0.3, 0.7, 0.9), taken(scheme)
    resistance = (*map(symmetric_parts, (stiffness, elastic, mass)), dampers, shares)
    support = np.array([4]), np.array([2.0])
    ends = free_ends(prediction, factors, *support, *STARTS)
    right = right_hand_sides(factors, resistance, support[0], ends, unbalance, loads)
    for own, (displacement, velocity, prescribed), before, load in zip(right, ends, unbalance, loads, strict=True):
        force = stiffness @ (displacement + 0.3 * velocity) + elastic @ (0.7 * velocity)
        force += mass @ (0.9 * velocity) + dampers * velocity
        expected = 0.8 * (load - force) - 0.2 * before - mass @ prescribed
        expected[4] = 0.0
        np.testing.assert_allclose(own, expected, atol=1e-13)
