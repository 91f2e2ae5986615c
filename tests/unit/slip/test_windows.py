"""The slide's records and sustained crossings."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.errors import InputError
from fingerslip.slip import slide_window, sustained_crossing, sustained_crossings
from unit.synthetic import Process, make

SIGNALS = st.lists(st.floats(0.0, 1.0), min_size=2, max_size=40)


def test_window_starts_with_the_last_record_before_the_slide() -> None:
    window = slide_window(make(Process(phases=(("press", 0.0, 1.003), ("slide", 1.003, 1.998)))))
    assert window is not None
    assert (window.first, window.last) == (200, 399)


def test_window_forgives_rounding_of_phase_times() -> None:
    window = slide_window(make(Process(phases=(("press", 0.0, 1.0 - 1e-13), ("slide", 1.0 - 1e-13, 2.0 - 1e-13)))))
    assert window is not None
    assert (window.first, window.last) == (200, 400)


def test_no_slide_has_no_window() -> None:
    assert slide_window(make(Process(phases=(("press", 0.0, 1.0), ("hold", 1.0, 2.0))))) is None


def test_slide_that_was_not_recorded_has_no_window() -> None:
    assert slide_window(make(Process(phases=(("press", 0.0, 2.5), ("slide", 2.5, 3.0))))) is None


def test_second_slide_is_found_and_a_third_is_refused() -> None:
    history = make(Process(phases=(("press", 0.0, 1.0), ("slide", 1.0, 1.4), ("hold", 1.4, 1.5), ("slide", 1.5, 2.0))))
    window = slide_window(history, 1)
    assert window is not None
    assert (window.first, window.last) == (300, 400)
    with pytest.raises(InputError, match=r"slide: got 2, the programme has 2 slide"):
        slide_window(history, 2)


def test_a_slide_that_turns_back_is_another_one() -> None:
    history = make(Process(phases=(("press", 0.0, 1.0), ("slide", 1.0, 1.2), ("slide", 1.2, 1.6), ("slide", 1.6, 2.0))))
    plate = history["counterface_displacement"].copy()
    plate[320:, 0, 0] = 2.0 * plate[320, 0, 0] - plate[320:, 0, 0]
    there_and_back = history.assign(counterface_displacement=plate)
    windows = [slide_window(there_and_back, slide) for slide in (0, 1)]
    assert [(window.start, window.end) for window in windows if window] == [(1.0, 1.6), (1.6, 2.0)]


def test_short_spell_does_not_count() -> None:
    times, values = np.arange(7.0), np.array([0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0])
    assert sustained_crossing(times, values, 0.5, 1.0) == pytest.approx(3.5)
    assert sustained_crossing(times, values, 0.5, 2.0) is None


def test_spell_up_to_the_end_counts_however_short() -> None:
    assert sustained_crossing(np.arange(4.0), np.array([0.0, 0.0, 0.0, 1.0]), 0.25, 10.0) == pytest.approx(2.25)


def test_missing_values_are_below_every_level() -> None:
    values = np.array([np.nan, np.nan, 0.6, 0.7])
    assert sustained_crossing(np.arange(4.0), values, 0.5, 1.0) == 2.0
    assert sustained_crossing(np.arange(4.0), np.full(4, np.nan), 0.0, 0.0) is None


@given(SIGNALS, st.floats(0.01, 1.0), st.floats(0.01, 1.0), st.floats(0.0, 5.0))
def test_higher_level_is_never_reached_earlier(values: list[float], one: float, other: float, sustained: float) -> None:
    times, signal = np.arange(len(values), dtype=float), np.array(values)
    low = sustained_crossing(times, signal, min(one, other), sustained)
    high = sustained_crossing(times, signal, max(one, other), sustained)
    assert high is None or (low is not None and low <= high + 1e-9)


def first_lasting(times: np.ndarray, above: np.ndarray, sustained: float) -> int | None:
    """Return the first record from which a signal stays above for long enough, by looking at all of them."""
    for start in np.flatnonzero(above & ~np.concatenate([[False], above[:-1]])):
        below = np.flatnonzero(~above[start:])
        end = start + below[0] - 1 if below.size else times.size - 1
        if end == times.size - 1 or times[end] - times[start] >= sustained:
            return int(start)
    return None


@given(st.lists(st.lists(st.floats(0.0, 1.0), min_size=9, max_size=9), min_size=0, max_size=6), st.floats(0.0, 5.0))
def test_several_signals_are_looked_at_as_one_by_one(signals: list[list[float]], sustained: float) -> None:
    times, values = np.array([0.0, 0.5, 1.0, 2.0, 2.5, 4.0, 5.0, 6.5, 7.0]), np.array(signals).reshape(-1, 9).T
    found = sustained_crossings(times, values, 0.5, sustained)
    assert found == [sustained_crossing(times, own, 0.5, sustained) for own in values.T]
    for own, crossing in zip(values.T, found, strict=True):
        start = first_lasting(times, own >= 0.5, sustained)
        assert (crossing is None) == (start is None)
        if crossing is not None and start is not None:
            assert times[max(start - 1, 0)] <= crossing <= times[start]
