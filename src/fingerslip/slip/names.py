"""Names of the slip events and of the readings that give their times, for files, tables and figures alike."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

__all__ = [
    "EVENTS",
    "LATENCY",
    "MAIN_EVENTS",
    "NOTICED_NOTE",
    "READINGS",
    "READING_HEADINGS",
    "TIMES",
    "event_label",
    "is_defined",
]

#: The slip events in order of time: name in files, and in words.
EVENTS: Mapping[str, str] = MappingProxyType(
    {"incipient": "incipient", "noticed": "48 %", "three_quarter": "three-quarter", "overall": "overall"}
)
#: What stands below tables that have the second of them.
NOTICED_NOTE = "48 %: the share of the contact that slips when people notice it (Barrea et al. 2018)."
#: The events that every reading gives; figures mark these.
MAIN_EVENTS = ("incipient", "three_quarter", "overall")
#: The time from incipient to overall slip.
LATENCY = "latency"
#: All times of a reading.
TIMES = (*EVENTS, LATENCY)

#: The readings: name in files, and in words.
READINGS: Mapping[str, str] = MappingProxyType(
    {"slip": "accumulated slip", "displacement": "displacement", "acceleration": "acceleration peaks"}
)
#: The readings where there is little room.
READING_HEADINGS: Mapping[str, str] = MappingProxyType(
    {"slip": "slip", "displacement": "displ.", "acceleration": "peaks"}
)


def event_label(time: str) -> str:
    """Return the name of a slip event, or of the latency, in words.

    Examples
    --------
    >>> event_label("three_quarter"), event_label("latency")
    ('three-quarter slip', 'latency')
    """
    return LATENCY if time == LATENCY else f"{EVENTS[time]} slip"


def is_defined(reading: str, time: str) -> bool:
    """Tell whether a reading defines a time: no acceleration peak belongs to 48 % slip."""
    return (reading, time) != ("acceleration", "noticed")
