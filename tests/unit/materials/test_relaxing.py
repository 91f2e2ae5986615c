"""What of a law relaxes, and the strain of the spring of a term."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerslip.errors import FingerslipError
from fingerslip.materials.large_strain import log_volume_of
from fingerslip.materials.prony import PronyTerm
from fingerslip.materials.relaxing import (
    StepLaw,
    constants_of,
    shape_energy,
    shape_stress,
    spring_strain,
    volume_part,
)
from unit.fe.finite.bodies import LAWS, SOFT

EVERY_LAW = pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)


def strains(count=20, size=0.3, seed=1):
    return np.random.default_rng(seed).uniform(-size, size, (count, 3))


@EVERY_LAW
def test_constants_are_those_at_rest(law):
    found = constants_of(replace(law, prony=(PronyTerm(0.3, 1.0),)))
    assert found.prony == (PronyTerm(0.3, 1.0),)
    tangent = law.kirchhoff_tangent(np.zeros((1, 3)))[0]
    assert found.shear_modulus == pytest.approx((tangent[0, 0] - tangent[0, 1]) / 2)
    assert found.bulk_modulus == pytest.approx(tangent.sum() / 9)
    assert found.bulk_modulus == pytest.approx(
        2 * found.shear_modulus * (1 + found.poisson_ratio) / 3 / (1 - 2 * found.poisson_ratio)
    )


@EVERY_LAW
def test_volume_and_shape_make_up_the_law(law):
    strain, step = strains(), 1e-6
    volume = log_volume_of(strain)
    energy, slope, curvature = volume_part(law, volume)
    np.testing.assert_allclose(energy + shape_energy(law, strain), law.stored_energy(strain))
    np.testing.assert_allclose(shape_stress(law, strain) + slope[:, None], law.kirchhoff_stress(strain))
    ahead, back = (volume_part(law, volume + sign * step) for sign in (1, -1))
    np.testing.assert_allclose((ahead[0] - back[0]) / 2 / step, slope, atol=1e-8)
    np.testing.assert_allclose((ahead[1] - back[1]) / 2 / step, curvature, atol=1e-7)
    assert volume_part(law, np.zeros(1))[2][0] == pytest.approx(constants_of(law).bulk_modulus)


@EVERY_LAW
def test_a_change_of_volume_alone_has_hardly_any_energy_of_shape(law):
    """None in laws that do not mix shape and volume, and of third order in the neo-Hookean law."""
    small, double = (shape_energy(law, np.full((1, 3), size))[0] for size in (1e-3, 2e-3))
    assert abs(small) < 1e-7
    if abs(small) > 1e-12:
        assert double / small == pytest.approx(8.0, rel=0.01)


@EVERY_LAW
def test_law_of_a_step_has_the_elastic_law_as_its_limits(law):
    strain = strains()
    whole = StepLaw(law, 0.0, np.zeros(20))
    np.testing.assert_array_equal(whole.kirchhoff_stress(strain), law.kirchhoff_stress(strain))
    nothing = StepLaw(law, 1.0, np.full(20, 0.2)).kirchhoff_stress(strain)
    np.testing.assert_allclose(nothing, np.tile(volume_part(law, log_volume_of(strain))[1][:, None] - 0.2, 3))


@EVERY_LAW
def test_tangent_of_a_step_is_the_derivative_of_its_stress(law):
    strain, step = strains(), 1e-6
    own = StepLaw(law, 0.4, np.linspace(0.0, 1.0, 20))
    tangent = own.kirchhoff_tangent(strain)
    for axis in range(3):
        change = step * np.eye(3)[axis]
        slope = (own.kirchhoff_stress(strain + change) - own.kirchhoff_stress(strain - change)) / 2 / step
        np.testing.assert_allclose(tangent[:, :, axis], slope, atol=1e-6 * np.abs(tangent).max())


@settings(max_examples=60)
@given(
    law=st.sampled_from(LAWS),
    parts=st.lists(st.floats(-0.6, 0.6), min_size=3, max_size=3),
    share=st.floats(0.0, 1.0),
)
def test_a_spring_has_the_stress_that_was_given(law, parts, share):
    strain = np.array([parts])
    stress = share * (law.kirchhoff_stress(strain) - law.kirchhoff_stress(strain).mean())
    volume = log_volume_of(strain)
    found = spring_strain(law, stress, volume, np.zeros((1, 3)))
    again = law.kirchhoff_stress(found)
    np.testing.assert_allclose(again - again.mean(), stress, atol=1e-8 * max(1.0, np.abs(stress).max()))
    np.testing.assert_allclose(log_volume_of(found), volume, atol=1e-12)
    if share == 1.0:
        np.testing.assert_allclose(found, strain, atol=1e-6)


class _Yielding:
    """A law whose stress has a limit."""

    def at_rest(self):
        return SOFT.at_rest()

    def kirchhoff_stress(self, strain):
        return np.tanh(strain)

    def kirchhoff_tangent(self, strain):
        return np.einsum("ni,ij->nij", np.cosh(strain) ** -2, np.eye(3))


def test_a_stress_that_no_strain_has_is_an_error():
    with pytest.raises(FingerslipError, match="_Yielding: the strain of a spring of a Prony term was not found"):
        spring_strain(_Yielding(), np.array([[3.0, -1.5, -1.5]]), np.zeros(1), np.zeros((1, 3)))
