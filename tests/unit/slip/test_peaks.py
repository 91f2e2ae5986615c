"""Acceleration peaks told from noise and from the press-to-slide transition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerslip.slip import PeakSettings, acceleration_events, acceleration_peaks
from fingerslip.slip import receptors as peaks_module
from fingerslip.slip.receptors import noise_of, transition_end
from unit.synthetic import Process, make

FAMOUS = {1.53: 0.054, 1.64: 0.15, 1.71: 0.637}


@pytest.mark.parametrize("step", [1e-3, 5e-3, 10e-3])
def test_peaks_are_found_where_they_are(step: float) -> None:
    table = acceleration_peaks(make(Process(step=step, peaks=FAMOUS)))
    assert [peak.time for peak in table.peaks] == pytest.approx(list(FAMOUS), abs=1.01 * step)
    # A pulse of 6 ms is as high as its mean over the step.
    over_step = 1.0 if step < 2e-3 else 0.5 * (1.0 + np.exp(-((step / 6e-3) ** 2)))
    assert [peak.height for peak in table.peaks] == pytest.approx(over_step * np.array(list(FAMOUS.values())), rel=0.02)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([1e-3, 5e-3]))
def test_peaks_stand_out_of_noise(seed: int, step: float) -> None:
    found = acceleration_events(make(Process(step=step, peaks=FAMOUS, noise=0.7, seed=seed)))
    assert found.overall == pytest.approx(1.71, abs=0.01)
    assert found.three_quarter == pytest.approx(1.64, abs=0.01)
    assert found.incipient == pytest.approx(1.53, abs=0.01)


def test_transition_is_left_out_however_large() -> None:
    table = acceleration_peaks(make(Process(step=1e-3, peaks=FAMOUS)))
    assert table.transition is not None
    assert table.transition.height > table.by_prominence[0].height
    assert table.transition_end is not None
    assert 1.0 < table.transition.time < table.transition_end < 1.15


def test_ranking_is_by_prominence() -> None:
    ranked = acceleration_peaks(make(Process(peaks={1.3: 0.2, 1.5: 0.1, 1.8: 0.4}))).by_prominence
    assert [peak.time for peak in ranked] == pytest.approx([1.8, 1.3, 1.5], abs=0.0051)
    assert [peak.prominence for peak in ranked] == sorted((peak.prominence for peak in ranked), reverse=True)


def test_three_quarter_needs_a_separate_peak() -> None:
    flattened = acceleration_events(make(Process(peaks={1.50: 0.058, 1.71: 0.423})))
    scaled = acceleration_events(make(Process(peaks={1.48: 0.07, 1.70: 0.1, 1.71: 0.275})))
    assert flattened.three_quarter is None
    assert scaled.three_quarter is None
    assert (flattened.incipient, flattened.overall) == pytest.approx((1.50, 1.71), abs=0.01)


def test_peaks_below_the_noise_do_not_count() -> None:
    buried = acceleration_events(make(Process(peaks={1.4: 0.004, 1.71: 0.5}, noise=1.0)))
    assert buried.incipient is None
    assert buried.overall == pytest.approx(1.71, abs=0.01)


def test_only_noise_has_no_overall_slip() -> None:
    history = make(Process(edge=3.0, centre=4.0, peaks={}, noise=1.0))
    assert acceleration_events(history).overall is None


def test_release_without_stopping_is_incipient_only() -> None:
    found = acceleration_events(make(Process(edge=1.3, centre=2.5, peaks={1.5: 0.1, 1.7: 0.3})))
    assert found.overall is None
    assert found.incipient == pytest.approx(1.5, abs=0.01)


def test_history_without_receptors_has_no_peaks() -> None:
    history = make(Process())
    others = history.isel(site=np.isin(history["site_kind"].values, ["FA-II", "SA-II"]))
    bare = history.drop_dims("site")
    assert acceleration_peaks(others).peaks == acceleration_peaks(bare).peaks == ()
    assert acceleration_events(bare).overall is None


def test_alternation_of_the_scheme_is_no_acceleration() -> None:
    history = make(Process(peaks=FAMOUS, jump=False))
    sign = np.where(np.arange(history.sizes["time"]) % 2, 1.0, -1.0)
    decay = np.where(history["time"] > 1.0, 6.0 * 0.95 ** np.arange(sign.size), 0.0)
    chatter = (sign * decay)[:, None, None]
    rung = history.assign(acceleration=history["acceleration"] + chatter)
    assert acceleration_events(rung).overall == pytest.approx(acceleration_events(history).overall, abs=5.1e-3)


def test_ringing_that_never_falls_leaves_no_peaks() -> None:
    times = np.arange(0.0, 1.0, 5e-3)
    ringing = np.abs(np.cos(2.0 * np.pi * 30.0 * times))
    assert transition_end(times, ringing, PeakSettings()) is None
    ends = transition_end(times, ringing * np.exp(-times / 0.03), PeakSettings())
    assert ends is not None
    assert times[ends[0]] == pytest.approx(0.03 * np.log(10.0), abs=0.02)


def test_ringing_after_a_release_is_no_further_release() -> None:
    history = make(Process(peaks={1.5: 0.3, 1.509: 0.2, 1.517: 0.13, 1.525: 0.09, 1.533: 0.06, 1.8: 0.6}, step=1e-3))
    assert [peak.time for peak in acceleration_peaks(history).peaks] == pytest.approx([1.5, 1.8], abs=2e-3)


def test_noise_spread_is_the_deviation_of_normal_noise() -> None:
    floor, spread = noise_of(2.0 + 0.3 * np.random.default_rng(0).standard_normal(20_000))
    assert (floor, spread) == pytest.approx((2.0, 0.3), rel=0.02)


TIMES = np.arange(0.0, 1.2, 5e-3)


def with_peaks(heights: dict[float, float], ripple: float, transient: dict[float, float]) -> np.ndarray:
    """Return a floor of 1 with a sawtooth of five records, single records raised to peaks, and the transient."""
    signal = 1.0 + ripple * (np.arange(TIMES.size) % 5 - 2)
    for moment, height in heights.items():
        signal[round(moment / 5e-3)] = 1.0 + height
    start = max(transient) >= TIMES
    signal[start] = np.interp(TIMES[start], list(transient), list(transient.values()))
    return signal


START = {0.0: 0.0, 0.005: 40.0, 0.03: 2.0, 0.04: 1.0}


def test_a_peak_needs_six_spreads_of_the_noise() -> None:
    """The median deviation of the sawtooth is 0.1 and its spread 0.148, so 0.89 over the floor are needed."""
    signal = with_peaks({0.3: 0.75, 0.5: 1.3, 0.9: 20.0}, 0.1, START)
    table = peaks_module._tabulate(TIMES, signal, PeakSettings())
    assert table.noise_spread == pytest.approx(0.148, abs=0.002)
    assert table.noise_floor == pytest.approx(1.0, abs=0.11)
    assert [peak.time for peak in table.peaks] == pytest.approx([0.5, 0.9])
    looser = peaks_module._tabulate(TIMES, signal, PeakSettings(over_noise=4.0))
    assert [peak.time for peak in looser.peaks] == pytest.approx([0.3, 0.5, 0.9])


def test_a_peak_needs_two_per_cent_of_the_largest() -> None:
    signal = with_peaks({0.3: 0.3, 0.5: 0.6, 0.9: 20.0}, 0.0, START)
    table = peaks_module._tabulate(TIMES, signal, PeakSettings())
    assert table.threshold == pytest.approx(0.02 * 20.0)
    assert [peak.time for peak in table.peaks] == pytest.approx([0.5, 0.9])
    assert [peak.prominence for peak in table.peaks] == pytest.approx([0.6, 20.0])


def test_a_second_swell_of_the_transient_is_no_peak() -> None:
    """Roughly over at 0.03 s, it swells again at 0.08 s and is quiet from 0.1 s on."""
    swell = START | {0.03: 3.0, 0.04: 2.5, 0.08: 3.4, 0.1: 1.0}
    table = peaks_module._tabulate(TIMES, with_peaks({0.9: 20.0}, 0.0, swell), PeakSettings())
    assert [peak.time for peak in table.peaks] == pytest.approx([0.9])
    assert table.transition is not None
    assert table.transition.time == pytest.approx(0.005)
    assert table.transition_end == pytest.approx(0.1, abs=0.006)


def test_peaks_closer_than_the_separation_are_one() -> None:
    signal = with_peaks({0.500: 3.0, 0.515: 5.0, 0.9: 20.0}, 0.0, START)
    table = peaks_module._tabulate(TIMES, signal, PeakSettings())
    assert [peak.time for peak in table.peaks] == pytest.approx([0.515, 0.9])
    apart = with_peaks({0.500: 3.0, 0.545: 5.0, 0.9: 20.0}, 0.0, START)
    table = peaks_module._tabulate(TIMES, apart, PeakSettings())
    assert [peak.time for peak in table.peaks] == pytest.approx([0.5, 0.545, 0.9])
