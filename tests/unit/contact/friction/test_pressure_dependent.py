"""Friction that is a power of the pressure."""

from __future__ import annotations

import numpy as np

from fingerslip.contact.friction import (
    PressureDependent,
)
from unit.contact.friction.nodes import conditions


def test_friction_is_a_power_of_the_pressure_and_stays_finite_at_none():
    law = PressureDependent(0.5, 1e4, -1 / 3)
    found = law.coefficients(conditions(pressure=[8e4, 1e4, 0.0]))
    np.testing.assert_allclose(found, [0.25, 0.5, 0.5 * 100 ** (1 / 3)])
