"""All that is found in a slide: its slip events in all readings, and its acceleration peaks."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from fingerslip.parameters.schema import require_kind
from fingerslip.slip.events import Events, displacement_events, events_of_peaks, slip_events
from fingerslip.slip.peaks import PeakTable, acceleration_peaks
from fingerslip.slip.settings import EventSettings

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Found", "find_events", "find_slip"]


@dataclass(frozen=True)
class Found:
    """What is found in a history once, and needed by all that is read off it."""

    events: Events = field(default_factory=Events)
    peaks: PeakTable = field(default_factory=PeakTable)


def find_events(history: xr.Dataset, settings: EventSettings | None = None, slide: int = 0) -> Events:
    """Find the slip events of a slide in all three readings.

    Parameters
    ----------
    history : xarray.Dataset
        What ``simulate`` returned.
    settings : EventSettings, optional
        Tolerances and fractions.
    slide : int, optional
        Which of the slides, from 0.

    Returns
    -------
    Events
        All None where the programme has no slide.

    Raises
    ------
    InputError
        Where there are slides, but not that one.
    """
    return find_slip(history, settings, slide).events


def find_slip(history: xr.Dataset, settings: EventSettings | None = None, slide: int = 0) -> Found:
    """Find the slip events of a slide as :func:`find_events` does, and the acceleration peaks of it."""
    import xarray as xr

    require_kind(history, xr.Dataset, "a history, which simulate returns", "history")
    settings = settings or EventSettings()
    slip = slip_events(history, settings, slide)
    displacement = displacement_events(history, settings, slide)
    peaks = acceleration_peaks(history, settings.peaks, slide)
    return Found(Events(slip, displacement, events_of_peaks(history, peaks, settings.peaks, slide)), peaks)
