"""The one loop over time: it drives an integrator, and observers take the states of each motion."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.recording.recorder import Recorder
from fingerslip.dynamics.state_checks import Check, OutsideCheck, RotationCheck, Steps
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch
from fingerslip.dynamics.system.system import System

S = TypeVar("S")
T = TypeVar("T")
Array = NDArray[np.float64]


class Integrator(Protocol[S]):
    """Takes the steps of motions that are numbered from 0; what the loop over time drives."""

    @property
    def attributes(self) -> Mapping[str, object]:
        """What histories say of how they were computed."""
        return {}

    def start(self) -> dict[int, S]:
        """Return the states of all motions at time zero."""

    def advance(self, states: Mapping[int, S], ends: Array) -> dict[int, tuple[S, list[S]]]:
        """Take the next step of some motions, or as many as are taken at once, to times (k,) [s].

        Of each motion, return the last state and those of its steps, one by one or some together, time first in arrays.
        """


class BodyIntegrator(Integrator[State], Protocol):
    """Takes the steps of deformable bodies that share their matrices, and can be steered, saved and restored."""

    @property
    def steppers(self) -> Sequence[Stepper]:
        """What stayed the same in the last step of each motion."""

    def advance(
        self, states: Mapping[int, State], ends: Array, length: float | None = None
    ) -> dict[int, tuple[State, list[State]]]:
        """Take the next steps; one may have another length [s] than the model's own."""

    def steer(self, system: System) -> None:
        """Go on with a system whose counterfaces or loads are others from now on: of a single motion."""

    def saved_state(self) -> Any:
        """Return what :meth:`restore` needs, as plain data and arrays: nothing where factors are those of the model."""
        return None

    def restore(self, saved: Any) -> None:
        """Go on where :meth:`saved_state` was called."""
        assert saved is None


class ByLength(Generic[T]):
    """What is made for the length of a step [s]: the last few are kept.

    Examples
    --------
    >>> lists = ByLength(lambda length: [length], most=2)
    >>> first = lists.at(1.0)
    >>> lists.at(2.0) and lists.at(1.0) is first, lists.count
    (True, 2)
    >>> lists.at(4.0) and lists.at(1.0) is first, lists.at(2.0) and lists.count
    (True, 4)
    """

    def __init__(self, make: Callable[[float], T], most: int = 4) -> None:
        self._make, self._most = make, most
        self._last: OrderedDict[str, tuple[float, T]] = OrderedDict()
        self.count = 0

    def at(self, length: float) -> T:
        """Return that of a length; lengths that differ by rounding are one."""
        key = f"{length:.9e}"
        if key not in self._last:
            while len(self._last) >= self._most:
                self._last.popitem(last=False)
            self._last[key] = length, self._make(length)
            self.count += 1
        self._last.move_to_end(key)
        return self._last[key][1]

    def entries(self) -> list[tuple[float, T]]:
        """Return the lengths, and what is kept of each."""
        return list(self._last.values())


S_contra = TypeVar("S_contra", contravariant=True)

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
    """Motions through time: an integrator takes their steps, an observer the states of each at its times [s]."""

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
    def attributes(self) -> Mapping[str, object]:
        """What histories say of how they were computed."""
        return self._integrator.attributes

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
