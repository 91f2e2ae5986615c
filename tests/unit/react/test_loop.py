"""The loop: open, closed by branches, and closed by a run of its own."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerslip.dynamics.steering.steering import Simulation
from fingerslip.errors import InputError
from fingerslip.model.model import Contact
from fingerslip.react.detectors import AtOnce, ForceRatio, Never, SlippedArea
from fingerslip.react.loads import RampLoad, StepLoad
from fingerslip.react.loop import Grasp
from fingerslip.react.reflex import Actuator, Reaction, Reflex
from fingerslip.react.reflex import reaction as shipped
from fingerslip.react.run import critical_start, search_edge
from fingerslip.react.scenario import HeldObject, holder_of
from fingerslip.specimens.tactip.tactip import PRESETS, SensorSectionSizes
from places import DOCS, run_page
from unit.pads import pad

HELD = HeldObject(load=RampLoad(rate=8.0, force=2.0), margin=0.3, settle=0.15, rest=0.02, after=0.3, step=2e-3)
DETECTORS = {
    "at once": AtOnce(),
    "force": ForceRatio(friction=0.6, share=0.95),
    "late": ForceRatio(friction=0.6, share=0.95, delay=10e-3),
    "area": SlippedArea(fraction=0.5),
    "never": Never(),
}
FAST = Actuator(force_rate=50.0)


def reaction(latency, **reflex):
    return Reaction(Reflex(latency=latency, **reflex), FAST)


@pytest.fixture(scope="module")
def grasp():
    with Grasp(HELD, pad(), DETECTORS) as held:
        yield held


def test_open_loop_is_lost_after_the_limit_and_is_what_comes_of_no_alarm_and_of_an_endless_latency(grasp):
    loop = grasp.open_loop
    alarms = {name: alarm.time for name, alarm in loop.alarms.items() if alarm is not None}
    assert loop.alarms["never"] is None
    assert alarms["at once"] == 0.0 < alarms["force"] < loop.gross < loop.lost
    # A deformable pad follows the load a little late.
    assert abs(loop.gross - HELD.time_to_limit) < 15e-3
    assert loop.lead("force") == loop.gross - alarms["force"] > 0.0
    assert loop.lead("never") is None
    assert loop.travel[-2] <= HELD.travel_limit < loop.travel[-1]
    for outcome in (grasp.react(reaction(0.0), "never"), grasp.react(reaction(1e3), "force")):
        assert (outcome.start, outcome.saved) == (None, False)
        assert np.array_equal(outcome.travels, loop.travel)


@pytest.mark.parametrize("latency", [0.0, 11.3e-3, 0.06])
def test_branch_is_what_a_run_of_its_own_gives_to_the_last_bit_up_to_its_decision(grasp, latency):
    check_branch(grasp, latency)


def check_branch(grasp, latency):
    """Compare a branch with the history of a whole run under the same response."""
    response = grasp.response_to(reaction(latency), "force")
    branch, history = grasp.branch(response), grasp.history(response)
    first = round(HELD.begins / HELD.step)
    positions = history["rigid_body_displacement"].values[:, 0, 0]
    travels = positions - positions[first]
    assert history["time"].values[-1] - HELD.begins == pytest.approx(branch.end)
    assert np.array_equal(branch.travels, travels[-branch.travels.size :])
    assert branch.travel == travels[first:].max()
    slips = history["slip_distance"].values
    assert branch.largest_slip == (slips[-1] - slips[first]).max()
    assert branch.saved == (travels[-1] <= HELD.travel_limit)
    assert branch.grip == max(map(response.force, branch.times.tolist()))


def test_quick_reflex_saves_and_slow_one_loses_and_one_that_counts_from_the_load_needs_no_alarm(grasp):
    quick, slow = grasp.react(reaction(10e-3), "force"), grasp.react(reaction(0.15), "force")
    assert (quick.saved, slow.saved, quick.false_grip) == (True, False, False)
    assert quick.travel < 2e-3 < slow.travel
    assert quick.largest_slip < slow.largest_slip
    assert quick.grip_added == quick.grip - HELD.first_grip > 0.0
    assert quick.start == pytest.approx(grasp.open_loop.alarms["force"].time + 10e-3)
    outcome = grasp.react(reaction(30e-3, since="load"), "never")
    assert (outcome.start, outcome.saved) == (30e-3, True)
    assert len(repr(outcome)) < 250, "it is printed without its arrays"


@pytest.mark.slow
def test_object_is_held_in_3d_by_the_same_loop():
    with Grasp(HELD, pad(cells=4, dim=3), DETECTORS) as solid:
        # Friction across the load, against the pad's own spreading, takes a part of what there is.
        assert solid.open_loop.gross == pytest.approx(HELD.time_to_limit, abs=15e-3)
        assert [solid.react(reaction(latency), "force").saved for latency in (10e-3, 0.15)] == [True, False]
        check_branch(solid, 11.3e-3)


def test_memory_of_a_run_is_given_back_when_it_is_over(grasp):
    gc.disable()
    try:
        with Simulation(grasp.model, threads=1) as simulation:
            recorder = weakref.ref(simulation.observation.recorder)
        del simulation
        assert recorder() is None, "something in a ring keeps it, and with it the factors"
    finally:
        gc.enable()


@pytest.mark.slow
def test_latency_is_never_rounded_to_steps(grasp):
    travels = [grasp.react(reaction(latency), "force").travel for latency in (40e-3, 40.5e-3, 41e-3, 41.5e-3, 42e-3)]
    steps = np.diff(travels)
    assert np.all(steps > 0.0)
    assert steps.max() < 1.5 * steps.min()


@pytest.mark.slow
@settings(max_examples=8, deadline=None)
@given(latency=st.floats(HELD.step, 0.15), more=st.floats(1e-4, 0.1), shape=st.sampled_from(["ramp", "smooth"]))
def test_no_latency_saves_what_a_shorter_one_loses_nor_travels_less(grasp, latency, more, shape):
    short, long = (grasp.react(reaction(time, shape=shape), "force") for time in (latency, latency + more))
    assert short.saved or not long.saved
    # A lost object is followed to the first step beyond the limit, which may be further beyond it for the shorter one.
    assert not short.saved or short.largest_slip <= long.largest_slip + 1e-6
    assert not long.saved or short.travel < long.travel + 1e-9


@pytest.mark.slow
def test_critical_start_converges_with_step_and_mesh(grasp):
    def start(step, cells):
        with Grasp(replace(HELD, step=step), pad(cells=cells), DETECTORS) as other:
            return critical_start(other, reaction(0.0), tolerance=0.2e-3).time

    middle = critical_start(grasp, reaction(0.0), tolerance=0.2e-3).time
    assert abs(start(4e-3, 10) - middle) < 2e-3
    assert abs(middle - start(1e-3, 10)) < 1e-3
    assert abs(start(2e-3, 5) - middle) < 2e-3
    assert abs(middle - start(2e-3, 20)) < 1e-3


def test_critical_latency_is_the_edge_between_saved_and_lost(grasp):
    critical = critical_start(grasp, reaction(0.0))
    latency = critical.latency(grasp, "force")
    assert 0.0 < critical.error <= 1e-3 * (1 + 1e-6)
    assert grasp.react(reaction(latency), "force").saved
    assert not grasp.react(reaction(latency + critical.error), "force").saved
    assert critical.latency(grasp, "late") == pytest.approx(latency - 10e-3)
    assert critical.latency(grasp, "never") is None
    weak = Reaction(Reflex(gain=0.05), FAST)
    assert not grasp.react(weak, "at once").saved
    assert critical_start(grasp, weak, tolerance=20e-3).time is None, "it adds too little at any latency"


@pytest.mark.slow
def test_mirror_images_agree():
    images = []
    for direction in (1, -1):
        with Grasp(replace(HELD, direction=direction), pad(), DETECTORS) as image:
            alarms = [alarm and alarm.time for alarm in image.open_loop.alarms.values()]
            images.append((alarms, image.react(reaction(20e-3), "force").travel))
    (alarms, travel), (other_alarms, other_travel) = images
    assert alarms == other_alarms
    assert travel == pytest.approx(other_travel, rel=1e-7)


def test_object_that_would_be_held_anyway_makes_a_false_grip():
    with Grasp(replace(HELD, load=StepLoad(force=0.3)), pad(), {"at once": AtOnce()}) as grasp:
        outcome = grasp.react(reaction(10e-3), "at once")
        assert grasp.open_loop.lost is None
        assert (outcome.false_grip, outcome.saved) == (True, True)
        assert critical_start(grasp, reaction(0.0)).latency(grasp, "at once") == np.inf


WHOLE = "reflex.latency: got 0.001 s, needs 0 s or at least a step, 0.002 s; take a shorter step"


@pytest.mark.parametrize(
    ("react", "message"),
    [
        (lambda grasp: grasp.react(reaction(1e-3), "force"), WHOLE),
        (lambda grasp: grasp.react(reaction(0.0), "touch"), "got 'touch', needs one of at once, force, late, area, "),
        (
            lambda grasp: grasp.branch(reaction(0.0).response(-0.01, HELD.first_grip)),
            "response.start: got -0.01 s, needs 0 s or more since the load began",
        ),
    ],
)
def test_reaction_that_cannot_be_computed_is_refused(grasp, react, message):
    with pytest.raises(InputError) as caught:
        react(grasp)
    assert str(caught.value).removeprefix("detector: ").startswith(message)


@pytest.mark.parametrize("edge", [0.0, 0.013, 0.5, 0.77, 0.9995])
@pytest.mark.parametrize("guess", [0.0, 0.5, 0.9, 1.0])
def test_search_finds_the_edge_from_any_guess_and_says_where_there_is_none(edge, guess):
    asked = []

    def saves(number):
        asked.append(number)
        return number <= edge

    number, error = search_edge(saves, 0.0, 1.0, guess, 1e-3)
    assert number <= edge < number + error + 1e-12
    assert error <= 1e-3 * (1 + 1e-6)
    assert len(asked) < 25
    assert search_edge(lambda _: False, 0.0, 1.0, guess, 1e-3) == (None, 0.0)


@pytest.mark.slow
def test_page_on_reactions_runs_as_it_is_printed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = run_page(DOCS / "reaction.md")
    assert (names["human"].saved, names["slow"].saved) == (True, False)


@pytest.mark.slow
def test_ridges_give_a_sensor_time():
    held = HeldObject(mass=0.1, load=RampLoad(rate=4.0, force=1.0), step=2e-3)
    sizes, latencies = SensorSectionSizes(contact_size=0.4e-3, bulk_size=1.5e-3), []
    contact = Contact("contact", normal_penalty=5e9, tangential_penalty=5e9, search_distance=6e-3)
    for skin in ("ridged", "smooth"):
        sensor = holder_of(PRESETS.read(f"tactip-{skin}-2d"), sizes, contact=contact, depth=20e-3)
        with Grasp(held, sensor, {"noticed": SlippedArea(0.48)}) as grasp:
            latencies.append(critical_start(grasp, shipped("human-slip")).latency(grasp, "noticed") or 0.0)
    assert latencies == pytest.approx([128e-3, 47e-3], abs=2e-3)
