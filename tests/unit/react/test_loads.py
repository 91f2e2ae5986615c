"""Loads: forces over time."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.react.loads import GRAVITY, DroppedBall, LoadSeries, RampLoad, StepLoad, load_ramp


def test_ramp_reaches_its_force_at_its_rate() -> None:
    assert RampLoad(rate=4.0, force=2.0).series() == ((0.0, 0.5), (0.0, 2.0))
    assert StepLoad(force=1.0).series() == ((0.0, 1e-3), (0.0, 1.0))


def test_pulse_of_a_ball_has_its_momentum_then_its_weight() -> None:
    times, forces = map(np.array, DroppedBall(mass=0.06, height=0.1).series())
    pulse = forces - 0.06 * GRAVITY * times / times[-1]
    assert np.trapezoid(pulse, times) == pytest.approx(0.06 * np.sqrt(2 * GRAVITY * 0.1))
    assert forces[-1] == pytest.approx(0.06 * GRAVITY)


def test_load_begins_when_it_is_told_to() -> None:
    ramp = load_ramp(RampLoad(rate=4.0, force=2.0), 0.35)
    assert [ramp.at(time) for time in (0.3, 0.35, 0.6, 2.0)] == pytest.approx([0.0, 0.0, 1.0, 2.0])


@pytest.mark.parametrize(
    ("times", "forces"), [((), ()), ((0.0, 1.0), (1.0,)), ((0.1, 1.0), (0.0, 1.0)), ((0.0, 0.0), (0.0, 1.0))]
)
def test_series_needs_ascending_times_from_zero(times: tuple[float, ...], forces: tuple[float, ...]) -> None:
    with pytest.raises(InputError, match=r"needs ascending times from 0 s on, a force for each$"):
        LoadSeries(times, forces)
