"""Friction laws: what their parameters may be, and what they make of pressure, slip rate, slip distance and time."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fingerslip.contact.friction import (
    Anisotropic,
    Conditions,
    Coulomb,
    PressureDependent,
    SlipWeakening,
    StaticKinetic,
    TangentFrame,
)
from fingerslip.errors import InputError
from fingerslip.parameters import from_mapping


def conditions(**given):
    """Return conditions at which everything that is not given is one."""
    count = len(next(iter(given.values())))
    names = ("pressure", "slip_rate", "slip_since_contact")
    return Conditions(*(np.array(given.get(name, np.ones(count))) for name in names), time=1.0)


def test_negative_friction_is_refused():
    with pytest.raises(InputError, match=r"Coulomb.coefficient: got -0.2, needs a number >= 0"):
        Coulomb(-0.2)


@pytest.mark.parametrize("coefficient", [float("nan"), float("inf"), "much"])
def test_what_is_no_number_is_refused(coefficient):
    with pytest.raises(InputError, match=r"Coulomb.coefficient"):
        Coulomb(coefficient)


def test_the_coefficient_has_no_unit_in_a_file():
    assert from_mapping(Coulomb, {"coefficient": 0.6}, "f") == Coulomb(0.6)


def test_frictionless_contact_is_allowed_and_the_law_is_frozen():
    law = Coulomb(0.0)
    assert law.coefficient == 0.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        law.coefficient = 1.0


def test_friction_drops_from_static_to_kinetic_with_the_slip_rate():
    law = StaticKinetic(0.8, 0.3, 2e-3)
    found = law.coefficients(conditions(slip_rate=[0.0, 2e-3, 1.0]))
    np.testing.assert_allclose(found, [0.8, 0.3 + 0.5 / np.e, 0.3])
    assert law.coefficient == 0.8


def test_friction_falls_over_a_slip_distance_and_no_further():
    law = SlipWeakening(0.8, 0.3, 2e-5)
    found = law.coefficients(conditions(slip_since_contact=[0.0, 0.5e-5, 2e-5, 1.0]))
    np.testing.assert_allclose(found, [0.8, 0.675, 0.3, 0.3], rtol=1e-12)
    assert law.coefficient == 0.8
    assert from_mapping(SlipWeakening, {"static": 0.8, "kinetic": 0.3, "distance": "20 um"}, "f") == law
    with pytest.raises(InputError, match=r"SlipWeakening.distance: got 0"):
        SlipWeakening(0.8, 0.3, 0.0)


def test_friction_is_a_power_of_the_pressure_and_stays_finite_at_none():
    law = PressureDependent(0.5, 1e4, -1 / 3)
    found = law.coefficients(conditions(pressure=[8e4, 1e4, 0.0]))
    np.testing.assert_allclose(found, [0.25, 0.5, 0.5 * 100 ** (1 / 3)])


def test_anisotropic_friction_counts_along_its_direction():
    np.testing.assert_array_equal(Anisotropic(0.4, 0.8).coefficients(conditions(slip_rate=[1.0, 1.0])), [0.4, 0.4])
    with pytest.raises(InputError, match="direction"):
        Anisotropic(0.4, 0.8, (0.0, 0.0, 0.0))


def test_isotropic_laws_work_in_the_plane_and_in_space_along_any_tangent():
    laws = (
        Coulomb(0.4),
        StaticKinetic(0.8, 0.3, 2e-3),
        PressureDependent(0.5, 1e4, -1 / 3),
        SlipWeakening(0.8, 0.3, 2e-5),
    )
    for law in laws:
        assert law.dims == (2, 3)
        assert law.frame == TangentFrame(direction=None, stretch=1.0)


def test_an_anisotropic_law_works_in_space_in_a_frame_of_its_own():
    law = Anisotropic(0.4, 0.8, (0.0, 1.0, 0.0))
    assert law.dims == (3,)
    assert law.frame == TangentFrame((0.0, 1.0, 0.0), 2.0)


def test_conditions_at_some_nodes_keep_the_time():
    given = conditions(pressure=[1.0, 2.0, 3.0], slip_rate=[4.0, 5.0, 6.0], slip_since_contact=[7.0, 8.0, 9.0])
    some = given.at(np.array([True, False, True]))
    assert (some.pressure.tolist(), some.slip_rate.tolist(), some.slip_since_contact.tolist()) == (
        [1, 3],
        [4, 6],
        [7, 9],
    )
    assert some.time == given.time
