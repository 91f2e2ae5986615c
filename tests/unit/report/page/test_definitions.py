"""Sentences that define the slip events."""

from __future__ import annotations

from fingerslip.report.page.definitions import definitions
from fingerslip.slip import EventSettings, PeakSettings
from fingerslip.slip.windows import READINGS


def test_every_reading_has_its_definition() -> None:
    assert list(definitions(EventSettings())) == [*READINGS, "latency"]


def test_definitions_say_the_constants() -> None:
    text = definitions(EventSettings(slip_tolerance=35e-6, incipient_fraction=0.05, sustained=0.08))["slip"]
    assert "35 µm" in text
    assert "5 %, 48 %, 75 % and 99.5 %" in text
    assert "for 80 ms or up to the end of the slide" in text
    displacement = definitions(EventSettings(displacement_tolerance=70e-6))["displacement"]
    assert "lag the plate by more than 70 µm" in displacement


def test_definitions_say_the_constants_of_the_peaks() -> None:
    settings = EventSettings(peaks=PeakSettings(kinds=("SA-II",), over_noise=9.0, followed=0.25))
    text = definitions(settings)["acceleration"]
    for said in ("SA-II", "by 9 spreads", "less than 25 % of the plate's travel"):
        assert said in text
