"""Slip events of histories whose slip is known exactly."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.contact.states import OPEN, SLIP
from fingerslip.slip import EventSettings, acceleration_events, measures, read_measures
from fingerslip.slip.events import displacement_events, events_from_mapping, events_mapping, find_slip, slip_events
from fingerslip.slip.windows import READINGS, TIMES
from unit.synthetic import HALF_WIDTH, PRESS_END, SPEED, Process, make, slip_times
from unit.whole_result import MADE

QUIET = Process(jump=False, nodes=401)
HISTORY = make(Process(nodes=41, noise=1.0))
NAMES = ("incipient", "noticed", "three_quarter", "overall")


def expected(process, fraction, tolerance):
    """Return when that fraction of the flat patch has slipped by the tolerance."""
    return process.edge + fraction * (process.centre - process.edge) + tolerance / SPEED


@pytest.mark.parametrize("step", [1e-3, 5e-3, 10e-3])
@pytest.mark.parametrize("friction_moments", [(1.3, 1.71), (1.02, 1.2), (1.4, 1.9)])
def test_known_slip_times_are_found_to_one_step_and_displacement_counts_nodes(step, friction_moments):
    process = replace(QUIET, step=step, edge=friction_moments[0], centre=friction_moments[1])
    found = slip_events(make(process), EventSettings())
    for name, fraction in zip(NAMES, (0.10, 0.48, 0.75, 0.995), strict=True):
        assert getattr(found, name) == pytest.approx(expected(process, fraction, 20e-6), abs=step + 3e-3)
    moments = np.sort(slip_times(process, np.linspace(-HALF_WIDTH, HALF_WIDTH, 41))) + 50e-6 / SPEED
    found = displacement_events(make(replace(process, nodes=41)), EventSettings())
    for name, rank in zip(NAMES, (1, 20, 31, 41), strict=True):
        assert getattr(found, name) == pytest.approx(moments[rank - 1], abs=step)


def test_jump_of_velocity_is_no_slip_event_and_moves_others_by_no_more_than_its_step():
    history = make(Process(step=1e-3))
    just_after = history["contact_state"].sel(time=PRESS_END + 1e-3, method="nearest")
    assert (just_after[:41] == SLIP).all(), "the whole patch has to slip for an instant, or this test shows nothing"
    with_jump, without = fs.find_events(history), fs.find_events(make(Process(step=1e-3, jump=False)))
    assert with_jump.displacement.incipient > 1.3
    for name in NAMES:
        assert getattr(with_jump.slip, name) == pytest.approx(getattr(without.slip, name), abs=1.02e-3)


@pytest.mark.parametrize("every", [2, 4, 5, 8])
def test_event_times_do_not_depend_on_the_records(every):
    """Between two records the slip of a node grows evenly; that of one node after the other passes the tolerance."""
    history = make(replace(QUIET, step=1e-3, nodes=41))
    sparse = history.isel(time=slice(None, None, every))
    assert_same(fs.find_events(sparse), fs.find_events(history), ("slip", "displacement"))


def test_a_stuck_node_slips_when_it_lifts_off_and_one_that_rolls_onto_the_plate_is_not_waited_for():
    """The central node sticks; it lifts off a third of the way between two records."""
    history = make(QUIET)
    state, gap, slip = (history[name].copy() for name in ("contact_state", "gap", "slip_distance"))
    slip[:, 200] = 0.0
    state[380:, 200] = OPEN
    gap[380:, 200] = 2e-6
    lifted = history.assign(contact_state=state, gap=gap, slip_distance=slip)
    everyone = EventSettings(overall_fraction=1.0)
    assert slip_events(lifted, everyone).overall == pytest.approx(379 * 5e-3 + 5e-3 / 3)
    history = make(Process())
    state = history["contact_state"].copy()
    state[300:, 41:] = 1
    assert slip_events(history.assign(contact_state=state), EventSettings()) == slip_events(history, EventSettings())


def test_what_does_not_happen_in_a_slide_and_without_slip_slide_or_contact_is_none():
    events = fs.find_events(make(Process(centre=2.5)))
    assert events.slip.incipient is not None
    assert (events.slip.overall, events.displacement.overall, events.acceleration.overall) == (None, None, None)
    assert events.latency is None
    plain = json.loads(json.dumps(events_mapping(events)))
    assert (plain["slip"]["overall"], plain["displacement"]["latency"]) == (None, None)
    assert events_from_mapping(plain) == events
    stuck = fs.find_events(make(Process(edge=3.0, centre=4.0, peaks={})))
    pressed = fs.find_events(make(Process(phases=(("press", 0.0, 1.0), ("hold", 1.0, 2.0)))))
    history = make(Process(peaks={}))
    apart = fs.find_events(history.assign(contact_state=xr.full_like(history["contact_state"], OPEN)))
    assert stuck == pressed == apart == fs.Events()


def test_slip_before_the_second_slide_does_not_count_in_it():
    phases = (("press", 0.0, 1.0), ("slide", 1.0, 1.8), ("hold", 1.8, 1.9), ("slide", 1.9, 2.0))
    history = make(Process(phases=phases))
    first, second = fs.find_events(history), fs.find_events(history, slide=1)
    assert first.overall == pytest.approx(1.72, abs=0.01)
    assert second.incipient == pytest.approx(1.9 + 20e-6 / SPEED, abs=5e-3)


@settings(max_examples=25, deadline=None)
@given(st.permutations(range(45)))
def test_order_of_nodes_does_not_matter(order):
    assert_same(fs.find_events(HISTORY.isel(contact_node=order)), fs.find_events(HISTORY))


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 30))
def test_open_nodes_do_not_matter(count):
    assert_same(fs.find_events(make(Process(open_nodes=count, noise=0.0))), fs.find_events(make(Process(noise=0.0))))


@settings(max_examples=25, deadline=None)
@given(st.floats(5e-6, 3e-4), st.floats(5e-6, 3e-4))
def test_larger_tolerance_is_never_reached_earlier(one, other):
    low, high = (
        fs.find_events(HISTORY, EventSettings(slip_tolerance=level, displacement_tolerance=level))
        for level in sorted((one, other))
    )
    for reading in ("slip", "displacement"):
        for name in NAMES:
            early, late = low.reading(reading).time(name), high.reading(reading).time(name)
            assert late is None or early <= late + 1e-12


@settings(max_examples=25, deadline=None)
@given(st.floats(0.01, 1.0), st.floats(0.01, 1.0))
def test_larger_fraction_is_never_reached_earlier(one, other):
    early, late = (
        slip_events(HISTORY, EventSettings(incipient_fraction=fraction)).incipient for fraction in sorted((one, other))
    )
    assert late is None or (early is not None and early <= late + 1e-12)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.0, 2.0))
def test_noise_moves_no_event_by_more_than_two_steps(seed, noise):
    quiet, noisy = fs.find_events(make(Process())), fs.find_events(make(Process(noise=noise, seed=seed)))
    for reading in ("slip", "displacement"):
        for name in NAMES:
            assert noisy.reading(reading).time(name) == pytest.approx(quiet.reading(reading).time(name), abs=0.01)
    assert noisy.acceleration.overall == pytest.approx(1.71, abs=0.01)


def test_latency_is_that_of_accumulated_slip_and_receptors_that_were_not_recorded_are_told_from_no_event():
    events, silent = fs.find_events(HISTORY), fs.find_events(HISTORY.drop_dims("site"))
    assert [getattr(events, time) for time in TIMES] == [events.slip.time(time) for time in TIMES]
    assert events.latency == pytest.approx(0.895 * 0.41, abs=12e-3)
    assert events.reading("displacement") is events.displacement
    assert fs.SlipEvents(incipient=1.0).latency is fs.SlipEvents(overall=1.0).latency is None
    assert fs.SlipEvents(incipient=1.25, overall=1.75).latency == 0.5
    assert silent.acceleration == fs.SlipEvents(recorded=False)
    deep = fs.find_events(HISTORY.isel(site=HISTORY["site_kind"].values == "FA-II"))
    assert not deep.acceleration.recorded, "peaks are read at FA-I and SA-I"
    assert silent.slip.recorded
    assert silent.overall == pytest.approx(events.overall)
    plain = json.loads(json.dumps(events_mapping(silent)))
    assert (plain["acceleration"]["recorded"], plain["slip"]["recorded"]) == (False, True)
    assert events_from_mapping(plain) == silent


def assert_same(one, other, readings=READINGS):
    """Assert equal times up to rounding of sums."""
    for reading in readings:
        for name in NAMES:
            assert one.reading(reading).time(name) == pytest.approx(other.reading(reading).time(name), abs=1e-9)


def test_a_node_that_lifts_off_counts_if_it_had_left_the_line_before_and_else_not():
    """The first node leaves at 1.3 s and a bit; it is lifted once after that and once before."""
    history = make(Process(jump=False))
    whole = displacement_events(history, EventSettings())
    assert whole.incipient == pytest.approx(1.3 + 50e-6 / SPEED, abs=5e-3)
    state, edges = history["contact_state"].copy(), [0, 40]
    state[300:, edges] = OPEN
    assert displacement_events(history.assign(contact_state=state), EventSettings()).incipient == whole.incipient
    state[220:, edges] = OPEN
    later = displacement_events(history.assign(contact_state=state), EventSettings())
    assert later.incipient == pytest.approx(1.3 + 0.41 / 20 + 50e-6 / SPEED, abs=5e-3)
    state, displacement = history["contact_state"].copy(), history["contact_displacement"].copy()
    displacement[:, 20, 0] = history["counterface_displacement"][:, 0, 0]
    stuck = history.assign(contact_displacement=displacement)
    assert displacement_events(stuck, EventSettings()).overall is None
    state[350:, 20] = OPEN
    assert displacement_events(stuck.assign(contact_state=state), EventSettings()).overall is not None


def test_events_and_peaks_are_those_of_their_own_searches_and_measures_take_them(monkeypatch):
    found, expected = find_slip(MADE), read_measures(MADE)
    assert found.events == fs.find_events(MADE)
    assert found.events.acceleration == acceleration_events(MADE)
    assert found.peaks == fs.acceleration_peaks(MADE)
    monkeypatch.setattr(measures, "find_slip", None)
    assert read_measures(MADE, slip=found) == expected
    with pytest.raises(fs.InputError, match="needs a history"):
        find_slip({})  # type: ignore[arg-type]
