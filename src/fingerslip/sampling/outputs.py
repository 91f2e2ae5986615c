"""Numbers of a run by name: events, measures and derived quantities, for expressions, sensitivities and predictions."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from fingerslip.errors import InputError
from fingerslip.results import Quantity, RunResult
from fingerslip.slip import measures
from fingerslip.slip.names import LATENCY, READINGS, TIMES, event_label, is_defined

__all__ = ["output_names", "output_of", "required_output"]


def output_of(run: RunResult, name: str) -> Quantity | None:
    """Return a number of a run by its name; None where nothing has it."""
    if name in run.derived:
        return run.derived[name]
    if name in _EVENTS:
        reading, time = _EVENTS[name]
        return Quantity(f"{event_label(time)} ({READINGS[reading]})", "s", run.events.reading(reading).time(time))
    measure = next((one for one in measures.MEASURES if one.name == name), None)
    if measure is None:
        return None
    value = run.numbers.get(measure.key)
    return Quantity(measure.label, measure.unit.si if measure.unit else "", None if value is None else float(value))


def required_output(run: RunResult, name: str) -> Quantity:
    """Return a number of a run by its name as :func:`output_of`."""
    found = output_of(run, name)
    if found is None:
        raise InputError("of", f"'{name}' is not known", f"needs one of {', '.join(output_names(run))}")
    return found


def output_names(run: RunResult) -> tuple[str, ...]:
    """Return all names that :func:`output_of` knows of a run."""
    return (*_EVENTS, *(one.name for one in measures.MEASURES), *run.derived)


def _event_names() -> dict[str, tuple[str, str]]:
    names = {}
    for reading in READINGS:
        for time in TIMES:
            if is_defined(reading, time):
                words = time if time == LATENCY else f"{time}_slip"
                names[words if reading == "slip" else f"{words}_{reading}"] = (reading, time)
    return names


_EVENTS: Mapping[str, tuple[str, str]] = MappingProxyType(_event_names())
