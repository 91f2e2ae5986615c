"""Slip events, acceleration peaks and receptor signals, read from a history."""

from __future__ import annotations

from fingerslip.slip.events import (
    Events,
    SlipEvents,
    acceleration_events,
    displacement_events,
    events_from_mapping,
    events_mapping,
    find_events,
    slip_events,
)
from fingerslip.slip.fractions import (
    accumulated_slip,
    contact_area,
    relative_displacement,
    slipped_fraction,
    slipping_fraction,
    stick_ratio,
)
from fingerslip.slip.patch import Patch, contact_patch, patch_series, surface_strain_rates, surface_strains
from fingerslip.slip.peaks import Peak, PeakTable, acceleration_peaks, peak_signal
from fingerslip.slip.receptors import (
    AREAS,
    contact_edges,
    receptor_signals,
    receptors_in_areas,
)
from fingerslip.slip.settings import EventSettings, PeakSettings
from fingerslip.slip.windows import SlideWindow, slide_window, sustained_crossing

__all__ = [
    "AREAS",
    "EventSettings",
    "Events",
    "Patch",
    "Peak",
    "PeakSettings",
    "PeakTable",
    "SlideWindow",
    "SlipEvents",
    "acceleration_events",
    "acceleration_peaks",
    "accumulated_slip",
    "contact_area",
    "contact_edges",
    "contact_patch",
    "displacement_events",
    "events_from_mapping",
    "events_mapping",
    "find_events",
    "patch_series",
    "peak_signal",
    "receptor_signals",
    "receptors_in_areas",
    "relative_displacement",
    "slide_window",
    "slip_events",
    "slipped_fraction",
    "slipping_fraction",
    "stick_ratio",
    "surface_strain_rates",
    "surface_strains",
    "sustained_crossing",
]
