"""What holds of every law of large strain: derivatives, symmetry of the axes, and the law at rest."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from fingerslip.materials import LAWS
from fingerslip.materials.large_strain import FiniteMaterial
from fingerslip.materials.mooney_rivlin import MooneyRivlin
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.materials.ogden import Ogden, OgdenTerm

TERMS = (OgdenTerm(30e3, 1.3), OgdenTerm(0.2e3, 5.0), OgdenTerm(-0.5e3, -2.0))
EXAMPLES = {
    NeoHookean: (NeoHookean(34e3, 0.48, 1000.0), NeoHookean(34e3, 0.0, 1000.0)),
    MooneyRivlin: (MooneyRivlin(8e3, 1000.0, 3e3, poisson_ratio=0.48), MooneyRivlin(8e3, 1000.0, bulk_modulus=1e6)),
    Ogden: (Ogden(TERMS, 1000.0, poisson_ratio=0.3), Ogden(TERMS[:1], 1000.0, bulk_modulus=2e6)),
}
EVERY = [
    pytest.param(law, id=f"{type(law).__name__}-{number}")
    for laws in EXAMPLES.values()
    for number, law in enumerate(laws)
]
STEP = 1e-6


def log_strains(count=40):
    return np.random.default_rng(5).uniform(-0.6, 0.6, (count, 3))


def differences(of, at):
    """Return the central differences of a function of logarithmic strains by each of them, the last axis."""
    steps = STEP * np.eye(3)
    return np.stack([(of(at + step) - of(at - step)) / (2 * STEP) for step in steps], axis=-1)


def test_every_law_of_large_strain_is_looked_at():
    assert set(EXAMPLES) == {law for law in LAWS if hasattr(law, "stored_energy")}


@pytest.mark.parametrize("law", EVERY)
def test_every_law_answers_the_protocol(law):
    assert isinstance(law, FiniteMaterial)
    assert (law.density, law.stiffness) == (1000.0, pytest.approx(law.at_rest().youngs_modulus))


@pytest.mark.parametrize("law", EVERY)
def test_stress_is_the_derivative_of_the_energy(law):
    at = log_strains()
    stress = law.kirchhoff_stress(at)
    assert stress.shape == at.shape
    np.testing.assert_allclose(stress, differences(law.stored_energy, at), atol=1e-8 * np.abs(stress).max())


@pytest.mark.parametrize("law", EVERY)
def test_tangent_is_the_symmetric_derivative_of_the_stress(law):
    at = log_strains()
    tangent = law.kirchhoff_tangent(at)
    assert tangent.shape == (len(at), 3, 3)
    np.testing.assert_allclose(tangent, differences(law.kirchhoff_stress, at), atol=1e-8 * np.abs(tangent).max())
    np.testing.assert_allclose(tangent, tangent.transpose(0, 2, 1), rtol=1e-13)


@pytest.mark.parametrize("law", EVERY)
def test_no_axis_is_another_than_the_others(law):
    at = log_strains(6)
    for order in map(list, itertools.permutations(range(3))):
        np.testing.assert_allclose(law.stored_energy(at[:, order]), law.stored_energy(at), rtol=1e-12)
        np.testing.assert_allclose(law.kirchhoff_stress(at[:, order]), law.kirchhoff_stress(at)[:, order], rtol=1e-12)


@pytest.mark.parametrize("law", EVERY)
def test_law_at_rest_is_its_linearisation(law):
    """Of normal strains along the axes Hooke's law has the tangent lambda + 2 G on, lambda off the diagonal."""
    rest = law.at_rest()
    np.testing.assert_array_equal(law.kirchhoff_stress(np.zeros((1, 3))), 0.0)
    np.testing.assert_array_equal(law.stored_energy(np.zeros((1, 3))), 0.0)
    hooke = rest.tangent(np.zeros((1, 6)), "solid")[0, :3, :3]
    np.testing.assert_allclose(law.kirchhoff_tangent(np.zeros((1, 3)))[0], hooke, rtol=1e-12)
    assert rest.shear_modulus == pytest.approx(law.shear_modulus)


@pytest.mark.parametrize("law", EVERY)
def test_part_of_the_volume_has_its_derivatives(law):
    at = np.linspace(-0.4, 0.5, 7)
    energy, first, second = law.volumetric(at)
    ahead, back = law.volumetric(at + STEP), law.volumetric(at - STEP)
    scale = np.abs(second).max()
    np.testing.assert_allclose((ahead[0] - back[0]) / (2 * STEP), first, atol=1e-8 * scale)
    np.testing.assert_allclose((ahead[1] - back[1]) / (2 * STEP), second, atol=1e-8 * scale)
    assert [float(part[0]) for part in law.volumetric(np.zeros(1))[:2]] == [0.0, 0.0]
    assert (energy >= 0.0).all()


@pytest.mark.parametrize("make", [lambda nu: NeoHookean(34e3, nu, 1.0), lambda nu: Ogden(TERMS, 1.0, poisson_ratio=nu)])
def test_what_the_part_of_the_volume_leaves_stays_bounded(make):
    at = log_strains()
    left = [
        law.kirchhoff_stress(at) - law.volumetric(at.sum(axis=1))[1][:, None] for law in (make(0.49), make(0.499999))
    ]
    np.testing.assert_allclose(left[0], left[1], rtol=0.02, atol=100.0)


@pytest.mark.parametrize("law", EVERY)
def test_points_are_independent_and_none_have_no_values(law):
    at = log_strains(3)
    np.testing.assert_array_equal(law.kirchhoff_stress(at)[1:2], law.kirchhoff_stress(at[1:2]))
    none = np.zeros((0, 3))
    assert law.stored_energy(none).shape == (0,)
    assert law.kirchhoff_stress(none).shape == (0, 3)
    assert law.kirchhoff_tangent(none).shape == (0, 3, 3)


@pytest.mark.parametrize("law", EVERY)
def test_strains_are_not_changed(law):
    at = log_strains(4)
    kept = at.copy()
    law.stored_energy(at), law.kirchhoff_stress(at), law.kirchhoff_tangent(at), law.volumetric(at.sum(axis=1))
    np.testing.assert_array_equal(at, kept)
