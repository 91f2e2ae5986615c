"""What a history says of slip: events, measures, acceleration peaks, receptor signals, the contact patch."""

from __future__ import annotations

from fingerslip.slip.events import (
    Events,
    SlipEvents,
    acceleration_events,
    displacement_events,
    events_from_mapping,
    events_mapping,
    slip_events,
)
from fingerslip.slip.finding import Found, find_events, find_slip
from fingerslip.slip.fractions import (
    accumulated_slip,
    contact_area,
    relative_displacement,
    slipped_fraction,
    slipping_fraction,
    stick_ratio,
)
from fingerslip.slip.front import EdgeContact, edge_contact, force_ratio_times, front_arrivals, reference_events
from fingerslip.slip.measures import MEASURES, Measure, read_measures
from fingerslip.slip.patch import Patch, contact_patch, patch_series, surface_strain_rates, surface_strains
from fingerslip.slip.peaks import Peak, PeakTable, acceleration_peaks, peak_signal
from fingerslip.slip.receptors import (
    AREAS,
    contact_edges,
    receptor_signals,
    receptors_in_areas,
)
from fingerslip.slip.settings import EventSettings, PeakSettings
from fingerslip.slip.windows import (
    EVENTS,
    READINGS,
    ContactForces,
    SlideWindow,
    contact_forces,
    slide_tangent,
    slide_window,
    sustained_crossing,
    sustained_crossings,
)

__all__ = [
    "AREAS",
    "EVENTS",
    "MEASURES",
    "READINGS",
    "ContactForces",
    "EdgeContact",
    "EventSettings",
    "Events",
    "Found",
    "Measure",
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
    "contact_forces",
    "contact_patch",
    "displacement_events",
    "edge_contact",
    "events_from_mapping",
    "events_mapping",
    "find_events",
    "find_slip",
    "force_ratio_times",
    "front_arrivals",
    "patch_series",
    "peak_signal",
    "read_measures",
    "receptor_signals",
    "receptors_in_areas",
    "reference_events",
    "relative_displacement",
    "slide_tangent",
    "slide_window",
    "slip_events",
    "slipped_fraction",
    "slipping_fraction",
    "stick_ratio",
    "surface_strain_rates",
    "surface_strains",
    "sustained_crossing",
    "sustained_crossings",
]
