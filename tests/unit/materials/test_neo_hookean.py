"""Neo-Hookean elasticity: closed forms, and values that cannot be."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.neo_hookean import NeoHookean


def test_uniaxial_strain_has_its_closed_form():
    """Sides held: sigma = G/J (lambda^2 - 1) + lambda_1 ln J / J along the axis, lambda_1 ln J / J across."""
    law, stretch = NeoHookean(34e3, 0.4, 1000.0), np.array([0.6, 1.7])
    log_strain = np.stack([np.log(stretch), 0 * stretch, 0 * stretch], axis=1)
    cauchy = law.kirchhoff_stress(log_strain) / stretch[:, None]
    pressure = law.first_lame * np.log(stretch) / stretch
    np.testing.assert_allclose(cauchy[:, 0], law.shear_modulus * (stretch**2 - 1) / stretch + pressure, rtol=1e-13)
    np.testing.assert_allclose(cauchy[:, 1], pressure, rtol=1e-13)


def test_simple_shear_needs_the_modulus_at_rest_and_normal_stresses():
    """Of the shear k: b = [[1 + k^2, k], [k, 1]], so tau_xy = G k and tau_xx = G k^2."""
    law, shear = NeoHookean(34e3, 0.45, 1000.0), 0.8
    deformation = np.array([[1.0, shear, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    squares, axes = np.linalg.eigh(deformation @ deformation.T)
    principal = law.kirchhoff_stress(0.5 * np.log(squares)[None])[0]
    stress = axes @ np.diag(principal) @ axes.T
    expected = law.shear_modulus * np.array([[shear**2, shear, 0.0], [shear, 0.0, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(stress, expected, atol=1e-9 * law.shear_modulus)


def test_law_at_rest_is_that_of_its_moduli():
    assert NeoHookean(34e3, 0.48, 1000.0).at_rest() == Elastic(34e3, 0.48, 1000.0)


@pytest.mark.parametrize("ratio", [0.5, -0.1])
def test_ratios_without_a_bulk_modulus_are_refused(ratio):
    with pytest.raises(InputError, match=r"NeoHookean\.poisson_ratio"):
        NeoHookean(34e3, ratio, 1000.0)
