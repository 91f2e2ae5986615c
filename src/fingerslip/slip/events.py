"""Slip events: incipient, noticed, three-quarter and overall slip, read in three ways.

From accumulated slip
    The first time from which, of the area in contact since the slide began, the fraction that has slipped by more
    than a tolerance stays at or above the event's.
From displacement
    The time by which the event's share of the contact nodes (the first one for incipient slip, the last one
    for overall slip) has left the plate's line.
From acceleration
    Overall slip is the most prominent acceleration peak at the receptors after the press-to-slide transition,
    incipient slip the first peak above the noise before it, three-quarter slip the most prominent one between.

An event that did not happen is None.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import xarray as xr

from fingerslip.history import OPEN
from fingerslip.slip.fractions import relative_displacement, slipped_fraction
from fingerslip.slip.peaks import Peak, PeakTable, acceleration_peaks, goes_along, slide_receptors
from fingerslip.slip.settings import EventSettings, PeakSettings
from fingerslip.slip.windows import SlideWindow, slide_window, sustained_crossing

__all__ = [
    "Events",
    "SlipEvents",
    "acceleration_events",
    "displacement_events",
    "events_from_mapping",
    "events_mapping",
    "find_events",
    "slip_events",
]


@dataclass(frozen=True)
class SlipEvents:
    """Times of the slip events, from the start of the run [s]; None for one that did not happen.

    Parameters
    ----------
    incipient : float, optional
        Slip begins.
    noticed : float, optional
        As much slips (48 %) as when people notice it.
    three_quarter : float, optional
        Three quarters slip.
    overall : float, optional
        All slips.
    """

    incipient: float | None = None
    noticed: float | None = None
    three_quarter: float | None = None
    overall: float | None = None

    @property
    def latency(self) -> float | None:
        """Time from incipient to overall slip [s]; None where one of them did not happen."""
        if self.incipient is None or self.overall is None:
            return None
        return self.overall - self.incipient


@dataclass(frozen=True)
class Events:
    """The slip events of one slide, read in three ways; the times at the top are those from accumulated slip.

    Parameters
    ----------
    slip : SlipEvents
        From accumulated slip.
    displacement : SlipEvents
        From nodes leaving the plate's line.
    acceleration : SlipEvents
        From acceleration peaks at the receptors.
    """

    slip: SlipEvents = SlipEvents()
    displacement: SlipEvents = SlipEvents()
    acceleration: SlipEvents = SlipEvents()

    @property
    def incipient(self) -> float | None:
        """Incipient slip, from accumulated slip [s]."""
        return self.slip.incipient

    @property
    def noticed(self) -> float | None:
        """48 % of the contact area has slipped [s]."""
        return self.slip.noticed

    @property
    def three_quarter(self) -> float | None:
        """Three quarters of the contact area have slipped [s]."""
        return self.slip.three_quarter

    @property
    def overall(self) -> float | None:
        """Overall slip, from accumulated slip [s]."""
        return self.slip.overall

    @property
    def latency(self) -> float | None:
        """Time from incipient to overall slip, from accumulated slip [s]."""
        return self.slip.latency


def find_events(history: xr.Dataset, settings: EventSettings | None = None, slide: int = 0) -> Events:
    """Find the slip events of a slide in all three ways.

    Parameters
    ----------
    history : xarray.Dataset
        What ``simulate`` returned.
    settings : EventSettings, optional
        Tolerances and fractions.
    slide : int, optional
        Which of the slide phases, from 0.

    Returns
    -------
    Events
        All None where the programme has no slide.

    Raises
    ------
    InputError
        Where there are slides, but not that one.
    """
    settings = settings or EventSettings()
    return Events(
        slip_events(history, settings, slide),
        displacement_events(history, settings, slide),
        acceleration_events(history, settings.peaks, slide),
    )


def slip_events(history: xr.Dataset, settings: EventSettings, slide: int = 0) -> SlipEvents:
    """Find the events from accumulated slip.

    Each is the first time from which the slipped area fraction (:func:`~fingerslip.slip.slipped_fraction`)
    stays at or above the event's fraction for the time `sustained`, or up to the end of the slide.

    Parameters
    ----------
    history : xarray.Dataset
        A history.
    settings : EventSettings
        Tolerance, fractions and how long they have to last.
    slide : int, optional
        Which of the slide phases, from 0.

    Returns
    -------
    SlipEvents
        The events, interpolated between records.
    """
    window = slide_window(history, slide)
    if window is None:
        return SlipEvents()
    fraction = slipped_fraction(history, window, settings.slip_tolerance)
    times, values = fraction["time"].values, fraction.values
    return SlipEvents(*(sustained_crossing(times, values, level, settings.sustained) for level in _levels(settings)))


def displacement_events(history: xr.Dataset, settings: EventSettings, slide: int = 0) -> SlipEvents:
    """Find the events from contact nodes leaving the plate's line, as a person reads the displacement plot.

    The nodes in contact at the start of the slide are counted, each alike; one that lifts off before it left
    the line is counted out.

    Parameters
    ----------
    history : xarray.Dataset
        A history.
    settings : EventSettings
        Tolerance, fractions and how long a node has to stay off the line.
    slide : int, optional
        Which of the slide phases, from 0.

    Returns
    -------
    SlipEvents
        When the first node, 48 % of them, three quarters and the last one had left.
    """
    window = slide_window(history, slide)
    if window is None:
        return SlipEvents()
    leaving = _leaving_times(history, window, settings)
    finite = sorted(time for time in leaving if time is not None)
    shares = (0.0, settings.noticed_fraction, settings.three_quarter_fraction, 1.0)
    ranks = (max(math.ceil(share * len(leaving)), 1) for share in shares)
    return SlipEvents(*(finite[rank - 1] if rank <= len(finite) else None for rank in ranks))


def acceleration_events(history: xr.Dataset, settings: PeakSettings | None = None, slide: int = 0) -> SlipEvents:
    """Find the events from acceleration peaks at the receptors.

    Overall slip is the most prominent peak after the press-to-slide transition, provided that the skin
    no longer goes along with the plate afterwards. Incipient slip is the first peak that stands out of the
    noise before it, three-quarter slip the most prominent one between these two.

    Parameters
    ----------
    history : xarray.Dataset
        A two-dimensional history.
    settings : PeakSettings, optional
        How peaks are told from noise.
    slide : int, optional
        Which of the slide phases, from 0.

    Returns
    -------
    SlipEvents
        `noticed` is always None: no peak belongs to it.
    """
    settings = settings or PeakSettings()
    window = slide_window(history, slide)
    table = acceleration_peaks(history, settings, slide)
    largest = table.largest
    if window is None or largest is None:
        return SlipEvents()
    rows = slide_receptors(history, window, settings)
    if goes_along(history, window, rows, largest.time) >= settings.followed:
        return SlipEvents(incipient=table.peaks[0].time)
    return _events_before(table, largest)


def events_mapping(events: Events) -> dict[str, dict[str, float | None]]:
    """Turn events into plain data for JSON: way of reading, then event (and latency), to seconds or None."""
    return {
        way.name: {
            **{event.name: getattr(times, event.name) for event in fields(SlipEvents)},
            "latency": times.latency,
        }
        for way in fields(Events)
        for times in (getattr(events, way.name),)
    }


def events_from_mapping(values: Mapping[str, Mapping[str, Any]]) -> Events:
    """Read events back from plain data: the inverse of :func:`events_mapping`."""
    names = [event.name for event in fields(SlipEvents)]
    return Events(
        **{way.name: SlipEvents(**{name: values[way.name][name] for name in names}) for way in fields(Events)}
    )


def _levels(settings: EventSettings) -> tuple[float, float, float, float]:
    return (
        settings.incipient_fraction,
        settings.noticed_fraction,
        settings.three_quarter_fraction,
        settings.overall_fraction,
    )


def _leaving_times(history: xr.Dataset, window: SlideWindow, settings: EventSettings) -> Sequence[float | None]:
    """Return when each counted node left the plate's line; None for one that never did."""
    times = history["time"].values[window.records]
    touching = history["contact_state"].values[window.records] != OPEN
    distance = relative_displacement(history, window)
    level, sustained = settings.displacement_tolerance, settings.sustained
    counted: list[float | None] = []
    for node in np.flatnonzero(touching[0]):
        lifted = np.flatnonzero(~touching[:, node])
        left = sustained_crossing(times, distance[:, node], level, sustained)
        if lifted.size == 0 or (left is not None and left <= times[lifted[0]]):
            counted.append(left)
    return counted


def _events_before(table: PeakTable, overall: Peak) -> SlipEvents:
    before = [peak for peak in table.peaks if peak.time < overall.time]
    if not before:
        return SlipEvents(overall=overall.time)
    strongest = max(before[1:], key=lambda peak: peak.prominence, default=None)
    return SlipEvents(
        incipient=before[0].time,
        three_quarter=strongest.time if strongest else None,
        overall=overall.time,
    )
