"""Friction with an elliptic cone."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.contact.friction import (
    Anisotropic,
    TangentFrame,
)
from fingerslip.errors import InputError
from unit.contact.friction.nodes import conditions


def test_anisotropic_friction_counts_along_its_direction():
    np.testing.assert_array_equal(Anisotropic(0.4, 0.8).coefficients(conditions(slip_rate=[1.0, 1.0])), [0.4, 0.4])
    with pytest.raises(InputError, match="direction"):
        Anisotropic(0.4, 0.8, (0.0, 0.0, 0.0))


def test_an_anisotropic_law_works_in_space_in_a_frame_of_its_own():
    law = Anisotropic(0.4, 0.8, (0.0, 1.0, 0.0))
    assert law.dims == (3,)
    assert law.frame == TangentFrame((0.0, 1.0, 0.0), 2.0)
