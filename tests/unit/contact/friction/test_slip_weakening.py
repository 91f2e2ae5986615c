"""Friction that falls over a slip distance."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.contact.friction import (
    SlipWeakening,
)
from fingerslip.errors import InputError
from fingerslip.parameters import from_mapping
from unit.contact.friction.nodes import conditions


def test_friction_falls_over_a_slip_distance_and_no_further():
    law = SlipWeakening(0.8, 0.3, 2e-5)
    found = law.coefficients(conditions(slip_since_contact=[0.0, 0.5e-5, 2e-5, 1.0]))
    np.testing.assert_allclose(found, [0.8, 0.675, 0.3, 0.3], rtol=1e-12)
    assert law.coefficient == 0.8
    assert from_mapping(SlipWeakening, {"static": 0.8, "kinetic": 0.3, "distance": "20 um"}, "f") == law
    with pytest.raises(InputError, match=r"SlipWeakening.distance: got 0"):
        SlipWeakening(0.8, 0.3, 0.0)
