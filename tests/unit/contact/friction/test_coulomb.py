"""Coulomb's law: its coefficient."""

from __future__ import annotations

import dataclasses

import pytest

from fingerslip.contact.friction import (
    Coulomb,
)
from fingerslip.errors import InputError
from fingerslip.parameters import from_mapping


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
