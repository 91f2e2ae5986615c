"""What a history says of slip: events, measures, acceleration peaks, receptor signals, the contact patch."""

from __future__ import annotations

from .events import Events as Events
from .events import Found as Found
from .events import SlipEvents as SlipEvents
from .events import acceleration_events as acceleration_events
from .events import displacement_events as displacement_events
from .events import events_from_mapping as events_from_mapping
from .events import events_mapping as events_mapping
from .events import find_events as find_events
from .events import find_slip as find_slip
from .events import slip_events as slip_events
from .front import EdgeContact as EdgeContact
from .front import edge_contact as edge_contact
from .front import force_ratio_times as force_ratio_times
from .front import front_arrivals as front_arrivals
from .front import reference_events as reference_events
from .measures import MEASURES as MEASURES
from .measures import Measure as Measure
from .measures import read_measures as read_measures
from .patch import Patch as Patch
from .patch import contact_patch as contact_patch
from .patch import patch_series as patch_series
from .patch import surface_strain_rates as surface_strain_rates
from .patch import surface_strains as surface_strains
from .peaks import Peak as Peak
from .peaks import PeakTable as PeakTable
from .peaks import acceleration_peaks as acceleration_peaks
from .peaks import peak_signal as peak_signal
from .receptors import contact_edges as contact_edges
from .receptors import receptor_signals as receptor_signals
from .receptors import receptors_in_areas as receptors_in_areas
from .settings import EventSettings as EventSettings
from .settings import PeakSettings as PeakSettings
from .windows import SlideWindow as SlideWindow
from .windows import contact_area as contact_area
from .windows import contact_forces as contact_forces
from .windows import relative_displacement as relative_displacement
from .windows import slide_tangent as slide_tangent
from .windows import slide_window as slide_window
from .windows import slipped_fraction as slipped_fraction
from .windows import slipping_fraction as slipping_fraction
from .windows import stick_ratio as stick_ratio
from .windows import sustained_crossing as sustained_crossing
from .windows import sustained_crossings as sustained_crossings
