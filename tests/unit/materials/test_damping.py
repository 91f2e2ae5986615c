"""Rayleigh damping: off unless asked for, never negative."""

from __future__ import annotations

import pytest

from fingerslip.errors import InputError
from fingerslip.materials.elastic import RayleighDamping


def test_damping_is_none_unless_asked_for_and_never_negative():
    assert RayleighDamping() == RayleighDamping(0.0, 0.0)
    with pytest.raises(InputError, match=r"RayleighDamping.stiffness"):
        RayleighDamping(stiffness=-1e-3)
    with pytest.raises(InputError, match=r"RayleighDamping.mass"):
        RayleighDamping(mass=-1.0)
