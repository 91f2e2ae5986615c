"""The loop over time with steps that control their own error."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fingerslip.dynamics.adaptive.errors import Errors
from fingerslip.dynamics.adaptive.spans import Span, spans_of
from fingerslip.dynamics.adaptive.takers import Taker, make_taker
from fingerslip.dynamics.motions import Marched, Motions
from fingerslip.dynamics.outside import OutsideCheck
from fingerslip.dynamics.recording.recorder import Recorder
from fingerslip.dynamics.rotations import RotationCheck
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.system.scheme import HHT
from fingerslip.errors import ConvergenceError
from fingerslip.linear.threads import single_dense_thread
from fingerslip.model.timing import Adaptive

__all__ = ["march_adaptive"]

# Steps are doubled after so many in a row whose double is expected to be within this part of the allowed error.
_GOOD, _MARGIN = 2, 0.9


@dataclass
class _Counts:
    """What the steps of a motion were."""

    taken: int = 0
    rejected: int = 0
    above: int = 0
    shortest: float = float("inf")
    longest: float = 0.0

    def take(self, length: float) -> None:
        """Count a step of a length [s]."""
        self.taken += 1
        self.shortest, self.longest = min(self.shortest, length), max(self.longest, length)


class _Walk:
    """One motion on its way through time."""

    def __init__(self, taker: Taker, time: Adaptive, errors: Errors, records: _Records) -> None:
        self._taker, self._time, self._errors, self._records = taker, time, errors, records
        self._halves = time.scheme == "quasi_static"
        # By how much the error over the allowed one grows with twice the step.
        self._growth = 2.0 if self._halves else 8.0
        self.counts = _Counts()

    def cross(self, state: State, span: Span) -> State:
        """Take a motion through a span, record by record; it begins with the smallest step."""
        finest = _finest(span.unit, self._time.shortest, least=int(self._halves))
        tick = span.unit / 2**finest
        self._span, self._tick, self._level, self._good = span, tick, int(self._halves), 0
        self._highest = _highest(tick, self._time.largest, least=self._level)
        first = 0
        for length in span.intervals():
            last = first + (length << finest)
            at = first
            while at < last:
                state, at = self._step(state, at, first, last)
            first = last
            self._records.record(state)
        return state

    def _step(self, state: State, at: int, first: int, last: int) -> tuple[State, int]:
        """Take one step from a place, in ticks of the span, within the interval between two records."""
        level = min(self._level, self._highest, _room(at - first, last - first))
        while True:
            lowest = level <= int(self._halves)
            try:
                states, error = self._try_step(state, at, level)
            except ConvergenceError:
                if lowest:
                    raise
                error = float("inf")
            if error <= 1.0 or lowest:
                break
            self.counts.rejected += 1
            level -= 1
            self._level, self._good = level, 0
        for element in states[:-1]:
            self._records.pass_by(element)
        after = at + (1 << level)
        if after < last:
            self._records.pass_by(states[-1])
        self._accept(states, error, level)
        return states[-1], after

    def _try_step(self, state: State, at: int, level: int) -> tuple[list[State], float]:
        """Return the states of a step, and its error over the allowed one."""
        size = 1 << level
        if not self._halves:
            after = self._take_step(state, at, size)
            scheme = self._taker.stepper.scheme
            assert isinstance(scheme, HHT)
            return [after], self._errors.of_step(state, after, scheme)
        whole = self._take_step(state, at, size)
        middle = self._take_step(state, at, size // 2)
        after = self._take_step(middle, at + size // 2, size // 2)
        return [middle, after], self._errors.of_halves(whole, after, size / (at + size))

    def _take_step(self, state: State, at: int, size: int) -> State:
        """Take a step of a size from a place, both in ticks."""
        position = at + size
        end = self._span.start + position * self._tick
        if abs(end - self._span.end) < 0.5 * self._tick:
            end = self._span.end
        return self._taker.take(state, end, size * self._tick)

    def _accept(self, states: list[State], error: float, level: int) -> None:
        """Take note of the states of a step, and decide how long the next one is."""
        self.counts.above += error > 1.0
        for state in states:
            self.counts.take(state.step)
            self._errors.accept(state)
        if level < self._level:
            return
        self._good = self._good + 1 if error * self._growth <= _MARGIN else 0
        if self._good >= _GOOD and level < self._highest:
            self._level, self._good = level + 1, 0


class _Records:
    """The recorder and the checks of a motion."""

    def __init__(self, motions: Motions, number: int) -> None:
        system = motions.systems[number]
        self.recorder = Recorder(motions.models[number], system, motions.times[number])
        self._watch, self._progress = motions.watch, motions.progress
        self._end = float(motions.times[number][-1])
        self._checks = (OutsideCheck(system), RotationCheck(system))

    def record(self, state: State) -> None:
        """Record a state."""
        with self._watch.part("recording"):
            self._look(state)
            self.recorder.record(state)
        if self._progress is not None:
            self._progress(min(state.time / self._end, 1.0))

    def pass_by(self, state: State) -> None:
        """Look at a state between records."""
        with self._watch.part("recording"):
            self._look(state)
            self.recorder.pass_by(state)

    def _look(self, state: State) -> None:
        for check in self._checks:
            check.look(state)

    def finish(self) -> None:
        """Complete checks and records."""
        for check in self._checks:
            check.finish()
        with self._watch.part("recording"):
            self.recorder.complete()


def march_adaptive(motions: Motions, number: int) -> Marched:
    """Compute one motion with steps that control their own error."""
    model, system = motions.models[number], motions.systems[number]
    time = model.time
    assert isinstance(time, Adaptive)
    with motions.watch.part("assembly"):
        records = _Records(motions, number)
    taker = make_taker(motions, number, records.recorder.nbytes)
    walk = _Walk(taker, time, Errors(system.mass, time.tolerance), records)
    with motions.watch.part("stepping"), single_dense_thread():
        state = taker.first()
        records.recorder.record(state)
        for span in spans_of(model, time):
            state = walk.cross(replace(state, working_set=None), span)
        records.finish()
    attributes = {"basis": "full", **taker.attributes, **_attributes(walk.counts, time)}
    return Marched((taker.stepper,), (records.recorder,), attributes)


def _attributes(counts: _Counts, time: Adaptive) -> dict[str, object]:
    """Return what histories say of the steps."""
    return {
        "time_step": "auto",
        "time_tolerance": time.tolerance,
        "steps_taken": counts.taken,
        "steps_rejected": counts.rejected,
        "steps_above_tolerance": counts.above,
        "shortest_step": counts.shortest,
        "longest_step": counts.longest,
    }


def _finest(unit: float, shortest: float, *, least: int) -> int:
    """Return how often a unit [s] can be halved without getting shorter than the shortest step [s]."""
    smallest = least
    while unit / 2 ** (smallest + 1) >= shortest * (1.0 - 1e-9):
        smallest += 1
    return smallest


def _highest(tick: float, largest: float | None, *, least: int) -> int:
    """Return the level of the longest step that is allowed: 2^level ticks [s]."""
    if largest is None:
        return 1 << 20
    highest = least
    while tick * 2 ** (highest + 1) <= largest * (1.0 + 1e-9):
        highest += 1
    return highest


def _room(position: int, length: int) -> int:
    """Return the level of the longest step from a place on in an interval whose length is a power of two.

    Examples
    --------
    >>> [_room(place, 8) for place in range(8)]
    [3, 0, 1, 0, 2, 0, 1, 0]
    """
    return (position & -position if position else length).bit_length() - 1
