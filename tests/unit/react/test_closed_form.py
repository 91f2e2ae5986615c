"""Travel of an object between rigid pads, beside its equation of motion."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.react.scenario import travel_after


def integrated(mass: float, latency: float, limit_rate: float, load: tuple[float, float], steps: int = 20000) -> float:
    """Return the travel by the midpoint rule; the load exceeds the limit by load[0] + load[1] t."""
    step, time, speed, travel = 3.0 * latency / steps, 0.0, 0.0, 0.0
    while speed >= 0.0:
        middle = time + step / 2
        force = load[0] + load[1] * middle - limit_rate * max(middle - latency, 0.0)
        travel += step * (speed + step * force / mass / 2)
        speed, time = speed + step * force / mass, time + step
    return travel


@pytest.mark.parametrize("load", [(0.5, 0.0), (0.0, 4.0), (0.5, 4.0)])
def test_travel_is_that_of_the_equation_of_motion(load: tuple[float, float]) -> None:
    travel = travel_after(0.2, 74e-3, 20.0, excess=load[0], load_rate=load[1])
    assert travel == pytest.approx(integrated(0.2, 74e-3, 20.0, load), rel=1e-3)


@given(latency=st.floats(1e-3, 0.3), more=st.floats(1e-3, 0.1), rate=st.floats(1.0, 19.0))
def test_more_latency_is_more_travel(latency: float, more: float, rate: float) -> None:
    for load in ({"excess": rate}, {"load_rate": rate}):
        assert travel_after(0.2, latency, 20.0, **load) < travel_after(0.2, latency + more, 20.0, **load)


@pytest.mark.parametrize(("limit_rate", "load"), [(20.0, (0.0, 20.0)), (10.0, (0.0, 20.0)), (0.0, (0.5, 0.0))])
def test_grip_that_grows_no_faster_than_the_load_never_stops_it(limit_rate: float, load: tuple[float, float]) -> None:
    assert travel_after(0.2, 10e-3, limit_rate, excess=load[0], load_rate=load[1]) == math.inf
