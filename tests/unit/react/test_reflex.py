"""Reflexes and actuators: the grip force over time, and the reactions that ship."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.errors import InputError
from fingerslip.react.reflex import REACTIONS, Actuator, Reaction, Reflex

SHAPES: tuple[Literal["ramp", "smooth", "exponential"], ...] = ("ramp", "smooth", "exponential")


@pytest.mark.parametrize("shape", SHAPES)
@given(rate=st.floats(1.0, 200.0), gain=st.floats(0.05, 3.0), start=st.floats(0.0, 0.3))
def test_force_rises_from_the_grip_to_the_gain_and_never_faster_than_the_actuator(
    shape: Literal["ramp", "smooth", "exponential"], rate: float, gain: float, start: float
) -> None:
    response = Reaction(Reflex(gain=gain, shape=shape), Actuator(force_rate=rate)).response(start, 2.0)
    times = np.linspace(0.0, start + 12.0 * 2.0 * gain / rate, 2001)
    forces = np.array([response.force(time) for time in times])
    assert np.all(forces[times <= start] == 2.0)
    assert np.all(np.diff(forces) >= 0.0)
    assert np.diff(forces).max() <= rate * times[1] * (1.0 + 1e-6)
    assert forces[-1] == pytest.approx(2.0 * (1.0 + gain), rel=1e-4)


def test_ramp_is_a_ramp() -> None:
    response = Reaction(Reflex(gain=1.0), Actuator(force_rate=20.0)).response(0.1, 2.0)
    assert [response.force(time) for time in (0.1, 0.125, 0.15, 0.2, 1.0)] == pytest.approx([2.0, 2.5, 3.0, 4.0, 4.0])


def test_largest_force_bounds_the_rise_and_has_to_hold_the_grip() -> None:
    reaction = Reaction(Reflex(gain=5.0), Actuator(largest_force=3.0))
    assert reaction.response(0.0, 2.0).force(10.0) == 3.0
    with pytest.raises(InputError, match=r"^actuator.largest_force: got 3 N, needs at least the grip force, 3.5 N$"):
        reaction.response(0.0, 3.5)


def test_force_that_is_updated_now_and_then_changes_only_then() -> None:
    response = Reaction(Reflex(), Actuator(force_rate=20.0, update_period=20e-3)).response(0.0, 2.0)
    assert [response.force(time) for time in (0.019, 0.020, 0.039, 0.041)] == pytest.approx([2.0, 2.4, 2.4, 2.8])


def test_share_of_trials_within_a_latency_follows_the_jitter() -> None:
    assert [Reflex(latency=0.1).share_within(latency) for latency in (0.09, 0.1)] == [0.0, 1.0]
    assert Reflex(latency=0.1, jitter=0.01).share_within(0.1) == 0.5
    assert Reflex(latency=0.1, jitter=0.01).share_within(0.12) == pytest.approx(0.97725, abs=1e-5)


def test_reactions_that_ship_are_as_published() -> None:
    latencies = {name: REACTIONS.read(name).reflex.latency for name in REACTIONS.names}
    published = {"human-slip": 0.074, "human-skin": 0.09, "robot-piezo": 0.0204, "robot-spiking": 0.085}
    assert published.items() <= latencies.items()
    assert REACTIONS.read("human-slip").reflex.jitter == 0.009
    assert latencies["prosthesis"] == 0.3


@pytest.mark.parametrize("name", REACTIONS.names)
def test_rates_of_force_are_marked_as_assumed(name: str) -> None:
    sources = {row.path: row.source for row in REACTIONS.table(name)}
    assert sources["actuator.force_rate"] == "assumed"
    assert REACTIONS.header(name)["claims_not"]


def test_unknown_reaction_is_refused_with_the_nearest() -> None:
    with pytest.raises(InputError, match=r"^preset: 'human-slips' is not known, .* did you mean 'human-slip'\?$"):
        REACTIONS.read("human-slips")
