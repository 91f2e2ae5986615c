"""What is found once is what each search finds."""

from __future__ import annotations

import pytest

from fingerslip.errors import InputError
from fingerslip.slip import acceleration_events, acceleration_peaks, find_events, find_slip, measures, read_measures
from unit.whole_result import MADE


def test_events_and_peaks_are_those_of_their_own_searches() -> None:
    found = find_slip(MADE)
    assert found.events == find_events(MADE)
    assert found.events.acceleration == acceleration_events(MADE)
    assert found.peaks == acceleration_peaks(MADE)


def test_only_a_history_has_events() -> None:
    with pytest.raises(InputError, match="needs a history"):
        find_slip({})  # type: ignore[arg-type]


def test_measures_take_what_was_found(monkeypatch: pytest.MonkeyPatch) -> None:
    found, expected = find_slip(MADE), read_measures(MADE)
    monkeypatch.setattr(measures, "find_slip", None)
    assert read_measures(MADE, found=found) == expected
