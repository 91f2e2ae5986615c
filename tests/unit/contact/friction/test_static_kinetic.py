"""Friction that drops with the slip rate."""

from __future__ import annotations

import numpy as np

from fingerslip.contact.friction import (
    StaticKinetic,
)
from unit.contact.friction.nodes import conditions


def test_friction_drops_from_static_to_kinetic_with_the_slip_rate():
    law = StaticKinetic(0.8, 0.3, 2e-3)
    found = law.coefficients(conditions(slip_rate=[0.0, 2e-3, 1.0]))
    np.testing.assert_allclose(found, [0.8, 0.3 + 0.5 / np.e, 0.3])
    assert law.coefficient == 0.8
