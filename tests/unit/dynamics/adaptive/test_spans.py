"""Spans: records meet knots, are even where something moves and logarithmic where nothing does."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.adaptive.spans import record_count, record_times, spans_of
from problems.pushed import push_and_slide

# Ends at 0.1, 10.1 and 10.235 s.
PROGRAMME = (fs.Press(0.4e-3, 4e-3), fs.Hold(10.0), fs.Slide(0.8e-3, 0.8e-3 / 0.135))


def spans(programme=PROGRAMME, **changes):
    time = fs.Adaptive(**({"output": 0.02} | changes))
    return spans_of(push_and_slide(programme=programme, time=time), time)


def test_every_phase_is_divided_evenly():
    found = spans()
    assert [span.start for span in found] == pytest.approx([0.0, 0.1, 10.1])
    assert [span.count for span in found] == [5, 500, 7]
    assert np.diff(found[2].record_times()) == pytest.approx(np.full(6, 0.135 / 7))
    assert [span.record_times()[-1] for span in found] == [span.end for span in found]


def test_records_in_holds_are_logarithmic_where_that_is_asked_for():
    press, hold, slide = spans(records_per_decade=10)
    assert (press.count, slide.count) == (5, 7)
    assert hold.count < 40
    lengths = np.array(list(hold.intervals()))
    assert np.all(np.log2(lengths) % 1 == 0), "few lengths of steps occur"
    assert np.all(np.diff(lengths) >= 0), "the last one is no remainder"
    times = hold.record_times() - hold.start
    assert times[-1] == pytest.approx(10.0)
    assert times[0] <= 0.02
    assert np.all(np.diff(times)[times[:-1] > 0.2] <= times[:-1][times[:-1] > 0.2] * (10**0.1 - 1) * (1 + 1e-9))


def test_a_hold_in_which_a_load_changes_is_even():
    ramp = fs.Ramp((0.1, 5.1), (0.0, 1.0))
    time = fs.Adaptive(0.02, records_per_decade=10)
    model = push_and_slide(programme=PROGRAMME, time=time, tractions={"right": fs.Traction((1.0, 0.0), ramp)})
    found = spans_of(model, time)
    assert [span.end for span in found] == pytest.approx([0.1, 5.1, 10.1, 10.235])
    assert [bool(span.growth) for span in found] == [False, False, True, False]


def test_times_begin_at_zero_and_end_at_the_end():
    time = fs.Adaptive(0.02, end=0.31)
    model = push_and_slide(programme=PROGRAMME, time=time)
    times = record_times(model, time)
    assert times.size == record_count(model, time)
    assert (times[0], times[-1]) == (0.0, 0.31)
    assert np.diff(times).max() <= 0.02 * (1 + 1e-9)
    assert 0.1 in times.round(12), "the knot between press and hold"


def test_after_the_programme_nothing_moves():
    time = fs.Adaptive(0.02, end=100.0, records_per_decade=10)
    assert bool(spans_of(push_and_slide(programme=PROGRAMME, time=time), time)[-1].growth)
