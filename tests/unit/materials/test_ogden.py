"""Ogden elasticity: closed forms, the laws that are cases of it, and terms that are refused."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.materials.mooney_rivlin import MooneyRivlin
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.materials.ogden import Ogden, OgdenTerm

LOG_STRAINS = np.random.default_rng(1).uniform(-0.5, 0.5, (20, 3))


def test_uniaxial_and_equibiaxial_tests_have_their_closed_forms():
    """sigma = sum mu (lambda^alpha - lambda^(-alpha/2)), and with lambda^(-2 alpha) in the equibiaxial test."""
    terms, stretch = ((2e3, 1.3), (50.0, 5.0), (-100.0, -2.0)), np.array([0.7, 1.8])
    law = Ogden(tuple(OgdenTerm(*term) for term in terms), 1000.0, poisson_ratio=0.49)
    for others, power in (((-0.5, -0.5), -0.5), ((1.0, -2.0), -2.0)):
        log_strain = np.log(stretch)[:, None] * np.array([1.0, *others])
        stress = law.kirchhoff_stress(log_strain)
        expected = sum(mu * (stretch**alpha - stretch ** (power * alpha)) for mu, alpha in terms)
        np.testing.assert_allclose(stress[:, 0] - stress[:, 2], expected, rtol=1e-12)


def test_mooney_rivlin_is_the_case_of_exponents_2_and_minus_2():
    ogden = Ogden((OgdenTerm(16e3, 2.0), OgdenTerm(-6e3, -2.0)), 1000.0, poisson_ratio=0.47)
    mooney_rivlin = MooneyRivlin(8e3, 1000.0, 3e3, poisson_ratio=0.47)
    for name in ("stored_energy", "kirchhoff_stress", "kirchhoff_tangent"):
        np.testing.assert_allclose(
            getattr(ogden, name)(LOG_STRAINS), getattr(mooney_rivlin, name)(LOG_STRAINS), rtol=1e-12
        )
    assert ogden.at_rest() == mooney_rivlin.at_rest()


def test_neo_hookean_is_the_case_of_one_term_where_the_volume_stays():
    """Of changes of shape alone; compressible neo-Hookean has another energy of shape where the volume changes."""
    shape = LOG_STRAINS - LOG_STRAINS.mean(axis=1, keepdims=True)
    law = NeoHookean(34e3, 0.48, 1000.0)
    ogden = Ogden((OgdenTerm(law.shear_modulus, 2.0),), 1000.0, poisson_ratio=0.48)
    stresses = [one.kirchhoff_stress(shape) for one in (law, ogden)]
    deviators = [stress - stress.mean(axis=1, keepdims=True) for stress in stresses]
    np.testing.assert_allclose(*deviators, rtol=1e-12)
    np.testing.assert_allclose(law.stored_energy(shape), ogden.stored_energy(shape), rtol=1e-12)
    assert ogden.at_rest().youngs_modulus == pytest.approx(34e3)


def test_growing_bulk_modulus_is_the_incompressible_limit():
    """Stretched along one axis with free sides, ln J is a third of the stress along the axis over the bulk modulus."""
    stretch = 1.5
    for bulk_modulus in (1e6, 1e7):
        law = Ogden((OgdenTerm(10e3, 2.0),), 1000.0, bulk_modulus=bulk_modulus)
        log_volume = 0.0
        for _ in range(50):
            across = (log_volume - np.log(stretch)) / 2
            shape = law.kirchhoff_stress(np.array([[np.log(stretch), across, across]]))[0] - bulk_modulus * log_volume
            log_volume = -shape[1] / bulk_modulus
        expected = 10e3 * (stretch**2 - 1 / stretch) / (3 * bulk_modulus)
        assert log_volume == pytest.approx(expected, rel=3e4 / bulk_modulus)


@pytest.mark.parametrize(
    ("terms", "message"),
    [
        ((), "terms: is empty"),
        (((-2e3, 2.0),), "terms: has a sum of modulus times exponent of -4000 Pa, needs a sum > 0"),
        (((1e3, 0.0),), "exponent: got 0"),
        (((5e3, 2.0), (2e3, -2.0)), "is not stable (Drucker) at stretches: uniaxial below "),
    ],
)
def test_impossible_terms_are_refused(terms, message):
    with pytest.raises(InputError) as caught:
        Ogden(tuple(OgdenTerm(*term) for term in terms), 1000.0, poisson_ratio=0.48)
    assert message in str(caught.value)
