"""Names of events and readings: those of the data, each once."""

from __future__ import annotations

import dataclasses
import doctest

from fingerslip.slip import Events, SlipEvents
from fingerslip.slip import windows as names
from fingerslip.slip.windows import EVENTS, MAIN_EVENTS, READING_HEADINGS, READINGS, TIMES, defines_time, event_label


def test_names_are_the_fields_of_the_data() -> None:
    assert list(EVENTS) == [field.name for field in dataclasses.fields(SlipEvents) if field.name != "recorded"]
    assert list(READINGS) == [field.name for field in dataclasses.fields(Events)]
    assert (*EVENTS, "latency") == TIMES
    assert set(MAIN_EVENTS) < set(EVENTS)
    assert list(READING_HEADINGS) == list(READINGS)


def test_labels_are_words() -> None:
    assert [event_label(time) for time in TIMES] == [
        "incipient slip", "48 % slip", "three-quarter slip", "overall slip", "latency",
    ]  # fmt: skip
    assert doctest.testmod(names).failed == 0


def test_no_peak_belongs_to_48_percent_slip() -> None:
    undefined = [(reading, time) for reading in READINGS for time in TIMES if not defines_time(reading, time)]
    assert undefined == [("acceleration", "noticed")]
