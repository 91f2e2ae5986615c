"""Travel of an object between rigid pads, beside its equation of motion."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.react.closed_form import stop_from, travel_after_ramp, travel_after_step


def integrated(mass: float, latency: float, limit_rate: float, load: tuple[float, float], steps: int = 20000) -> float:
    """Return the travel by the midpoint rule; the load exceeds the limit by load[0] + load[1] t."""
    step, time, speed, travel = 3.0 * latency / steps, 0.0, 0.0, 0.0
    while speed >= 0.0:
        middle = time + step / 2
        force = load[0] + load[1] * middle - limit_rate * max(middle - latency, 0.0)
        travel += step * (speed + step * force / mass / 2)
        speed, time = speed + step * force / mass, time + step
    return travel


def test_travel_is_that_of_the_equation_of_motion() -> None:
    assert travel_after_step(0.2, 0.5, 20.0, 74e-3) == pytest.approx(integrated(0.2, 74e-3, 20.0, (0.5, 0.0)), rel=1e-3)
    assert travel_after_ramp(0.2, 4.0, 20.0, 74e-3) == pytest.approx(integrated(0.2, 74e-3, 20.0, (0.0, 4.0)), rel=1e-3)


@given(latency=st.floats(1e-3, 0.3), more=st.floats(1e-3, 0.1), rate=st.floats(1.0, 19.0))
def test_more_latency_is_more_travel(latency: float, more: float, rate: float) -> None:
    assert travel_after_step(0.2, rate, 20.0, latency) < travel_after_step(0.2, rate, 20.0, latency + more)
    assert travel_after_ramp(0.2, rate, 20.0, latency) < travel_after_ramp(0.2, rate, 20.0, latency + more)


def test_grip_that_grows_no_faster_than_the_load_never_stops_it() -> None:
    assert travel_after_ramp(0.2, 20.0, 20.0, 10e-3) == math.inf
    assert travel_after_ramp(0.2, 20.0, 10.0, 10e-3) == math.inf
    assert travel_after_step(0.2, 0.5, 0.0, 10e-3) == math.inf
    assert stop_from(0.2, 0.1, -1.0, -100.0) == (math.inf, math.inf)


def test_object_at_rest_that_is_held_does_not_travel() -> None:
    assert stop_from(0.2, 0.0, -1.0, 20.0) == (0.0, 0.0)
