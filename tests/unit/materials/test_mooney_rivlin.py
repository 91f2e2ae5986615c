"""Mooney-Rivlin elasticity: closed forms of the incompressible tests, and constants that are refused."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.materials.mooney_rivlin import MooneyRivlin

STRETCH = np.array([0.6, 1.3, 2.0])
LAW = MooneyRivlin(8e3, 1000.0, 3e3, poisson_ratio=0.49)


def differences_of_stress(stretches):
    """Return the differences of the first and second principal stress to the third, which no pressure changes."""
    stress = LAW.kirchhoff_stress(np.log(np.stack(stretches, axis=1)))
    return stress[:, 0] - stress[:, 2], stress[:, 1] - stress[:, 2]


def test_uniaxial_test_has_its_closed_form():
    """sigma = 2 (lambda^2 - 1/lambda) (c10 + c01/lambda)."""
    along, across = differences_of_stress((STRETCH, STRETCH**-0.5, STRETCH**-0.5))
    np.testing.assert_allclose(along, 2 * (STRETCH**2 - 1 / STRETCH) * (8e3 + 3e3 / STRETCH), rtol=1e-12)
    np.testing.assert_allclose(across, 0.0, atol=1e-8)


def test_equibiaxial_test_has_its_closed_form():
    """sigma = 2 (lambda^2 - lambda^-4) (c10 + c01 lambda^2)."""
    for stress in differences_of_stress((STRETCH, STRETCH, STRETCH**-2)):
        np.testing.assert_allclose(stress, 2 * (STRETCH**2 - STRETCH**-4) * (8e3 + 3e3 * STRETCH**2), rtol=1e-12)


def test_simple_shear_needs_the_modulus_at_rest():
    """tau_xy = 2 (c10 + c01) k for every shear k."""
    shear = 0.9
    deformation = np.array([[1.0, shear, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    squares, axes = np.linalg.eigh(deformation @ deformation.T)
    stress = axes @ np.diag(LAW.kirchhoff_stress(0.5 * np.log(squares)[None])[0]) @ axes.T
    assert stress[0, 1] == pytest.approx(2 * 11e3 * shear, rel=1e-12)
    assert stress[0, 0] - stress[1, 1] == pytest.approx(2 * 11e3 * shear**2, rel=1e-12)


def test_pressure_is_the_bulk_modulus_times_the_change_of_volume():
    law = MooneyRivlin(8e3, 1000.0, 3e3, bulk_modulus=1e6)
    np.testing.assert_allclose(law.kirchhoff_stress(np.full((1, 3), 0.1)), 1e6 * 0.3, rtol=1e-13)
    assert law.at_rest().poisson_ratio == pytest.approx((3e6 - 2 * 22e3) / (2 * (3e6 + 22e3)))
    assert MooneyRivlin(8e3, 1000.0, 3e3, poisson_ratio=0.48).at_rest().poisson_ratio == 0.48


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({}, "bulk_modulus: is missing, needs a value; or give poisson_ratio"),
        ({"bulk_modulus": 1e6, "poisson_ratio": 0.4}, "poisson_ratio: is given with bulk_modulus"),
        ({"bulk_modulus": 1e3}, "bulk_modulus: got 1000 Pa, too small against the shear modulus of 16000 Pa"),
        ({"bulk_modulus": 1e6, "c01": -9e3}, "c10: got c10 + c01 = -1000 Pa"),
        (
            {"bulk_modulus": 1e6, "c01": -2e3},
            "not stable (Drucker) at stretches: uniaxial above 2, equibiaxial below 0.706 and above ",
        ),
        ({"bulk_modulus": 1e6, "stable_between": (1.2, 2.0)}, "stable_between: got 1.2 and 2"),
    ],
)
def test_impossible_constants_are_refused(values, message):
    with pytest.raises(InputError) as caught:
        MooneyRivlin(8e3, 1000.0, **values)
    assert message in str(caught.value)
