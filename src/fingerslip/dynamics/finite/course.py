"""One motion at large strain, step by step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import is_dataclass, replace
from typing import Any

from fingerslip.dynamics.finite.factors import Factors
from fingerslip.dynamics.finite.newton import advance_finite
from fingerslip.dynamics.step.state import State, first_state
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch
from fingerslip.dynamics.system.scheme import make_scheme
from fingerslip.dynamics.system.system import System
from fingerslip.errors import ConvergenceError
from fingerslip.linear.solver import LinearSolver
from fingerslip.model.model import Model

__all__ = ["FiniteCourse"]

# How often a step may be halved.
_DEEPEST = 6


class FiniteCourse:
    """One motion at large strain, with the factors of its step and of halves of it.

    Units: reserved_bytes [bytes].
    """

    def __init__(
        self, model: Model, system: System, solver: LinearSolver, watch: Stopwatch, reserved_bytes: int
    ) -> None:
        self._model, self._system, self._watch = model, system, watch
        self._solver, self._reserved = solver, reserved_bytes
        self._factors: dict[int, Factors] = {}
        self._iterations = self._halved = 0

    @property
    def stepper(self) -> Stepper:
        """The stepper of whole steps."""
        stepper = self._of(0).stepper
        if stepper is None:
            raise ValueError("the motion has not started")
        return stepper

    @property
    def attributes(self) -> Mapping[str, object]:
        """What a history says of how it was computed."""
        return {
            "basis": "full",
            "newton_iterations": self._iterations,
            "factorisations": sum(factors.count for factors in self._factors.values()),
            "halved_steps": self._halved,
        }

    def start(self) -> State:
        """Return the state at time zero."""
        at_rest = self._system.require_body().at_rest(make_scheme(self._model.time).step)
        return first_state(self._of(0).renew(at_rest))

    def advance(self, state: State, end: float) -> State:
        """Take a step to a time [s], or as many parts of it as it needs."""
        return self._advance(state, end, 0)

    def steer(self, system: System) -> None:
        """Go on with a system whose counterfaces or loads are others from now on."""
        self._system = system
        for factors in self._factors.values():
            factors.steer(system)

    def saved_state(self) -> Any:
        """Return what :meth:`restore` needs, as plain data and arrays."""
        return (
            self._iterations,
            self._halved,
            {str(depth): factor.saved_state() for depth, factor in self._factors.items()},
        )

    def restore(self, saved: Any) -> None:
        """Go on where :meth:`saved_state` was called."""
        self._iterations, self._halved, factors = saved
        for depth, factor in factors.items():
            self._of(int(depth)).restore(*factor)

    def _of(self, depth: int) -> Factors:
        """Return the factors of a step that was halved some times."""
        if depth not in self._factors:
            time = self._model.time
            shorter = replace(time, step=time.step / 2**depth) if depth else time  # type: ignore[type-var]
            arguments = self._model.damping, self._solver, self._watch, self._reserved
            self._factors[depth] = Factors(self._system, make_scheme(shorter), *arguments)
        return self._factors[depth]

    def _advance(self, state: State, end: float, depth: int) -> State:
        """Take one step, or two halves of it where it is not solved."""
        shift = self._system.displacements(end)
        try:
            after, iterations = advance_finite(self._of(depth), state, end, shift, watch=self._watch)
        except ConvergenceError:
            # A scheme of one's own may have no shorter step.
            if depth == _DEEPEST or not is_dataclass(self._model.time):
                raise
            self._halved += 1
            middle = 0.5 * (state.time + end)
            return self._advance(self._advance(state, middle, depth + 1), end, depth + 1)
        self._iterations += iterations
        return after
