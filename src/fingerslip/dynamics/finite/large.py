"""One motion at large strain: see :mod:`fingerslip.dynamics.finite.iteration` for a step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from fingerslip.arrays import Floats
from fingerslip.dynamics.finite.factors import Factors
from fingerslip.dynamics.finite.iteration import advance_finite
from fingerslip.dynamics.loop import BodyIntegrator, ByLength
from fingerslip.dynamics.step.state import State, first_state
from fingerslip.dynamics.step.stepper import Stepper, Stopwatch
from fingerslip.dynamics.system.scheme import Scheme, make_scheme, static
from fingerslip.dynamics.system.system import System
from fingerslip.errors import ConvergenceError
from fingerslip.linear.solver import LinearSolver
from fingerslip.materials.elastic import RayleighDamping
from fingerslip.model.model import Model
from fingerslip.model.timing import Adaptive, QuasiStatic, TimeStepping

# How often a step may be halved.
_DEEPEST = 6


class Large(BodyIntegrator):
    """One motion at large strain; a step of the model that is not solved is taken in halves."""

    def __init__(
        self,
        model: Model,
        system: System,
        solver: LinearSolver,
        watch: Stopwatch,
        reserved_bytes: int,
        *,
        halvings: int = _DEEPEST,
    ) -> None:
        self._time, self._damping, self._system = model.time, model.damping, system
        self._solver, self._watch, self._reserved, self._halvings = solver, watch, reserved_bytes, halvings
        self._step = model.time.shortest if isinstance(model.time, Adaptive) else make_scheme(model.time).step
        # In 3D the memory has no room for more factors: those of whole steps are made again after halved ones.
        most = 1 if system.space.dim == 3 else halvings + 1
        self._factors = ByLength(self._make, most=4 if isinstance(model.time, Adaptive) else most)
        self._in_use = self._factors.at(self._step)
        self._counts = {"newton_iterations": 0, "factorisations": 0, "halved_steps": 0}

    @property
    def steppers(self) -> Sequence[Stepper]:
        """The stepper of the last step."""
        return [self._in_use.current]

    @property
    def attributes(self) -> Mapping[str, object]:
        """What a history says of how it was computed."""
        return {"basis": "full", **self._counts}

    def start(self) -> dict[int, State]:
        """Return the state at time zero."""
        self._counts["factorisations"] += 1
        return {0: first_state(self._in_use.renew(self._system.require_body().at_rest(self._step)))}

    def advance(self, states: Mapping[int, State], ends: Floats, length: float | None = None) -> dict[int, list[State]]:
        """Take the next step; who names its length halves it where it is not solved."""
        end = float(ends[0])
        return {0: [self._solve_or_halve(states[0], end, 0) if length is None else self._solve(states[0], end, length)]}

    def renewed(self, state: State) -> Stepper | None:
        """Return the stepper with the tangent of a state, which serves on; None where this is not definite."""
        self._counts["factorisations"] += 1
        stepper = self._in_use.renew(state.large_body, rough=False)
        return None if self._in_use.is_positive else stepper

    def release(self) -> None:
        """Let go of all factors: in 3D there is no memory for those of the next motion beside them."""
        for _, factors in self._factors.entries():
            factors.release()

    def steer(self, system: System) -> None:
        """Go on with a system whose counterfaces or loads are others from now on."""
        self._system = system
        for _, factors in self._factors.entries():
            factors.steer(system)

    def saved_state(self) -> Any:
        """Return what :meth:`restore` needs, as plain data and arrays."""
        return self._counts, [(length, factors.saved_state()) for length, factors in self._factors.entries()]

    def restore(self, saved: Any) -> None:
        """Go on where :meth:`saved_state` was called."""
        counts, kept = saved
        self._counts = dict(counts)
        for length, factors in kept:
            self._factors.at(length).restore(*factors)

    def _make(self, length: float) -> Factors:
        """Make the factors of steps of a length [s]; a scheme of a user's own has no other than its own."""
        time = self._time
        if isinstance(time, Adaptive):
            time = time.fixed(length)
        elif isinstance(time, TimeStepping | QuasiStatic):
            time = replace(time, step=length)
        of_model = self._system, make_scheme(time), self._damping, self._solver
        return Factors(*of_model, watch=self._watch, reserved_bytes=self._reserved)

    def _solve_or_halve(self, state: State, end: float, depth: int) -> State:
        """Take one step to a time [s], or two halves of it where it is not solved."""
        try:
            return self._solve(state, end, self._step / 2**depth)
        except ConvergenceError:
            # A scheme of one's own may have no shorter step.
            if depth == self._halvings or isinstance(self._time, Scheme):
                raise
        self._counts["halved_steps"] += 1
        middle = 0.5 * (state.time + end)
        return self._solve_or_halve(self._solve_or_halve(state, middle, depth + 1), end, depth + 1)

    def _solve(self, state: State, end: float, length: float) -> State:
        """Take one step of a length [s] to a time [s]."""
        system, is_damped = self._system, self._damping != RayleighDamping() or self._system.dampers is not None
        if not isinstance(self._time, QuasiStatic) or is_damped or system.require_body().relaxes:
            self._in_use = self._factors.at(length)
        else:
            # At rest the factors of one length serve all, unless rates matter.
            self._in_use = self._factors.at(self._step)
            self._in_use.rescale(static(length))
        before = self._in_use.count
        try:
            after, iterations = advance_finite(self._in_use, state, end)
        finally:
            self._counts["factorisations"] += self._in_use.count - before
        self._counts["newton_iterations"] += iterations
        return after
