"""Steps that control their own error: they choose the ends that an integrator is given.

Of implicit dynamics the displacement of a step of length h is that of a Newmark step, which takes the acceleration for
weighted mean values where it is linear. What this leaves out, to its leading term, is (Zienkiewicz & Xie 1991) ::

    e = (beta - 1/6) h^2 (a_1 - a_0)

A quasi-static step is one of implicit Euler. It is taken once whole and once in two halves; what the halves leave is
about the difference of both (step doubling, Hairer, Norsett & Wanner 1993, section II.4), and the halves are kept.

Fixed steps at large strain that are not solved are halved in :mod:`fingerslip.dynamics.finite.large`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from scipy import sparse

from fingerslip.arrays import Floats
from fingerslip.dynamics.loop import BodyIntegrator, Integrator
from fingerslip.dynamics.recording.schedule import Span, spans_of
from fingerslip.dynamics.step.state import State
from fingerslip.errors import ConvergenceError
from fingerslip.model.model import Model
from fingerslip.model.timing import Adaptive

# Steps are doubled after so many in a row whose double is expected to be within this part of the allowed error.
_GOOD, _MARGIN = 2, 0.9


class Controlled(Integrator[State]):
    """Takes one motion from record to record, with steps that control their error; tells states between records."""

    def __init__(
        self, integrator: BodyIntegrator, model: Model, mass: sparse.csr_matrix, pass_by: Callable[[State], None]
    ) -> None:
        assert isinstance(model.time, Adaptive)
        self._integrator, self._time, self._mass, self._pass_by = integrator, model.time, mass, pass_by
        self._halves = model.time.scheme == "quasi_static"
        # By how much the error over the allowed one grows with twice the step; the largest norm of the displacement.
        self._growth, self._largest = 2.0 if self._halves else 8.0, 0.0
        self._counts = {"steps_taken": 0, "steps_rejected": 0, "steps_above_tolerance": 0}
        self._lengths = np.inf, 0.0
        self._records = ((span, units) for span in spans_of(model, model.time) for units in span.intervals())
        self._span: Span | None = None

    @property
    def attributes(self) -> Mapping[str, object]:
        """What a history says of the steps, and of how they were computed."""
        shortest, longest = self._lengths
        lengths = {"shortest_step": shortest, "longest_step": longest}
        steps = {"time_step": "auto", "time_tolerance": self._time.tolerance, **self._counts, **lengths}
        return {**steps, **self._integrator.attributes}

    def start(self) -> dict[int, State]:
        """Return the state at time zero."""
        return self._integrator.start()

    def advance(self, states: Mapping[int, State], ends: Floats) -> dict[int, list[State]]:  # noqa: ARG002
        """Take steps to the next record; in a new span the first one is the smallest."""
        state, (span, units) = states[0], next(self._records)
        # How often the unit of records can be halved without getting shorter than the shortest step.
        finest = max(int(self._halves), _doublings(self._time.shortest, span.unit))
        if span is not self._span:
            state = replace(state, working_set=None)
            self._span, self._tick = span, span.unit / 2**finest
            self._at, self._level, self._good = 0, int(self._halves), 0
            # The level of the longest step that is allowed: 2^level ticks.
            self._highest = max(self._level, _doublings(self._tick, self._time.largest or np.inf))
        first, last = self._at, self._at + (units << finest)
        while self._at < last:
            state, self._at = self._step(state, self._at, first, last)
        return {0: [state]}

    def _step(self, state: State, at: int, first: int, last: int) -> tuple[State, int]:
        """Take one step from a place, in ticks of the span, within the interval between two records."""
        level = min(self._level, self._highest, _room(at - first, last - first))
        while True:
            lowest = level <= int(self._halves)
            try:
                states, error = self._try_step(state, at, 1 << level)
            except ConvergenceError:
                if lowest:
                    raise
                error = float("inf")
            if error <= 1.0 or lowest:
                break
            self._counts["steps_rejected"] += 1
            level -= 1
            self._level, self._good = level, 0
        after = at + (1 << level)
        for element in states if after < last else states[:-1]:
            self._pass_by(element)
        # Take note of them, and decide how long the next step is.
        self._counts["steps_above_tolerance"] += error > 1.0
        for element in states:
            self._counts["steps_taken"] += 1
            self._lengths = min(self._lengths[0], element.step), max(self._lengths[1], element.step)
            self._largest = max(self._largest, self._norm(element.displacement))
        if level >= self._level:
            self._good = self._good + 1 if error * self._growth <= _MARGIN else 0
            if self._good >= _GOOD and level < self._highest:
                self._level, self._good = level + 1, 0
        return states[-1], after

    def _try_step(self, state: State, at: int, size: int) -> tuple[list[State], float]:
        """Return the states of a step of a size from a place, both in ticks, and its error over the allowed one."""
        whole, share = self._advance(state, at, size), 1.0
        if self._halves:
            middle = self._advance(state, at, size // 2)
            after = self._advance(middle, at + size // 2, size // 2)
            states, error, share = [middle, after], whole.displacement - after.displacement, size / (at + size)
        else:
            factor = self._integrator.steppers[0].scheme.displacement_factor - whole.step**2 / 6.0
            states, error = [whole], factor * (whole.acceleration - state.acceleration)
        allowed = self._time.tolerance * share * max(self._largest, self._norm(states[-1].displacement))
        missed = self._norm(error)
        return states, missed / allowed if allowed else float(missed > 0.0)

    def _norm(self, field: Floats) -> float:
        """Return the norm of a field (n,) [kg^(1/2) m]."""
        return float(np.sqrt(field @ (self._mass @ field)))

    def _advance(self, state: State, at: int, size: int) -> State:
        """Take a step of a size from a place, both in ticks."""
        assert self._span is not None
        end = self._span.start + (at + size) * self._tick
        if abs(end - self._span.end) < 0.5 * self._tick:
            end = self._span.end
        return self._integrator.advance({0: state}, np.array([end]), size * self._tick)[0][-1]


def _doublings(length: float, most: float) -> int:
    """Return how often a length [s] can be doubled up to another one [s], to rounding; very often up to infinity."""
    return math.floor(math.log2(most / length * (1.0 + 1e-9))) if np.isfinite(most) else 1 << 20


def _room(position: int, length: int) -> int:
    """Return the level of the longest step from a place on in an interval whose length is a power of two.

    Examples
    --------
    >>> [_room(place, 8) for place in range(8)]
    [3, 0, 1, 0, 2, 0, 1, 0]
    """
    return (position & -position if position else length).bit_length() - 1
