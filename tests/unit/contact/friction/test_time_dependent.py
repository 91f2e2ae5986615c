"""Friction that changes over time."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fingerslip.contact.friction import (
    TimeDependent,
)
from fingerslip.contact.states import SLIP
from fingerslip.errors import InputError
from fingerslip.parameters import from_mapping
from fingerslip.verification.blocks import drag_block
from unit.contact.friction.nodes import conditions


@pytest.mark.parametrize(("time", "expected"), [(0.0, 0.6), (1.0, 0.6), (1.5, 0.45), (2.0, 0.3), (9.0, 0.3)])
def test_the_coefficient_is_linear_between_times_and_constant_beyond(time, expected):
    law = TimeDependent((1.0, 2.0), (0.6, 0.3))
    given = dataclasses.replace(conditions(pressure=[1e3, 2e3]), time=time)
    np.testing.assert_allclose(law.coefficients(given), [expected, expected], rtol=1e-12)
    assert law.coefficient == 0.6


def test_times_have_units_in_a_file():
    values = {"times": ["0 s", "500 ms"], "values": [0.6, 0.3]}
    assert from_mapping(TimeDependent, values, "f") == TimeDependent((0.0, 0.5), (0.6, 0.3))


@pytest.mark.parametrize(
    ("times", "values", "message"),
    [
        ((), (), r"TimeDependent.times: got \[\], needs ascending times"),
        ((1.0, 1.0), (0.5, 0.5), r"TimeDependent.times: got \[1.0, 1.0\], needs ascending times"),
        ((0.0, 1.0), (0.5,), r"TimeDependent.values: got 1 for 2 times"),
        ((0.0,), (-0.5,), r"TimeDependent.values.*-0.5"),
    ],
)
def test_times_and_values_have_to_fit(times, values, message):
    with pytest.raises(InputError, match=message):
        TimeDependent(times, values)


def test_a_sliding_block_follows_the_coefficient():
    """Pressed and dragged steadily, friction over normal force is the coefficient at the end of every step."""
    law = TimeDependent((0.0, 0.5, 1.0), (0.5, 0.5, 0.2))
    history = drag_block("Q4", law, speed=1e-3, travel=1e-3)
    sliding = (history["contact_state"].values == SLIP).all(axis=1)
    assert sliding.sum() > 20
    force = history["counterface_force"].values[sliding, 0]
    expected = np.interp(history["time"].values[sliding], law.times, law.values)
    np.testing.assert_allclose(np.abs(force[:, 0] / force[:, 1]), expected, rtol=1e-9)
