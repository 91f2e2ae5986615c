"""Parts that the laws of shape and volume share, and the check of their stability."""

from __future__ import annotations

import re

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.materials.large_strain import (
    check_stability,
    chosen_bulk_modulus,
    deviator,
    isochoric_tangent,
    linearise,
    sum_columns,
)


def test_deviator_has_no_sum_and_keeps_differences():
    values = np.array([[1.0, 2.0, 6.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(sum_columns(deviator(values)), 0.0, atol=1e-15)
    np.testing.assert_allclose(np.diff(deviator(values), axis=1), np.diff(values, axis=1))


def test_tangent_of_shape_is_projected_on_both_sides():
    rates = np.array([[1.0, 2.0, 5.0]])
    projection = np.eye(3) - 1 / 3
    np.testing.assert_allclose(isochoric_tangent(rates)[0], projection @ np.diag(rates[0]) @ projection, atol=1e-14)


def test_bulk_modulus_follows_from_poissons_ratio_and_back():
    bulk_modulus = chosen_bulk_modulus(10e3, None, 0.45)
    assert bulk_modulus == pytest.approx(2 * 10e3 * 1.45 / (3 * 0.1))
    rest = linearise(10e3, bulk_modulus, None, 1000.0)
    assert (rest.poisson_ratio, rest.youngs_modulus) == (pytest.approx(0.45), pytest.approx(29e3))


def stable_below(limit):
    """Return the tangent of a made-up law that is stable where no logarithmic strain is above a limit."""
    return lambda e: isochoric_tangent(np.where(e.max(axis=1, keepdims=True) < limit, 1.0, -1.0) * np.ones_like(e))


def test_check_names_tests_and_stretches():
    """The largest stretch is that of the test where it is above 1, and of the sides where it is below."""
    with pytest.raises(InputError) as caught:
        check_stability(stable_below(np.log(1.5)), (0.4, 3.0))
    found = re.findall(r"(\w+) below ([\d.]+) and above ([\d.]+)", str(caught.value))
    assert [test for test, *_ in found] == ["uniaxial", "equibiaxial", "planar"]
    limits = [(float(below), float(above)) for _, below, above in found]
    np.testing.assert_allclose(limits, [(1.5**-2, 1.5), (1.5**-0.5, 1.5), (1.5**-1, 1.5)], rtol=0.01)
    assert "stretches of 0.4 to 3" in str(caught.value)


def test_what_is_stable_in_the_range_passes():
    check_stability(stable_below(np.log(1.5)), (0.9, 1.2))


@pytest.mark.parametrize("stretches", [(0.0, 2.0), (1.0, 2.0), (0.5, 1.0), (2.0, 0.5)])
def test_range_has_to_hold_the_state_of_rest(stretches):
    with pytest.raises(InputError, match="stable_between"):
        check_stability(stable_below(10.0), stretches)
