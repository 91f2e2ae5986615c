"""Single steps of any length of one motion; the factors of the last lengths are kept."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import replace
from typing import Generic, Protocol, TypeVar

from fingerslip.dynamics.finite.factors import Factors
from fingerslip.dynamics.finite.newton import advance_finite
from fingerslip.dynamics.motions import Motions
from fingerslip.dynamics.step.state import State, first_state
from fingerslip.dynamics.step.step import advance
from fingerslip.dynamics.step.stepper import Stepper, build_stepper
from fingerslip.dynamics.system.scheme import Scheme, make_scheme
from fingerslip.model.timing import Adaptive

__all__ = ["KEPT", "Kept", "Taker", "make_taker"]

T = TypeVar("T")

#: How many lengths of steps keep their factors.
KEPT = 4


class Taker(Protocol):
    """Takes the steps of one motion."""

    @property
    def stepper(self) -> Stepper:
        """What stayed the same in the last step."""

    @property
    def attributes(self) -> dict[str, int]:
        """What histories say of the factors."""

    def first(self) -> State:
        """Return the state at the start."""

    def take(self, state: State, end: float, length: float) -> State:
        """Return the state after a step of a length [s] to a time [s]; raise ConvergenceError where there is none."""


class Kept(Generic[T]):
    """What is made for the length of a step: the last few are kept.

    Units: make [s].

    Examples
    --------
    >>> kept = Kept(lambda length: [length], most=2)
    >>> first = kept.at(1.0)
    >>> kept.at(2.0) and kept.at(1.0) is first, kept.made
    (True, 2)
    >>> kept.at(4.0) and kept.at(1.0) is first, kept.at(2.0) and kept.made
    (True, 4)
    """

    def __init__(self, make: Callable[[float], T], most: int = KEPT) -> None:
        self._make, self._most = make, most
        self._last: OrderedDict[str, T] = OrderedDict()
        self.made = 0

    def at(self, length: float) -> T:
        """Return that of a length [s]; lengths that differ by rounding are one."""
        key = f"{length:.9e}"
        if key not in self._last:
            while len(self._last) >= self._most:
                self._last.popitem(last=False)
            self._last[key] = self._make(length)
            self.made += 1
        self._last.move_to_end(key)
        return self._last[key]


class _Small:
    """Steps at small strain."""

    def __init__(self, motions: Motions, number: int, reserved_bytes: int) -> None:
        self._motions, self._model, self._system = motions, motions.models[number], motions.systems[number]
        self._reserved = reserved_bytes
        self._steppers = Kept(self._make_factors)

    def _make_factors(self, length: float) -> Stepper:
        motions, model = self._motions, self._model
        with motions.watch.part("factorisation"):
            return build_stepper(
                self._system,
                _scheme(model.time, length),
                model.damping,
                solver=motions.solver,
                reserved_bytes=self._reserved,
            )

    @property
    def stepper(self) -> Stepper:
        return self._stepper

    @property
    def attributes(self) -> dict[str, int]:
        return {"factorisations": self._steppers.made}

    def first(self) -> State:
        self._stepper = self._steppers.at(_shortest(self._model.time))
        return first_state(self._stepper)

    def take(self, state: State, end: float, length: float) -> State:
        self._stepper = self._steppers.at(length)
        state, shift = _for_length(state, self._stepper), self._system.displacements(end)
        return advance([self._stepper], [state], end, [shift], watch=self._motions.watch)[0]


class _Large:
    """Steps at large strain."""

    def __init__(self, motions: Motions, number: int, reserved_bytes: int) -> None:
        self._motions, self._model, self._system = motions, motions.models[number], motions.systems[number]
        self._reserved, self._iterations, self._renewed = reserved_bytes, 0, 0
        self._factors = Kept(self._make_factors)

    def _make_factors(self, length: float) -> Factors:
        motions, scheme = self._motions, _scheme(self._model.time, length)
        return Factors(self._system, scheme, self._model.damping, motions.solver, motions.watch, self._reserved)

    @property
    def stepper(self) -> Stepper:
        stepper = self._last.stepper
        assert stepper is not None  # every step begins with one
        return stepper

    @property
    def attributes(self) -> dict[str, int]:
        return {"newton_iterations": self._iterations, "factorisations": self._renewed}

    def first(self) -> State:
        self._last = self._factors.at(_shortest(self._model.time))
        at_rest = self._system.require_body().at_rest(_shortest(self._model.time))
        state = first_state(self._last.renew(at_rest))
        self._renewed += 1
        return state

    def take(self, state: State, end: float, length: float) -> State:
        self._last = self._factors.at(length)
        before = self._last.count
        try:
            shift = self._system.displacements(end)
            after, iterations = advance_finite(self._last, state, end, shift, watch=self._motions.watch)
        finally:
            self._renewed += self._last.count - before
        self._iterations += iterations
        return after


def make_taker(motions: Motions, number: int, reserved_bytes: int) -> Taker:
    """Return what takes the steps of a motion.

    Units: reserved_bytes [bytes].
    """
    return (_Large if motions.models[number].is_finite else _Small)(motions, number, reserved_bytes)


def _scheme(time: object, length: float) -> Scheme:
    assert isinstance(time, Adaptive)
    return make_scheme(time.fixed(length))


def _shortest(time: object) -> float:
    assert isinstance(time, Adaptive)
    return time.shortest


def _for_length(state: State, stepper: Stepper) -> State:
    """Return a state from which a step may start: what the contact keeps belongs to the step that found it."""
    return state if state.step == stepper.scheme.step else replace(state, working_set=None)
