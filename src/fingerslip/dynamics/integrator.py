"""What an integrator is: it takes the steps of motions, states in, states out; the loop over time drives it."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.stepper import Stepper
from fingerslip.dynamics.system.system import System

S = TypeVar("S")
T = TypeVar("T")
Array = NDArray[np.float64]


class Integrator(Protocol[S]):
    """Takes the steps of motions that are numbered from 0; what the loop over time drives."""

    def start(self) -> dict[int, S]:
        """Return the states of all motions at time zero."""

    def advance(self, states: Mapping[int, S], ends: Array) -> dict[int, tuple[S, list[S]]]:
        """Take the next step of some motions, or as many as are taken at once, to times (k,) [s].

        Of each motion, return the last state and the states of its steps, one by one or some together, time first in
        their arrays. A step that is not solved is a ConvergenceError.
        """


class BodyIntegrator(Integrator[State], Protocol):
    """Takes the steps of deformable bodies that share their matrices, and can be steered, saved and restored."""

    @property
    def steppers(self) -> Sequence[Stepper]:
        """What stayed the same in the last step of each motion."""

    @property
    def attributes(self) -> Mapping[str, object]:
        """What histories say of how they were computed."""
        return {}

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
