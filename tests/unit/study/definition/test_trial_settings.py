"""How runs become trials."""

from __future__ import annotations

import pytest

from fingerslip.errors import InputError
from fingerslip.study.definition.settings import TrialSettings


def test_the_length_of_a_pixel():
    assert TrialSettings(view_width=64e-3, width=640).metres_per_pixel == pytest.approx(1e-4)


def test_noise_goes_upwards():
    with pytest.raises(InputError, match=r"noise: goes from 0\.2 to 0\.1"):
        TrialSettings(noise=(0.2, 0.1))
