"""Receptors around the edges of the contact, their signals, and acceleration peaks told from noise."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.slip import PeakSettings, acceleration_events, receptor_signals
from fingerslip.slip import receptors as peaks_module
from fingerslip.slip.receptors import (
    contact_edges,
    noise_of,
    receptor_rows,
    receptors_in_areas,
    tangential_acceleration,
    transition_end,
)
from unit.synthetic import DEPTHS, HALF_WIDTH, Process, make

HISTORY = make(Process())


@pytest.mark.parametrize("normal", [(0.0, 1.0), (0.6, 0.8)])
def test_edges_are_those_of_the_patch_of_one_body_along_the_plate(normal):
    turn = np.array([[normal[1], normal[0]], [-normal[0], normal[1]]])
    history = HISTORY.assign_coords(
        counterface_normal=(("counterface", "component"), [normal]),
        contact_position=(("contact_node", "component"), HISTORY["contact_position"].values @ turn.T),
    )
    assert contact_edges(history) == pytest.approx((-HALF_WIDTH, HALF_WIDTH))
    # The patch grows with the square root of time.
    assert contact_edges(history, 0.25) == pytest.approx((-HALF_WIDTH / 2, HALF_WIDTH / 2), abs=2.1e-4)
    counterfaces = np.where(HISTORY["contact_position"][:, 0] > 1e-3, 1, 0)
    two = history.assign_coords(contact_counterface=("contact_node", counterfaces))
    assert contact_edges(two, counterface=0) == pytest.approx((-HALF_WIDTH, 1e-3), abs=2.1e-4)
    apart = history.assign(contact_state=history["contact_state"] * 0)
    assert contact_edges(apart) is None
    assert receptors_in_areas(apart) == {}
    assert receptor_signals(apart)["acceleration"].isnull().all()


def test_five_receptors_of_each_type_at_the_nearer_edge_of_which_a_is_that_at_the_smaller_position():
    chosen = receptors_in_areas(HISTORY)
    assert {key: len(names) for key, names in chosen.items()} == {(k, a): 5 for k in DEPTHS for a in "AB"}
    # Sites stand every 0.5 mm, so the five nearest to -4 mm are -5 .. -3 mm.
    positions = HISTORY["site_position"].sel(site=list(chosen["SA-II", "A"]), component="x").values
    assert sorted(positions) == pytest.approx([-5e-3, -4.5e-3, -4e-3, -3.5e-3, -3e-3])
    assert positions[0] == pytest.approx(-4e-3)
    swapped = receptors_in_areas(
        HISTORY.assign_coords(counterface_normal=(("counterface", "component"), [[0.0, -1.0]]))
    )
    for one, other in ("AB", "BA"):
        assert set(swapped["FA-I", one]) == set(chosen["FA-I", other])
    chosen = receptors_in_areas(HISTORY, per_area=25)
    left, right = (set(chosen["FA-I", area]) for area in "AB")
    assert len(left | right) == 25
    assert not left & right


def test_signals_are_means_over_the_area():
    signals = receptor_signals(HISTORY)
    assert signals["acceleration"].dims == ("kind", "area", "time")
    assert (signals["receptor_count"] == 5).all()
    names = list(receptors_in_areas(HISTORY)["FA-II", "B"])
    of_area, own = signals.sel(kind="FA-II", area="B"), HISTORY.sel(site=names)
    assert of_area["strain_energy_density"].values == pytest.approx(own["strain_energy_density"].mean("site").values)
    ends = own["acceleration"].values[201:203, :, 0]
    assert float(of_area["acceleration"][202]) == pytest.approx(ends.mean())
    few = receptor_signals(HISTORY.isel(site=HISTORY["site_kind"].values == "FA-I"))
    assert few["receptor_count"].sel(area="A").values.tolist() == [5, 0, 0, 0]
    assert few["acceleration"].sel(kind="SA-I").isnull().all()


def test_receptors_move_with_the_contact_over_time_and_have_the_rows_of_their_names():
    """At a quarter of the press the contact is half as wide, and so are the positions of its receptors."""
    chosen = receptors_in_areas(HISTORY, per_area=1, kinds=("SA-I",), time=0.25)
    places = HISTORY["site_position"].sel(component="x")
    assert [float(places.sel(site=chosen["SA-I", area][0])) for area in "AB"] == pytest.approx([-2e-3, 2e-3])
    rows = receptor_rows(HISTORY, ("FA-I", "SA-II"), 2)
    chosen = receptors_in_areas(HISTORY, 2, ("FA-I", "SA-II"))
    assert HISTORY["site"].values[rows].tolist() == [name for names in chosen.values() for name in names]
    assert len(rows) == 8


def test_acceleration_is_along_the_plate_and_the_mean_over_each_step_or_over_those_between_uneven_records():
    def short(**variables):
        values = {name: np.stack([along, np.full(4, 9.0)], axis=-1)[:, None] for name, along in variables.items()}
        few = HISTORY.isel(time=slice(4), site=slice(1))
        return few.assign({name: (("time", "site", "component"), array) for name, array in values.items()})

    even = short(acceleration=[1.0, 3.0, -5.0, 0.0])
    assert tangential_acceleration(even, np.array([0]))[:, 0].tolist() == [1.0, 2.0, -1.0, -2.5]
    uneven = short(acceleration=[7.0] * 4, velocity=[0.0, 1.0, 3.0, 2.0])
    uneven = uneven.assign_coords(time=[0.0, 0.5, 1.0, 3.0]).assign_attrs(time_step="auto")
    assert tangential_acceleration(uneven, np.array([0]))[:, 0].tolist() == [7.0, 2.0, 4.0, -0.5]


FAMOUS = {1.53: 0.054, 1.64: 0.15, 1.71: 0.637}


@pytest.mark.parametrize("step", [1e-3, 5e-3, 10e-3])
def test_peaks_are_found_where_they_are(step):
    table = fs.acceleration_peaks(make(Process(step=step, peaks=FAMOUS)))
    assert [peak.time for peak in table.peaks] == pytest.approx(list(FAMOUS), abs=1.01 * step)
    # A pulse of 6 ms is as high as its mean over the step.
    over_step = 1.0 if step < 2e-3 else 0.5 * (1.0 + np.exp(-((step / 6e-3) ** 2)))
    assert [peak.height for peak in table.peaks] == pytest.approx(over_step * np.array(list(FAMOUS.values())), rel=0.02)
    assert table.transition.height > table.by_prominence[0].height or step > 5e-3, "which is left out however large"
    assert 1.0 < table.transition.time < table.transition_end < 1.15
    ranked = fs.acceleration_peaks(make(Process(step=step, peaks={1.3: 0.2, 1.5: 0.1, 1.8: 0.4}))).by_prominence
    assert [peak.time for peak in ranked] == pytest.approx([1.8, 1.3, 1.5], abs=1.01 * step)
    assert [peak.prominence for peak in ranked] == sorted((peak.prominence for peak in ranked), reverse=True)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([1e-3, 5e-3]))
def test_peaks_stand_out_of_noise(seed, step):
    found = acceleration_events(make(Process(step=step, peaks=FAMOUS, noise=0.7, seed=seed)))
    assert found.overall == pytest.approx(1.71, abs=0.01)
    assert found.three_quarter == pytest.approx(1.64, abs=0.01)
    assert found.incipient == pytest.approx(1.53, abs=0.01)


@pytest.mark.parametrize(
    ("process", "incipient", "overall"),
    [
        (Process(peaks={1.50: 0.058, 1.71: 0.423}), 1.50, 1.71),
        (Process(peaks={1.48: 0.07, 1.70: 0.1, 1.71: 0.275}), 1.48, 1.71),
        (Process(peaks={1.4: 0.004, 1.71: 0.5}, noise=1.0), None, 1.71),
        (Process(edge=3.0, centre=4.0, peaks={}, noise=1.0), None, None),
        (Process(edge=1.3, centre=2.5, peaks={1.5: 0.1, 1.7: 0.3}), 1.5, None),
    ],
    ids=["none between", "not separate", "below the noise", "only noise", "release without stopping"],
)
def test_peaks_that_are_missing_merge_or_drown_give_no_event(process, incipient, overall):
    events = acceleration_events(make(process))
    assert events.three_quarter is None or process.noise
    for found, expected in ((events.incipient, incipient), (events.overall, overall)):
        assert (found is None) if expected is None else found == pytest.approx(expected, abs=0.01)
    others = HISTORY.isel(site=np.isin(HISTORY["site_kind"].values, ["FA-II", "SA-II"]))
    assert fs.acceleration_peaks(others).peaks == fs.acceleration_peaks(HISTORY.drop_dims("site")).peaks == ()


def test_alternation_of_the_scheme_is_no_acceleration():
    history = make(Process(peaks=FAMOUS, jump=False))
    sign = np.where(np.arange(history.sizes["time"]) % 2, 1.0, -1.0)
    decay = np.where(history["time"] > 1.0, 6.0 * 0.95 ** np.arange(sign.size), 0.0)
    chatter = (sign * decay)[:, None, None]
    rung = history.assign(acceleration=history["acceleration"] + chatter)
    assert acceleration_events(rung).overall == pytest.approx(acceleration_events(history).overall, abs=5.1e-3)


def test_ringing_that_never_falls_leaves_no_peaks_and_that_after_a_release_is_no_further_one():
    times = np.arange(0.0, 1.0, 5e-3)
    ringing = np.abs(np.cos(2.0 * np.pi * 30.0 * times))
    assert transition_end(times, ringing, PeakSettings()) is None
    ends = transition_end(times, ringing * np.exp(-times / 0.03), PeakSettings())
    assert times[ends[0]] == pytest.approx(0.03 * np.log(10.0), abs=0.02)
    history = make(Process(peaks={1.5: 0.3, 1.509: 0.2, 1.517: 0.13, 1.525: 0.09, 1.533: 0.06, 1.8: 0.6}, step=1e-3))
    assert [peak.time for peak in fs.acceleration_peaks(history).peaks] == pytest.approx([1.5, 1.8], abs=2e-3)
    floor, spread = noise_of(2.0 + 0.3 * np.random.default_rng(0).standard_normal(20_000))
    assert (floor, spread) == pytest.approx((2.0, 0.3), rel=0.02)


TIMES = np.arange(0.0, 1.2, 5e-3)


def with_peaks(heights, ripple, transient):
    """Return a floor of 1 with a sawtooth of five records, single records raised to peaks, and the transient."""
    signal = 1.0 + ripple * (np.arange(TIMES.size) % 5 - 2)
    for moment, height in heights.items():
        signal[round(moment / 5e-3)] = 1.0 + height
    start = max(transient) >= TIMES
    signal[start] = np.interp(TIMES[start], list(transient), list(transient.values()))
    return signal


START = {0.0: 0.0, 0.005: 40.0, 0.03: 2.0, 0.04: 1.0}


def tabulated(heights, ripple=0.0, transient=START, **settings):
    return peaks_module._tabulate(TIMES, with_peaks(heights, ripple, transient), PeakSettings(**settings))


def test_a_peak_needs_six_spreads_of_the_noise():
    """The median deviation of the sawtooth is 0.1 and its spread 0.148, so 0.89 over the floor are needed."""
    heights = {0.3: 0.75, 0.5: 1.3, 0.9: 20.0}
    table = tabulated(heights, 0.1)
    assert table.noise_spread == pytest.approx(0.148, abs=0.002)
    assert table.noise_floor == pytest.approx(1.0, abs=0.11)
    assert [peak.time for peak in table.peaks] == pytest.approx([0.5, 0.9])
    assert [peak.time for peak in tabulated(heights, 0.1, over_noise=4.0).peaks] == pytest.approx([0.3, 0.5, 0.9])


def test_a_peak_needs_two_per_cent_of_the_largest_and_peaks_closer_than_the_separation_are_one():
    table = tabulated({0.3: 0.3, 0.5: 0.6, 0.9: 20.0})
    assert table.threshold == pytest.approx(0.02 * 20.0)
    assert [peak.time for peak in table.peaks] == pytest.approx([0.5, 0.9])
    assert [peak.prominence for peak in table.peaks] == pytest.approx([0.6, 20.0])
    for second, times in ((0.515, [0.515, 0.9]), (0.545, [0.5, 0.545, 0.9])):
        assert [peak.time for peak in tabulated({0.5: 3.0, second: 5.0, 0.9: 20.0}).peaks] == pytest.approx(times)


def test_a_second_swell_of_the_transient_is_no_peak():
    """Roughly over at 0.03 s, it swells again at 0.08 s and is quiet from 0.1 s on."""
    table = tabulated({0.9: 20.0}, transient=START | {0.03: 3.0, 0.04: 2.5, 0.08: 3.4, 0.1: 1.0})
    assert [peak.time for peak in table.peaks] == pytest.approx([0.9])
    assert table.transition.time == pytest.approx(0.005)
    assert table.transition_end == pytest.approx(0.1, abs=0.006)
