"""The one loop over time: it drives an integrator, and observers take the states of each motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.integrator import Integrator
from fingerslip.dynamics.recording.recorder import Recorder
from fingerslip.dynamics.state_checks import Check, OutsideCheck, RotationCheck, Steps
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.stepper import Stopwatch
from fingerslip.dynamics.system.system import System

S = TypeVar("S")
S_contra = TypeVar("S_contra", contravariant=True)
Array = NDArray[np.float64]

# Steps that are checked together, behind the first state.
_AT_ONCE = 32


class Observer(Protocol[S_contra]):
    """Records and checks the states of one motion, the first included."""

    @property
    def room(self) -> int:
        """Steps that may be recorded together next."""

    def record(self, state: S_contra) -> None:
        """Check and record the next state, or several, time first in their arrays."""

    def finish(self) -> None:
        """Finish the checks of what was recorded."""


class BodyObserver:
    """The records of the motion of a deformable body, and the checks of its states."""

    def __init__(self, recorder: Recorder, system: System, checks: Sequence[Check] = ()) -> None:
        self.recorder = recorder
        self._checks: Sequence[Check] = (OutsideCheck(system), RotationCheck(system), *checks)
        self._waiting: list[Steps] = []
        self._count, self._at_once = 0, 1

    @property
    def room(self) -> int:
        """Steps that may be recorded together next."""
        return self.recorder.room

    def record(self, state: State) -> None:
        """Check and record the next state, or several; refuse slip beside candidates, and bodies turned far."""
        self._wait(state)
        self.recorder.record(state)

    def pass_by(self, state: State) -> None:
        """Check a state between records."""
        self._wait(state)
        self.recorder.pass_by(state)

    def finish(self) -> None:
        """Finish the checks."""
        self._look()
        for check in self._checks:
            check.finish()

    def _wait(self, state: State) -> None:
        """Look at states several at once, as each look costs."""
        self._waiting.append(Steps.of(state))
        self._count += np.size(state.time)
        if self._count >= self._at_once:
            self._look()
            self._at_once = _AT_ONCE

    def _look(self) -> None:
        if self._waiting:
            steps, self._waiting, self._count = Steps.join(self._waiting), [], 0
            for check in self._checks:
                check.look(steps)


class Loop(Generic[S]):
    """Motions on their way through time: an integrator takes their steps, and an observer the states of each.

    `times` (n_times,) [s] of each are those of its records, the start included, equal but for their number.
    """

    def __init__(
        self, integrator: Integrator[S], observers: Sequence[Observer[S]], times: Sequence[Array], watch: Stopwatch
    ) -> None:
        self._integrator, self._observers, self._times, self._watch = integrator, observers, times, watch
        self.times = max(times, key=len)
        self.taken = 0
        self.states = integrator.start()
        for number, state in self.states.items():
            observers[number].record(state)

    @property
    def last(self) -> int:
        """How many steps the longest motion has."""
        return self.times.size - 1

    @property
    def time(self) -> float:
        """Time that was reached [s]."""
        return float(self.times[self.taken])

    def step(self, most: int = 1) -> None:
        """Take the next step, or up to `most` of them where the integrator takes several at once."""
        moving = {number: state for number, state in self.states.items() if self.taken < self._times[number].size - 1}
        ends = [self._times[number].size - 1 - self.taken for number in moving]
        count = min(most, *ends, *(self._observers[number].room for number in moving))
        after = self._integrator.advance(moving, self.times[self.taken + 1 : self.taken + 1 + count])
        steps: Sequence[Any] = ()
        with self._watch.part("recording"):
            for number, (state, steps) in after.items():
                self.states[number] = state
                for some in steps:
                    self._observers[number].record(some)
        self.taken += sum(np.size(some.time) for some in steps)

    def run(self, progress: Callable[[float], None] | None = None) -> None:
        """Take all steps, and finish the checks."""
        while self.taken < self.last:
            self.step(most=self.last)
            if progress is not None:
                progress(self.taken / self.last)
        self.finish()

    def finish(self) -> None:
        """Finish the checks of the steps that were taken."""
        for observer in self._observers:
            observer.finish()
