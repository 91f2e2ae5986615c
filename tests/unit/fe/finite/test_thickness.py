"""The thickness in plane stress leaves no stress across the plane, from wherever it is searched."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import FingerslipError, InputError
from fingerslip.fe.finite.thickness import Pulled, check_thickness, thickness_strain
from unit.fe.finite.bodies import LAWS, SOFT


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
@pytest.mark.parametrize("guess", [0.0, 0.4, -0.8])
def test_no_stress_is_left_across_the_plane(law, guess):
    strain = np.random.default_rng(2).uniform(-0.5, 0.5, (50, 3))
    strain[:, 2] = guess
    kept = strain.copy()
    across = thickness_strain(law, strain)
    np.testing.assert_array_equal(strain, kept)
    found = np.column_stack([strain[:, :2], across])
    np.testing.assert_allclose(law.kirchhoff_stress(found)[:, 2], 0.0, atol=1e-8)


def test_a_sheet_at_rest_keeps_its_thickness_and_no_points_have_none():
    np.testing.assert_array_equal(thickness_strain(SOFT, np.zeros((3, 3))), 0.0)
    assert thickness_strain(SOFT, np.zeros((0, 3))).shape == (0,)


def test_what_a_step_finds_at_its_start_pulls_across_as_well():
    generator = np.random.default_rng(4)
    pulled = Pulled(generator.uniform(-0.5, 0.5, 20), generator.uniform(-0.3, 0.3, 20))
    strain, step = generator.uniform(-0.3, 0.3, (20, 3)), 1e-6
    ahead, back = (pulled.stress(strain + sign * step * np.eye(3)[2])[0] for sign in (1, -1))
    np.testing.assert_allclose((ahead - back) / 2 / step, pulled.stress(strain)[1], atol=1e-8)
    found = np.column_stack([strain[:, :2], thickness_strain(SOFT, strain, pulled)])
    np.testing.assert_allclose(SOFT.kirchhoff_stress(found)[:, 2] + pulled.stress(found)[0], 0.0, atol=1e-8)
    scale, third = np.exp(-2.0 / 3.0 * found.sum(axis=1)), pulled.across * np.exp(2.0 * found[:, 2])
    np.testing.assert_allclose(pulled.stress(found)[0], scale * ((pulled.in_plane + third) / 3.0 - third))


class _Pushing:
    """A law that always pushes across the plane."""

    def kirchhoff_stress(self, strain):
        return np.ones_like(strain)

    def kirchhoff_tangent(self, strain):
        return np.ones((len(strain), 3, 3))


def test_a_law_without_such_a_thickness_is_an_error_that_says_what_to_do():
    with pytest.raises(FingerslipError, match=r"_Pushing: no thickness .* take plane strain"):
        thickness_strain(_Pushing(), np.zeros((1, 3)))


class Sheet:
    """A law without stiffness across the plane, or with a stress there at rest [Pa]."""

    def __init__(self, stiffness, stress):
        self.stiffness, self.stress = stiffness, stress

    def kirchhoff_stress(self, log_strain):
        return log_strain @ np.diag([1e4, 1e4, self.stiffness]) + [0.0, 0.0, self.stress]

    def kirchhoff_tangent(self, log_strain):
        return np.tile(np.diag([1e4, 1e4, self.stiffness]), (len(log_strain), 1, 1))


@pytest.mark.parametrize("law", [*LAWS, Sheet(1.0, 0.0)], ids=lambda law: type(law).__name__)
def test_laws_with_a_thickness_are_taken(law):
    check_thickness("skin", law)


@pytest.mark.parametrize(("stiffness", "stress"), [(0.0, 0.0), (-1.0, 0.0), (np.nan, np.nan), (1e4, 3.0)])
def test_laws_without_a_thickness_are_refused(stiffness, stress):
    expected = (
        rf"materials\.skin: got Sheet, .* is {stress:g} Pa at rest and grows by {stiffness:g} Pa.*take plane_strain"
    )
    with pytest.raises(InputError, match=expected):
        check_thickness("skin", Sheet(stiffness, stress))
