"""Spans of time between knots of a model, and the records in each.

Knots are the times at which a velocity of the programme, the slope of a ramp or the end says that something changes. A
span is divided into a whole number of units, records lie on multiples of its unit, and steps are powers of two of it:
so few lengths of steps occur, and all of them meet records and knots.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fingerslip.model.model import Model, Traction
from fingerslip.model.programme import Hold, Phase, Ramp, phase_duration
from fingerslip.model.timing import Adaptive

__all__ = ["Span", "record_count", "record_times", "spans_of"]

Array = NDArray[np.float64]

# Of the length of the simulation: knots that are nearer are one.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Span:
    """A span of time between two knots."""

    start: float  # [s]
    end: float  # [s]
    unit: float  # shortest time between records [s]
    count: int  # records in the span, that at its end included
    # time to the next record over the time since the start, rounded down to a power of two of the unit
    growth: float = 0.0

    def intervals(self) -> Iterator[int]:
        """Yield the time from record to record, in units: powers of two."""
        position = 0
        for _ in range(self.count):
            length = _power(position * self.growth)
            position += length
            yield length

    def record_times(self) -> Array:
        """Return the times of the records, that at the start excluded, shape (count,) [s]."""
        places = np.cumsum(np.fromiter(self.intervals(), np.float64, self.count))
        times: Array = self.start + self.unit * places
        times[-1] = self.end
        return times


def spans_of(model: Model, time: Adaptive) -> tuple[Span, ...]:
    """Return the spans of a model from its start to its end."""
    growth = 10.0 ** (1.0 / time.records_per_decade) - 1.0 if time.records_per_decade else 0.0
    return tuple(
        _span(start, end, time.output, growth if _is_quiet(model, start, end) else 0.0)
        for start, end in pairwise(_knots(model))
    )


def record_count(model: Model, time: Adaptive) -> int:
    """Return how many records there are, that at the start included."""
    return 1 + sum(span.count for span in spans_of(model, time))


def record_times(model: Model, time: Adaptive) -> Array:
    """Return the times of all records, start and end included, shape (n_times,) [s]."""
    return np.concatenate([[0.0], *(span.record_times() for span in spans_of(model, time))])


def _power(size: float) -> int:
    """Return the largest power of two up to a size, at least 1."""
    return 1 << max(0, math.floor(math.log2(size))) if size >= 1.0 else 1


def _span(start: float, end: float, output: float, growth: float) -> Span:
    """Divide a span so that its last record is at its end, with units of at most `output` [s]."""
    least = max(1, math.ceil((end - start) / output * (1.0 - _ROUNDING)))
    if not growth:
        return Span(start, end, (end - start) / least, least)
    count = position = 0
    while position < least:
        position += _power(position * growth)
        count += 1
    return Span(start, end, (end - start) / position, count, growth)


def _knots(model: Model) -> list[float]:
    """Return the knots, start and end included, in order [s]."""
    moments = {0.0, *(moment for ramp in _ramps(model) for moment in ramp.times)}
    for programme in _programmes(model):
        moments |= set(np.cumsum([phase_duration(phase) for phase in programme]).tolist())
    inner = sorted(moment for moment in moments if moment < model.end * (1.0 - _ROUNDING))
    first = [before for before, after in pairwise([*inner, model.end]) if after - before > _ROUNDING * model.end]
    return [*first, model.end]


def _ramps(model: Model) -> list[Ramp]:
    """Return the ramps of all loads and supports."""
    ramps = [load.ramp for load in model.tractions.values() if isinstance(load, Traction)]
    ramps += [contact.drive.ramp for contact in model.contacts if contact.drive]
    ramps += [load.ramp for body in model.bodies.values() for load in body.loads]
    return ramps + [motion.ramp for motion in model.support_motions.values()]


def _programmes(model: Model) -> list[tuple[Phase, ...]]:
    return [*model.programmes, *(body.programme for body in model.bodies.values())]


def _is_quiet(model: Model, start: float, end: float) -> bool:
    """Tell whether nothing is moved and no load changes between two knots [s]."""
    middle = 0.5 * (start + end)
    moved = any(_moves(programme, middle) for programme in _programmes(model))
    return not moved and all(ramp.at(start) == ramp.at(end) for ramp in _ramps(model))


def _moves(programme: tuple[Phase, ...], moment: float) -> bool:
    """Tell whether a programme moves anything at a moment between its knots [s]."""
    end = 0.0
    for phase in programme:
        end += phase_duration(phase)
        if moment < end:
            return not isinstance(phase, Hold)
    return False
