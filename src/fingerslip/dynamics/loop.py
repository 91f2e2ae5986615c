"""The one loop over time: it drives an integrator, and observers record and check the states of each motion."""

from __future__ import annotations

import logging
from collections import Counter, OrderedDict
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

import numpy as np
from scipy import sparse

from fingerslip.arrays import Floats
from fingerslip.contact.candidates import check_outsiders
from fingerslip.dynamics.recording.recorder import Recorder
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch
from fingerslip.dynamics.system.system import System
from fingerslip.errors import InputError

S = TypeVar("S")
S_contra = TypeVar("S_contra", contravariant=True)
T = TypeVar("T")

# Steps that are checked together, behind the first state.
_AT_ONCE = 32
# About one axis any angle is exact. Angles about several axes are added as if they were small: turned by one, the axis
# of another is wrong by the angle, 10 % at the first, where the user is warned, 20 % at the second, which is refused.
_WARN, _REFUSE = 0.1, 0.2

_logger = logging.getLogger("fingerslip.dynamics")


class Integrator(Protocol[S]):
    """Takes the steps of motions that are numbered from 0; what the loop over time drives."""

    @property
    def attributes(self) -> Mapping[str, object]:
        """What histories say of how they were computed."""
        return {}

    def start(self) -> dict[int, S]:
        """Return the states of all motions at time zero."""

    def advance(self, states: Mapping[int, S], ends: Floats) -> dict[int, list[S]]:
        """Take the next step of some motions, or as many as are taken at once, to times (k,) [s].

        Of each motion, return the states of its steps, one by one or some together, time first in arrays. It goes on
        from the last of them.
        """


class Observer(Protocol[S_contra]):
    """Records and checks the states of one motion, the first included."""

    @property
    def room(self) -> int:
        """Steps that may be recorded together next."""
        return 1

    def record(self, state: S_contra) -> None:
        """Check and record the next state, or several, time first in their arrays."""

    def finish(self) -> None:
        """Finish the checks of what was recorded."""
        return


class Loop(Generic[S]):
    """Motions through time: an integrator takes their steps, an observer the states of each at its times [s].

    They begin at rest, or where `states` says.
    """

    def __init__(
        self,
        integrator: Integrator[S],
        observers: Sequence[Observer[S]],
        times: Sequence[Floats],
        watch: Stopwatch,
        states: dict[int, S] | None = None,
    ) -> None:
        self._integrator, self._observers, self._times, self._watch = integrator, observers, times, watch
        self.times = max(times, key=len)
        self.steps_taken = 0
        self.states = integrator.start() if states is None else states
        for number, state in self.states.items():
            observers[number].record(state)

    @property
    def attributes(self) -> Mapping[str, object]:
        """What histories say of how they were computed."""
        return self._integrator.attributes

    @property
    def n_steps(self) -> int:
        """How many steps the longest motion has."""
        return self.times.size - 1

    @property
    def time(self) -> float:
        """Time that was reached [s]."""
        return float(self.times[self.steps_taken])

    def step(self, most: int = 1) -> None:
        """Take the next step, or up to `most` of them where the integrator takes several at once."""
        left = {number: self._times[number].size - 1 - self.steps_taken for number in self.states}
        moving = {number: state for number, state in self.states.items() if left[number] > 0}
        count = min(most, *(min(left[number], self._observers[number].room) for number in moving))
        after = self._integrator.advance(moving, self.times[self.steps_taken + 1 : self.steps_taken + 1 + count])
        steps: Sequence[Any] = ()
        with self._watch.part("recording"):
            for number, steps in after.items():
                self.states[number] = steps[-1]
                for some in steps:
                    self._observers[number].record(some)
        self.steps_taken += sum(np.size(some.time) for some in steps)

    def run(self, progress: Callable[[float], None] | None = None) -> None:
        """Take all steps, and finish the checks."""
        while self.steps_taken < self.n_steps:
            self.step(most=self.n_steps)
            if progress is not None:
                progress(self.steps_taken / self.n_steps)
        self.finish()

    def finish(self) -> None:
        """Finish the checks of the steps that were taken."""
        for observer in self._observers:
            observer.finish()


class BodyIntegrator(Integrator[State], Protocol):
    """Takes the steps of deformable bodies that share their matrices, and can be steered, saved and restored."""

    @property
    def steppers(self) -> Sequence[Stepper]:
        """What stayed the same in the last step of each motion."""

    def advance(self, states: Mapping[int, State], ends: Floats, length: float | None = None) -> dict[int, list[State]]:
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


class BodyObserver:
    """The records of the motion of a deformable body, and the checks of its states."""

    def __init__(self, recorder: Recorder, system: System, checks: Sequence[Check] = ()) -> None:
        self.recorder = recorder
        outside = (OutsideCheck(system, number) for number in range(len(system.outsiders)))
        self._checks: Sequence[Check] = (*outside, RotationCheck(system), *checks)
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
            steps = Steps(*map(np.concatenate, zip(*self._waiting, strict=True)))
            self._waiting, self._count = [], 0
            for check in self._checks:
                check.look(steps)


class Steps(NamedTuple):
    """What checks look at: k states of a motion."""

    time: Floats  # (k,) [s]
    displacement: Floats  # (k, n) [m]
    velocity: Floats  # (k, n) [m/s]
    acceleration: Floats  # (k, n) [m/s^2]
    counterfaces: Floats  # (k, n_counterfaces, dim), their prescribed displacement [m]

    @staticmethod
    def of(state: State) -> Steps:
        """Return what of a state, or of several, time first in their arrays, is looked at; nothing else is kept."""
        times = np.ravel(state.time)
        fields = state.displacement, state.velocity, state.acceleration
        displacement, velocity, acceleration = map(np.atleast_2d, fields)
        travel = state.counterfaces.reshape(times.size, *state.counterfaces.shape[-2:])
        return Steps(times, displacement, velocity, acceleration, travel)


class Check(Protocol):
    """Looks at every state of a motion, the first included."""

    def look(self, steps: Steps) -> None:
        """Look at states."""

    def finish(self) -> None:
        """Say what is to be said of all of them."""
        return


class OutsideCheck(Check):
    """Refuses that a counterface reaches nodes beside its candidates.

    Gaps to what is flat need but one displacement of each of these k nodes.
    """

    def __init__(self, system: System, number: int) -> None:
        self._outsiders, self._shape = system.outsiders[number], system.counterfaces.shapes[number]
        self._number, rotations = number, system.rotations
        self._rotations = rotations if rotations is not None and rotations.axes[:, number].any() else None
        # The unknowns that they depend on, and the map from these to their displacement, or to that along the normal.
        moved: Any = self._outsiders.relative
        self._columns = np.unique(moved.indices) if sparse.issparse(moved) else np.flatnonzero(moved.any(axis=0))
        self._moved = moved[:, self._columns]
        if self._rotations is None and self._shape.is_flat:
            normal = self._shape.unit_normal[None]
            self._moved = sparse.kron(sparse.identity(len(self._outsiders.nodes)), normal, format="csr") @ self._moved

    def look(self, steps: Steps) -> None:
        """Check states; refuse slip outside."""
        outsiders, gaps = self._outsiders, self._gaps(steps.displacement, steps.counterfaces[:, self._number])
        for time, row in zip(steps.time.tolist(), gaps, strict=True):
            check_outsiders(
                *(row, outsiders.nodes, outsiders.positions, time),
                shape=self._shape,
                number=self._number,
                searched=outsiders.searched,
            )

    def _gaps(self, fields: Floats, travel: Floats) -> Floats:
        """Return the gaps (n, k) [m] for displacements of all unknowns (n, m) and of the counterface (n, dim) [m]."""
        positions, moved = self._outsiders.positions, (self._moved @ fields[:, self._columns].T).T
        if self._shape.is_flat and self._rotations is None:
            return np.asarray(self._shape.gap(positions) + moved - (travel @ self._shape.unit_normal)[:, None])
        points = positions + moved.reshape(len(fields), *positions.shape) - travel[:, None]
        if self._rotations is not None:
            counterface = np.full(len(positions), self._number)
            turned = self._rotations.matrices(fields[:, self._rotations.at])[:, counterface]
            points = self._rotations.seen(turned, points, counterface)
        return self._shape.gap(points.reshape(-1, positions.shape[1])).reshape(len(fields), -1)


class RotationCheck(Check):
    """Looks at the rotations of those of a motion's rigid bodies that are free about several axes."""

    def __init__(self, system: System) -> None:
        pairs = zip(system.coordinates.rigid, system.unknowns.freedoms, strict=True)
        rigid = [(at, freedom) for at, freedom in pairs if freedom.turns]
        axes = Counter(freedom.body for _, freedom in rigid)
        turning = [(at, freedom) for at, freedom in rigid if axes[freedom.body] > 1]
        self._at = np.array([at for at, _ in turning], dtype=np.int64)
        self._names = [f"bodies.{freedom.body}.free.{freedom.direction}" for _, freedom in turning]
        self._largest = np.zeros(self._at.size)

    def look(self, steps: Steps) -> None:
        """Check states; refuse a body that has turned too far to call that small."""
        if not self._names:
            return
        angles = np.abs(steps.displacement[:, self._at])
        self._largest = np.maximum(self._largest, angles.max(axis=0))
        beyond = np.flatnonzero(angles.max(axis=1) > _REFUSE)
        if beyond.size:
            first, worst = beyond[0], int(angles[beyond[0]].argmax())
            fault = f"the body has turned by {angles[first, worst]:.3g} rad at t = {steps.time[first]:.6g} s"
            repair = "hold it by a stiffer spring, a damper or another contact, or leave the rotation out of free"
            allowed = f"rotations about several axes are small, up to {_REFUSE:g} rad"
            raise InputError(self._names[worst], fault, allowed, repair)

    def finish(self) -> None:
        """Warn of rotations that were not very small."""
        for name, angle in zip(self._names, self._largest, strict=True):
            if angle > _WARN:
                _logger.warning(
                    "%s: the body turned by up to %.3g rad, taken as small about several axes: results are rough",
                    *(name, angle),
                )
