"""The loop: open, closed by branches, and closed by a run of its own."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerslip.dynamics.steering.steering import Simulation
from fingerslip.errors import InputError
from fingerslip.react.detectors import AtOnce, ForceRatio, Never, SlippedArea
from fingerslip.react.latency import critical_start, search_edge
from fingerslip.react.loads import RampLoad, StepLoad
from fingerslip.react.loop import Grasp
from fingerslip.react.moment import Detector
from fingerslip.react.reflex import Actuator, Reaction, Reflex
from fingerslip.react.scenario import HeldObject
from unit.pads import pad

HELD = HeldObject(load=RampLoad(rate=8.0, force=2.0), margin=0.3, settle=0.15, rest=0.02, after=0.3, step=2e-3)
DETECTORS: dict[str, Detector] = {
    "at once": AtOnce(),
    "force": ForceRatio(friction=0.6, share=0.95),
    "late": ForceRatio(friction=0.6, share=0.95, delay=10e-3),
    "area": SlippedArea(fraction=0.5),
    "never": Never(),
}
FAST = Actuator(force_rate=50.0)


def reaction(latency: float) -> Reaction:
    return Reaction(Reflex(latency=latency), FAST)


@pytest.fixture(scope="module")
def grasp() -> Iterator[Grasp]:
    with Grasp(HELD, pad(), DETECTORS) as held:
        yield held


def test_open_loop_is_lost_after_the_limit(grasp: Grasp) -> None:
    loop = grasp.open_loop
    limit = HELD.time_to_limit
    assert loop.lost is not None
    assert loop.gross is not None
    assert limit is not None
    assert loop.alarms["never"] is None
    alarms = {name: alarm.time for name, alarm in loop.alarms.items() if alarm is not None}
    assert alarms["at once"] == 0.0 < alarms["force"] < loop.gross < loop.lost
    # A deformable pad follows the load a little late.
    assert abs(loop.gross - limit) < 15e-3
    lead = loop.lead("force")
    assert lead is not None
    assert lead == loop.gross - alarms["force"] > 0.0
    assert loop.lead("never") is None
    assert loop.travel[-2] <= HELD.travel_limit < loop.travel[-1]


@pytest.mark.parametrize("latency", [0.0, 11.3e-3, 0.06])
def test_branch_is_what_a_run_of_its_own_gives_to_the_last_bit(grasp: Grasp, latency: float) -> None:
    start = grasp.start_of(reaction(latency), "force")
    assert start is not None
    response = reaction(latency).response(start, HELD.first_grip)
    branch, whole = grasp.branch(response), grasp.whole(response)
    assert np.array_equal(branch.travels, whole.travels[-branch.travels.size :])
    for name in ("saved", "travel", "largest_slip", "grip", "end"):
        assert getattr(branch, name) == getattr(whole, name), name


def test_quick_reflex_saves_and_slow_one_loses(grasp: Grasp) -> None:
    quick, slow = grasp.react(reaction(10e-3), "force"), grasp.react(reaction(0.15), "force")
    assert quick.saved
    assert not slow.saved
    assert quick.travel < 2e-3 < slow.travel
    assert quick.largest_slip < slow.largest_slip
    assert quick.grip_added == quick.grip - HELD.first_grip > 0.0
    assert quick.start == pytest.approx(grasp.open_loop.alarms["force"].time + 10e-3)  # type: ignore[union-attr]
    assert not quick.false_grip


def test_object_is_held_in_3d_by_the_same_loop() -> None:
    with Grasp(HELD, pad(cells=4, dim=3), DETECTORS) as solid:
        # Friction across the load, against the pad's own spreading, takes a part of what there is.
        assert solid.open_loop.gross == pytest.approx(HELD.time_to_limit, abs=15e-3)
        assert [solid.react(reaction(latency), "force").saved for latency in (10e-3, 0.15)] == [True, False]
        start = solid.start_of(reaction(11.3e-3), "force")
        response = reaction(11.3e-3).response(start or 0.0, HELD.first_grip)
        branch, whole = solid.branch(response), solid.whole(response)
        assert np.array_equal(branch.travels, whole.travels[-branch.travels.size :])


def test_detector_that_never_speaks_and_an_endless_latency_are_the_open_loop(grasp: Grasp) -> None:
    for outcome in (grasp.react(reaction(0.0), "never"), grasp.react(reaction(1e3), "force")):
        assert outcome.start is None
        assert not outcome.saved
        assert np.array_equal(outcome.travels, grasp.open_loop.travel)


def test_memory_of_a_run_is_given_back_when_it_is_over(grasp: Grasp) -> None:
    gc.disable()
    try:
        with Simulation(grasp.model, threads=1) as simulation:
            recorder = weakref.ref(simulation.observation.recorder)
        del simulation
        assert recorder() is None, "something in a ring keeps it, and with it the factors"
    finally:
        gc.enable()


def test_latency_is_never_rounded_to_steps(grasp: Grasp) -> None:
    travels = [grasp.react(reaction(latency), "force").travel for latency in (40e-3, 40.5e-3, 41e-3, 41.5e-3, 42e-3)]
    steps = np.diff(travels)
    assert np.all(steps > 0.0)
    assert steps.max() < 1.5 * steps.min()


def test_more_latency_never_saves_more_nor_travels_less(grasp: Grasp) -> None:
    outcomes = [grasp.react(reaction(latency), "force") for latency in np.linspace(0.0, 0.14, 12)]
    assert np.all(np.diff([int(outcome.saved) for outcome in outcomes]) <= 0)
    travels = np.array([outcome.travel for outcome in outcomes if outcome.saved])
    assert np.all(np.diff(travels) > -1e-9)


@settings(max_examples=8, deadline=None)
@given(latency=st.floats(HELD.step, 0.15), more=st.floats(1e-4, 0.1), shape=st.sampled_from(["ramp", "smooth"]))
def test_no_latency_saves_what_a_shorter_one_loses(
    grasp: Grasp, latency: float, more: float, shape: Literal["ramp", "smooth"]
) -> None:
    short, long = (
        grasp.react(Reaction(Reflex(latency=time, shape=shape), FAST), "force") for time in (latency, latency + more)
    )
    assert short.saved or not long.saved
    assert short.largest_slip <= long.largest_slip + 1e-6


@pytest.mark.parametrize(("steps", "cells"), [((4e-3, 2e-3, 1e-3), (10, 10, 10)), ((2e-3, 2e-3, 2e-3), (5, 10, 20))])
def test_critical_start_converges_with_step_and_mesh(steps: tuple[float, ...], cells: tuple[int, ...]) -> None:
    times = []
    for step, count in zip(steps, cells, strict=True):
        with Grasp(replace(HELD, step=step), pad(cells=count), DETECTORS) as grasp:
            times.append(critical_start(grasp, reaction(0.0), tolerance=0.2e-3).time)
    coarse, middle, fine = times
    assert coarse is not None
    assert middle is not None
    assert fine is not None
    assert abs(coarse - middle) < 2e-3
    assert abs(middle - fine) < 1e-3


def test_critical_latency_is_the_edge_between_saved_and_lost(grasp: Grasp) -> None:
    critical = critical_start(grasp, reaction(0.0))
    latency = critical.latency(grasp, "force")
    assert latency is not None
    assert 0.0 < critical.error <= 1e-3 * (1 + 1e-6)
    assert grasp.react(reaction(latency), "force").saved
    assert not grasp.react(reaction(latency + critical.error), "force").saved
    late, never = (critical.latency(grasp, name) for name in ("late", "never"))
    assert late == pytest.approx(latency - 10e-3)
    assert never is None


def test_mirror_images_agree() -> None:
    images = []
    for direction in (1, -1):
        with Grasp(replace(HELD, direction=direction), pad(), DETECTORS) as image:
            images.append((image.open_loop, image.react(reaction(20e-3), "force")))
    (loop, outcome), (other_loop, other) = images
    for alarm, other_alarm in zip(loop.alarms.values(), other_loop.alarms.values(), strict=True):
        assert (alarm and alarm.time) == (other_alarm and other_alarm.time)
    assert outcome.travel == pytest.approx(other.travel, rel=1e-7)


def test_object_that_would_be_held_anyway_makes_a_false_grip() -> None:
    held = replace(HELD, load=StepLoad(force=0.3))
    with Grasp(held, pad(), {"at once": AtOnce()}) as grasp:
        outcome = grasp.react(reaction(10e-3), "at once")
        assert grasp.open_loop.lost is None
        assert outcome.false_grip
        assert outcome.saved
        assert critical_start(grasp, reaction(0.0)).latency(grasp, "at once") == np.inf


def test_reflex_that_counts_from_the_load_needs_no_alarm(grasp: Grasp) -> None:
    outcome = grasp.react(Reaction(Reflex(latency=30e-3, since="load"), FAST), "never")
    assert outcome.start == 30e-3
    assert outcome.saved
    with pytest.raises(InputError, match=r"^response.start: got -0.01 s, needs 0 s or more since the load began$"):
        grasp.branch(reaction(0.0).response(-0.01, HELD.first_grip))


def test_grip_that_adds_too_little_loses_at_any_latency(grasp: Grasp) -> None:
    weak = Reaction(Reflex(gain=0.05), FAST)
    assert not grasp.react(weak, "at once").saved
    assert critical_start(grasp, weak, tolerance=20e-3).time is None


@pytest.mark.parametrize(
    ("latency", "detector", "message"),
    [
        (1e-3, "force", "reflex.latency: got 0.001 s, needs 0 s or at least a step, 0.002 s; take a shorter step"),
        (0.0, "touch", "detector: got 'touch', needs one of at once, force, late, area, never"),
    ],
)
def test_reaction_that_cannot_be_computed_is_refused(grasp: Grasp, latency: float, detector: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        grasp.react(reaction(latency), detector)
    assert str(caught.value) == message


def test_history_of_a_response_ends_with_its_decision(grasp: Grasp) -> None:
    response = reaction(0.0).response(0.05, HELD.first_grip)
    history, outcome = grasp.history(response), grasp.branch(response)
    assert history["time"].values[-1] - HELD.begins == pytest.approx(outcome.end)
    place = history["rigid_body_displacement"].values[:, 0, 0]
    first = round(HELD.begins / HELD.step)
    assert (place - place[first])[first:].max() == outcome.travel


@pytest.mark.parametrize("edge", [0.0, 0.013, 0.5, 0.77, 0.9995])
@pytest.mark.parametrize("guess", [0.0, 0.5, 0.9, 1.0])
def test_search_finds_the_edge_from_any_guess(edge: float, guess: float) -> None:
    asked = []

    def saves(number: float) -> bool:
        asked.append(number)
        return number <= edge

    number, error = search_edge(saves, 0.0, 1.0, guess, 1e-3)
    assert number is not None
    assert number <= edge < number + error + 1e-12
    assert error <= 1e-3 * (1 + 1e-6)
    assert len(asked) < 25


def test_search_says_where_nothing_is_saved() -> None:
    assert search_edge(lambda _: False, 0.0, 1.0, 0.4, 1e-3) == (None, 0.0)
