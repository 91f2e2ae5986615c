"""Slip events: incipient, noticed, three-quarter and overall slip, each in three readings.

From accumulated slip
    The first time from which, of the area in contact since the slide began, the fraction that has slipped by more
    than a tolerance stays at or above the event's.
From displacement
    The time by which the event's share of the contact nodes (the first one for incipient slip, the last one
    for overall slip) lags the plate.
From acceleration
    Overall slip is the most prominent acceleration peak at the receptors after the press-to-slide transition,
    incipient slip the first peak above the noise before it, three-quarter slip the most prominent one between.

An event that did not happen is None; so is every event of a reading whose signals the history does not hold, which
then says that it is not recorded.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np

from fingerslip.contact.states import OPEN
from fingerslip.libraries import xr
from fingerslip.parameters.schema import require_kind
from fingerslip.slip import windows
from fingerslip.slip.receptors import PeakTable, acceleration_peaks, followed_share, has_receptors, slide_receptors
from fingerslip.slip.settings import EventSettings, PeakSettings
from fingerslip.slip.windows import EVENTS, READINGS, TIMES, slide_window

# Of sums of areas, as a share of them.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class SlipEvents:
    """Times of the slip events, from the start of the run [s]; None for one that did not happen.

    Parameters
    ----------
    incipient : float, optional
        Incipient slip: the edge of the contact slips.
    noticed : float, optional
        Noticed slip: 48 % of the contact has slipped; people notice when about as much is slipping.
    three_quarter : float, optional
        Three-quarter slip: three quarters of the contact have slipped.
    overall : float, optional
        Overall slip: the whole contact has slipped.
    recorded : bool, optional
        Whether the history holds the signals that this reading needs; without them no event is known.

    Examples
    --------
    >>> import fingerslip as fs
    >>> round(fs.SlipEvents(incipient=1.15, overall=1.71).latency, 3)
    0.56
    """

    incipient: float | None = None
    noticed: float | None = None
    three_quarter: float | None = None
    overall: float | None = None
    recorded: bool = True

    @property
    def latency(self) -> float | None:
        """Time from incipient to overall slip [s]; None where one of them is."""
        if self.incipient is None or self.overall is None:
            return None
        return self.overall - self.incipient

    def time(self, name: str) -> float | None:
        """Return an event's time, or the latency, by its name in :data:`~fingerslip.slip.windows.TIMES` [s]."""
        return cast("float | None", getattr(self, name))


@dataclass(frozen=True)
class Events:
    """The slip events of one slide in three readings; the events themselves are those from accumulated slip.

    See :func:`simulate`.

    Parameters
    ----------
    slip : SlipEvents
        From accumulated slip.
    displacement : SlipEvents
        From nodes that no longer move with the plate.
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

    def reading(self, name: str) -> SlipEvents:
        """Return a reading by its name in :data:`~fingerslip.slip.windows.READINGS`."""
        return cast("SlipEvents", getattr(self, name))


def slip_events(history: xr.Dataset, settings: EventSettings, slide: int = 0) -> SlipEvents:
    """Find the events from accumulated slip.

    Each is the first time from which the slipped area fraction (:func:`~fingerslip.slip.slipped_fraction`)
    stays at or above the event's fraction for the time `sustained`, or up to the end of the slide. The fraction steps
    from node to node, so each event is the time at which a node slips, or lifts off: where its slip distance passes the
    tolerance, interpolated between two records.
    """
    window = slide_window(history, slide)
    if window is None:
        return SlipEvents()
    times, fractions = windows.slipped_steps(history, window, settings.slip_tolerance)
    levels = (getattr(settings, f"{name}_fraction") - _ROUNDING for name in EVENTS)
    incipient, noticed, three_quarter, overall = (
        windows.sustained_crossing(times, fractions, level, settings.sustained) for level in levels
    )
    return SlipEvents(incipient, noticed, three_quarter, overall)


def displacement_events(history: xr.Dataset, settings: EventSettings, slide: int = 0) -> SlipEvents:
    """Find the events from contact nodes that no longer move with the plate, as a person reads the displacement plot.

    The nodes in contact at the start of the slide count alike; one that lifts off before it lags the plate does not
    count.
    """
    window = slide_window(history, slide)
    if window is None:
        return SlipEvents()
    times = history["time"].values[window.records]
    touching = history["contact_state"].values[window.records] != OPEN
    nodes = np.flatnonzero(touching[0])
    distance, lifts = windows.relative_displacement(history, window)[:, nodes], ~touching[:, nodes]
    leaving = windows.sustained_crossings(times, distance, settings.displacement_tolerance, settings.sustained)
    lifted = np.where(lifts.any(axis=0), times[lifts.argmax(axis=0)], np.inf).tolist()
    pairs = zip(leaving, lifted, strict=True)
    counted = [left for left, until in pairs if until == np.inf or (left is not None and left <= until)]
    return events_of_leaving(counted, settings)


def events_of_leaving(leaving: Sequence[float | None], settings: EventSettings) -> SlipEvents:
    """Rank the times [s] at which points left the plate's line: the first, 48 %, three quarters and the last one."""
    finite = sorted(time for time in leaving if time is not None)
    shares = (0.0, settings.noticed_fraction, settings.three_quarter_fraction, 1.0)
    ranks = (max(math.ceil(share * len(leaving)), 1) for share in shares)
    incipient, noticed, three_quarter, overall = (finite[r - 1] if r <= len(finite) else None for r in ranks)
    return SlipEvents(incipient, noticed, three_quarter, overall)


def acceleration_events(history: xr.Dataset, settings: PeakSettings | None = None, slide: int = 0) -> SlipEvents:
    """Find the events from acceleration peaks at the receptors.

    Overall slip is the most prominent peak after the press-to-slide transition, provided that the skin
    no longer follows the plate afterwards. Incipient slip is the first peak that exceeds the noise before it,
    three-quarter slip the most prominent one between these two.
    """
    settings = settings or PeakSettings()
    return events_of_peaks(history, acceleration_peaks(history, settings, slide), settings, slide)


def events_of_peaks(history: xr.Dataset, table: PeakTable, settings: PeakSettings, slide: int) -> SlipEvents:
    """Return the events among the peaks of a slide."""
    if not has_receptors(history, settings):
        return SlipEvents(recorded=False)
    window, largest = slide_window(history, slide), table.largest
    if window is None or largest is None:
        return SlipEvents()
    rows = slide_receptors(history, window, settings)
    if followed_share(history, window, rows, largest.time) >= settings.followed:
        return SlipEvents(incipient=table.peaks[0].time)
    before = [peak for peak in table.peaks if peak.time < largest.time]
    if not before:
        return SlipEvents(overall=largest.time)
    strongest = max(before[1:], key=lambda peak: peak.prominence, default=None)
    three_quarter = strongest.time if strongest else None
    return SlipEvents(incipient=before[0].time, three_quarter=three_quarter, overall=largest.time)


def events_mapping(events: Events) -> dict[str, dict[str, float | bool | None]]:
    """Turn events into plain data for JSON [s]."""
    return {
        name: {"recorded": reading.recorded, **{time: reading.time(time) for time in TIMES}}
        for name in READINGS
        for reading in (events.reading(name),)
    }


def events_from_mapping(values: Mapping[str, Mapping[str, Any]]) -> Events:
    """Read events back from plain data: the inverse of :func:`events_mapping`."""
    names = ("recorded", *EVENTS)
    return Events(**{reading: SlipEvents(**{name: values[reading][name] for name in names}) for reading in READINGS})


@dataclass(frozen=True)
class Found:
    """What is found in a history once, and needed by all that is read off it."""

    events: Events = field(default_factory=Events)
    peaks: PeakTable = field(default_factory=PeakTable)


def find_events(history: xr.Dataset, settings: EventSettings | None = None, slide: int = 0) -> Events:
    """Find the slip events of a slide in all three readings.

    See :func:`simulate`.

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
    require_kind(history, xr.Dataset, "a history, which simulate returns", "history")
    settings = settings or EventSettings()
    slip = slip_events(history, settings, slide)
    displacement = displacement_events(history, settings, slide)
    peaks = acceleration_peaks(history, settings.peaks, slide)
    return Found(Events(slip, displacement, events_of_peaks(history, peaks, settings.peaks, slide)), peaks)
