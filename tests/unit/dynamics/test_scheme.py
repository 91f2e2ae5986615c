"""HHT-alpha: published spectral radii, stability, second order."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.dynamics.scheme import hht, predict
from problems.blocks import fitted_slope
from unit.dynamics.oscillator import FREQUENCY, STATIC, oscillator

ALPHAS = [0.0, -0.05, -0.2, -1 / 3, -0.41421, -0.5]


def amplification(alpha, frequency):
    """Return the matrix that takes (u, v, a) of a free oscillator over a step of 1 s."""
    scheme, columns = hht(1.0, alpha), []
    for state in np.eye(3):
        ahead = predict(scheme, *state[:, None])
        old, new = frequency**2 * state[0], frequency**2 * ahead.displacement[0]
        weight = 1.0 + alpha
        acceleration = (alpha * old - weight * new) / (1.0 + weight * frequency**2 * scheme.displacement_factor)
        displacement = ahead.displacement[0] + scheme.displacement_factor * acceleration
        columns.append([displacement, ahead.velocity[0] + scheme.velocity_factor * acceleration, acceleration])
    return np.array(columns).T


def spectral_radius(alpha, frequency):
    return np.abs(np.linalg.eigvals(amplification(alpha, frequency))).max()


@pytest.mark.parametrize(("alpha", "expected"), [(0.0, 1.0), (-0.05, 0.9048), (-1 / 3, 0.5)])
def test_published_spectral_radii_at_infinite_step(alpha, expected):
    """Hilber, Hughes & Taylor 1977; the published digits."""
    assert hht(1.0, alpha).spectral_radius_at_infinity == pytest.approx(expected, abs=5e-5)


@pytest.mark.parametrize("alpha", ALPHAS)
def test_spectral_radius_at_infinity_is_that_of_the_scheme(alpha):
    """Double eigenvalues are found to the root of rounding only, hence 1e-3."""
    assert spectral_radius(alpha, 1e6) == pytest.approx(hht(1.0, alpha).spectral_radius_at_infinity, abs=1e-3)


@settings(deadline=None, derandomize=True)
@given(st.floats(-0.5, 0.0), st.floats(-4.0, 6.0))
def test_unconditionally_stable(alpha, decade):
    assert spectral_radius(alpha, 10.0**decade) <= 1.0 + 1e-6


@pytest.mark.parametrize("alpha", [0.0, -0.05, -1 / 3])
def test_second_order_on_one_oscillator(alpha):
    end, steps = 6.0, [0.2, 0.1, 0.05, 0.025]
    errors = []
    for step in steps:
        history = fs.simulate(oscillator(step, alpha, end))
        exact = STATIC * (1.0 - np.cos(FREQUENCY * history.time.values))
        errors.append(np.abs(history.displacement.values[:, 0, 0] - exact).max())
    slope = fitted_slope(steps, errors)
    assert slope == pytest.approx(2.0, abs=0.1), f"alpha {alpha}: fitted order {slope:.3f}, errors {errors}"
